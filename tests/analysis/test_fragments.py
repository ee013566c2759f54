"""Fragments, arrival of a signal, restitution, pores, pair correlation: against what is known."""

from importlib import import_module

import numpy as np
import pytest
import snapshots
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from synthetic import make_run

from dusttaichi import analysis, plots
from dusttaichi.analysis.frame import Frame
from dusttaichi.analysis.pores import Surfaces, measure_frame_pores
from dusttaichi.analysis.structure import BINS, FARTHEST, compute_pair_correlation
from dusttaichi.errors import DustError

R = 0.6e-6
NAN = float("nan")


def open_snapshots(path, frames, radius=R, **options):
    return analysis.open_run(snapshots.write(path / "result.nc", frames, radius, **options))


# Fragments.


@pytest.fixture(scope="module")
def scattered_grains(tmp_path_factory):
    """80 grains of several sizes with random contacts: open file, frame, pairs."""
    rng = np.random.default_rng(4)
    pairs = rng.integers(0, 80, (55, 2))
    pairs = pairs[pairs[:, 0] != pairs[:, 1]]
    frame = {
        name: scale * rng.normal(size=(80, 3))
        for name, scale in (("position", 1e-5), ("velocity", 3.0), ("spin", 1e6))
    } | {"pairs": pairs}
    radius = R * rng.uniform(0.5, 1.5, 80)
    with open_snapshots(tmp_path_factory.mktemp("f"), [frame], radius) as run:
        yield run, frame, radius


def test_fragments_are_those_of_a_brute_force_search(scattered_grains):
    run, frame, radius = scattered_grains
    fragments = analysis.find_fragments(run)
    graph = coo_array((np.ones(len(frame["pairs"])), frame["pairs"].T), shape=(80, 80))
    count, label = connected_components(graph, directed=False)
    expected = {frozenset(np.flatnonzero(label == k)) for k in range(count)}
    assert len(fragments) == count > 5
    brute_fragments = [frozenset(np.flatnonzero(fragments.label == k)) for k in range(count)]
    assert set(brute_fragments) == expected
    assert np.all(np.diff(fragments.mass) <= 0)
    mass = 4 / 3 * np.pi * radius**3 * snapshots.DENSITY
    for k, members in enumerate(brute_fragments):
        numbers = sorted(members)
        m, x, v, w = (
            a[numbers] for a in (mass, frame["position"], frame["velocity"], frame["spin"])
        )
        total = m.sum()
        centre = sum(mi * xi for mi, xi in zip(m, x, strict=True)) / total
        velocity = sum(mi * vi for mi, vi in zip(m, v, strict=True)) / total
        momentum = sum(
            mi * np.cross(xi - centre, vi - velocity) + 0.4 * mi * ri**2 * wi
            for mi, xi, vi, wi, ri in zip(m, x, v, w, radius[numbers], strict=True)
        )
        spread = sum(mi * (xi - centre) @ (xi - centre) for mi, xi in zip(m, x, strict=True))
        assert fragments.grains[k] == len(numbers)
        # sums of up to eighty terms in another order: rounding, relative to their largest terms
        np.testing.assert_allclose(fragments.mass[k], total, rtol=1e-12)
        np.testing.assert_allclose(fragments.centre[k], centre, rtol=0, atol=1e-12 * 1e-5 * 10)
        np.testing.assert_allclose(fragments.velocity[k], velocity, rtol=0, atol=1e-12 * 30)
        scale = total * 1e-5 * 3.0
        np.testing.assert_allclose(
            fragments.angular_momentum[k], momentum, rtol=0, atol=1e-11 * scale
        )
        rg = np.sqrt(spread / total)
        np.testing.assert_allclose(fragments.radius_of_gyration[k], rg, rtol=1e-9, atol=1e-18)


def test_equal_fragments_come_in_the_order_of_their_first_grain(tmp_path):
    frame = {"position": np.arange(18.0).reshape(6, 3) * 1e-6, "pairs": [[3, 4], [1, 5]]}
    with open_snapshots(tmp_path, [frame]) as run:
        assert analysis.find_fragments(run).label.tolist() == [2, 0, 3, 1, 1, 0]


def test_a_fragment_across_periodic_faces_is_one_piece(tmp_path):
    """A bent chain through three faces: the same as the unwrapped chain."""
    steps = np.array([[1.0, 0.0, 0.0]] * 4 + [[0.0, 1.0, 0.0]] * 4 + [[0.0, 0.0, -1.0]] * 4)
    chain = np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)]) * 2 * R
    low, edge = -1e-6, 12 * R
    wrapped = (chain - low) % edge + low
    pairs = [[k, k + 1] for k in range(12)]
    box = [low, low + edge] * 3
    rng = np.random.default_rng(2)
    order = rng.permutation(13)  # the order of the grains is not that of the chain
    back = np.argsort(order)
    frame = {
        "position": wrapped[order],
        "pairs": back[np.array(pairs)],
        "velocity": rng.normal(size=(13, 3)),
    }
    free = frame | {"position": chain[order]}
    with (
        open_snapshots(tmp_path / "a", [frame], box=box, periodic="x y z") as run,
        open_snapshots(tmp_path / "b", [free]) as straight,
    ):
        fragments, expected = analysis.find_fragments(run), analysis.find_fragments(straight)
        assert len(fragments) == 1
        # rounding of wrapped coordinates
        for name in ("radius_of_gyration", "angular_momentum"):
            values = getattr(expected, name)
            np.testing.assert_allclose(getattr(fragments, name), values, rtol=1e-9)
        shift = (fragments.centre - expected.centre) / edge
        np.testing.assert_allclose(shift, np.round(shift), atol=1e-9)


def test_filling_factor_of_a_ball_of_a_lattice(tmp_path):
    """Cubic lattice in a ball: pi/6 within R_g's sphere, up to the roughness of the surface."""
    grid = np.stack(np.meshgrid(*[np.arange(-9, 10)] * 3), axis=-1).reshape(-1, 3)
    grid = grid[np.linalg.norm(grid, axis=1) < 9.3] * 2 * R
    chain = np.stack([np.arange(len(grid) - 1), np.arange(1, len(grid))], axis=1)
    thin = {"position": 1.5 * grid, "pairs": chain}
    with open_snapshots(tmp_path, [thin, {"position": grid, "pairs": chain}]) as run:
        fragments = analysis.find_fragments(run)
        # the number of lattice points in a ball of radius 9.3 is within 2 % of its volume
        assert fragments.filling_factor[0] == pytest.approx(np.pi / 6, rel=0.03)
        assert fragments.characteristic_radius[0] == pytest.approx(9.3 * 2 * R, rel=0.02)
        change = analysis.measure_compaction(run)
        assert change.ratio == pytest.approx(1.5**3)  # exact: all distances by one factor
        assert change.radius_of_gyration[0] / change.radius_of_gyration[1] == pytest.approx(1.5)


def test_growth_efficiency_and_spectrum(tmp_path):
    def links(*ranges):
        return [[k, k + 1] for first, last in ranges for k in range(first, last - 1)]

    x = np.arange(60.0).reshape(20, 3) * 1e-6
    pieces = ((0, 14), (14, 20)), ((0, 17), (17, 20)), ((0, 11), (14, 20)), ((0, 20),)
    frames = [{"position": x, "pairs": links(*ranges)} for ranges in pieces]
    with open_snapshots(tmp_path, frames) as run:
        # target 14, projectile 6: it gains 3, loses 3, takes all
        assert analysis.measure_growth_efficiency(run, last=1) == pytest.approx(3 / 6)
        assert analysis.measure_growth_efficiency(run, last=2) == pytest.approx(-3 / 6)
        assert analysis.measure_growth_efficiency(run) == pytest.approx(1.0)
        with pytest.raises(DustError, match="has 1 fragments"):
            analysis.measure_growth_efficiency(run, first=3)
        spectrum = analysis.compute_mass_spectrum(analysis.find_fragments(run, 2), bins=4)
        mass = 4 / 3 * np.pi * R**3 * snapshots.DENSITY
        np.testing.assert_allclose(spectrum.mass / mass, [1, 1, 1, 6, 11])
        assert spectrum.count.tolist() == [5, 4, 3, 2, 1]
        np.testing.assert_allclose(spectrum.mass_fraction, np.array([20, 19, 18, 17, 11]) / 20)
        assert spectrum.histogram.tolist() == [3, 0, 1, 1] and len(spectrum.edges) == 5
        (axes,) = plots.mass_spectrum([spectrum], ["made"]).axes
        assert "fragments" in axes.get_ylabel() and axes.get_xscale() == "log"
        # the largest holds 11 of 20 grains, whatever was there before
        first_spectrum = analysis.compute_mass_spectrum(analysis.find_fragments(run, 0))
        both = plots.mass_spectrum([first_spectrum, spectrum]).axes[0].lines
        ends = [line.get_xdata()[-1] for line in both if len(line.get_xdata()) > 1]
        assert ends == pytest.approx([14 / 20, 11 / 20])
        with pytest.raises(DustError, match="no snapshot 9; allowed: 0 to 3"):
            analysis.find_fragments(run, 9)


# Arrival.


def wave(tmp_path, speed, push=1e-9, walls=None):
    """Grains on a line that a straight ramp passes at `speed`, 2 ns long; grain 0 is pushed."""
    dt, count = 0.5e-9, 40
    x = np.zeros((count, 3))
    x[:, 0] = np.arange(count) * 2 * R
    box = [NAN] * 6
    frames = []
    for n in range(400):
        moved = np.clip((n * dt - x[:, 0] / speed) / 2e-9, 0.0, 1.0) * push
        here = [-R + moved[0], NAN, NAN, NAN, NAN, NAN]
        frames.append({"position": x + moved[:, None] * [0.6, 0.8, 0.0], "box": here})
    return open_snapshots(tmp_path, frames, dt=dt, box=walls and box)


@pytest.mark.parametrize("speed", [pytest.param(300.0, marks=pytest.mark.long), 513.8])
@pytest.mark.parametrize("threshold", [{"fraction": 0.25}, {"threshold": 0.4e-9}])
def test_sound_speed_of_a_wave(tmp_path, speed, threshold):
    with wave(tmp_path, speed) as run:
        arrivals = analysis.measure_arrival(run, 0, **threshold)
        fraction = threshold.get("fraction", 0.4)
        assert arrivals.push == pytest.approx(1e-9) and arrivals.threshold == pytest.approx(
            fraction * 1e-9
        )
        # the ramp is straight from its start to the snapshot after the crossing, so that the
        # interpolation is exact: rounding of displacements, 1e-20 m of 1e-9 m, remains
        expected = arrivals.distance / speed + fraction * 2e-9
        assert not np.isnan(arrivals.time).any()
        np.testing.assert_allclose(arrivals.time, expected, rtol=0, atol=1e-9 * 2e-9)
        fit = analysis.fit_sound_speed(arrivals)
        assert fit.speed == pytest.approx(speed, rel=1e-8)
        assert fit.delay == pytest.approx(fraction * 2e-9, rel=1e-6) and fit.grains == 39
        np.testing.assert_allclose(
            arrivals.speed[1:], arrivals.distance[1:] / expected[1:], rtol=1e-6
        )
        assert np.isnan(arrivals.speed[0])
        run.attrs["sample"] = "{push: [{grains: [0], size: 1.0e-9}]}"
        (axes,) = plots.sound_speed(run).axes
        assert "m/s" in axes.get_ylabel() and len(axes.lines[0].get_xdata()) == 40


def test_a_push_of_grains_of_several_materials_needs_a_length(tmp_path):
    with wave(tmp_path, 400.0) as run:
        run.attrs["sample"] = "{push: [{grains: [0], kind: speed}]}"
        run.attrs["scene_resolved"] = "materials: {ice: {}, dust: {}}"
        with pytest.raises(DustError, match="not one material .*allowed: push"):
            analysis.measure_arrival(run)
        assert analysis.measure_arrival(run, push=1e-9).push == 1e-9


def test_a_run_without_a_file_has_no_snapshots():
    run = make_run(height=np.ones(3), attrs={"periodic_axes": "x"})
    for measure in (analysis.count_frames, analysis.read_frame, analysis.read_grain_masses):
        with pytest.raises(DustError, match="has no snapshots"):
            measure(run)
    with pytest.raises(DustError, match="has no snapshots"):
        run.period()


def test_error_of_the_sound_speed():
    """200 fits of noisy arrivals: the stated error is that of the scatter of the fits."""
    rng, distance = np.random.default_rng(6), np.linspace(1e-6, 3e-5, 60)
    pulls = []
    for _ in range(200):
        time = 2e-9 + distance / 30.0 + 2e-8 * rng.normal(size=60)
        fit = analysis.fit_sound_speed(analysis.Arrival(time, distance, 1e-10, 1e-9), beyond=2e-6)
        pulls.append((fit.speed - 30.0) / fit.sigma)
    # 1 and 0 are expected; the scatter of 200 numbers is known to 5 %, their mean to 0.07
    assert 0.8 < np.std(pulls) < 1.2 and abs(np.mean(pulls)) < 0.3


def test_a_wall_that_pushes(tmp_path):
    with wave(tmp_path, 400.0, walls=True) as run:
        arrivals = analysis.measure_arrival(run, "x_min", fraction=0.5)
        assert arrivals.push == pytest.approx(1e-9)
        np.testing.assert_allclose(arrivals.distance, (np.arange(40) * 2 + 1) * R)
        assert analysis.fit_sound_speed(arrivals).speed == pytest.approx(400.0, rel=0.01)
        with pytest.raises(DustError, match='no wall "top"; allowed: x_min'):
            analysis.measure_arrival(run, "top")
        with pytest.raises(DustError, match="no grain 40; allowed: 0 to 39"):
            analysis.measure_arrival(run, 40)
    with open_snapshots(tmp_path / "still", [{"position": np.eye(3) * 1e-5}] * 3) as run:
        with pytest.raises(DustError, match="is not displaced"):
            analysis.measure_arrival(run, 0)
        arrivals = analysis.measure_arrival(run, 0, threshold=1e-10)
        assert np.isnan(arrivals.time).all()
        with pytest.raises(DustError, match="reached 0 grains"):
            analysis.fit_sound_speed(arrivals)


# Restitution.


def collision(tmp_path, final_velocities, pairs_after, offset=0.0):
    """Two dimers that meet along x at 3 + 1 m/s, and part with `final_velocities`."""
    half = np.array([[0.0, -R, 0.0], [0.0, R, 0.0]])
    v = np.repeat([[3.0, 0.5, 0.0], [-1.0, 0.5, 0.0]], 2, axis=0)
    frames = []
    for n in range(-10, 11):
        gap = 2 * R + 4.0 * 1e-7 * abs(n)
        x = np.concatenate([half + [-gap / 2, 0, 0], half + [gap / 2, offset, 0]])
        frames.append(
            {
                "position": x,
                "velocity": v if n <= 0 else np.repeat(final_velocities, 2, axis=0),
                "pairs": pairs_after if n > 0 else [[0, 1], [2, 3]],
            }
        )
    return open_snapshots(tmp_path, frames)


@pytest.mark.parametrize(
    "final_velocities, offset, approach_speed, back",
    [
        ([[0.0, 0.5, 0.0], [2.0, 0.5, 0.0]], 0.0, 4.0, 2.0),
        # beside each other by 2r, so the normal is at 45 degrees; a sliding motion does not count
        ([[1.0, -1.5, 0.3], [1.0, 2.5, 0.0]], 2 * R, 8**0.5, 8**0.5),
    ],
)
def test_restitution_of_two_aggregates(tmp_path, final_velocities, offset, approach_speed, back):
    with collision(tmp_path, final_velocities, [[0, 1], [2, 3]], offset) as run:
        result = analysis.measure_restitution(run)
        assert not result.sticks
        # floats as they were put in
        speeds = result.approach_speed, result.separation_speed
        assert speeds == (pytest.approx(approach_speed), pytest.approx(back))
        assert result.coefficient == pytest.approx(back / approach_speed)
        if not offset:
            np.testing.assert_allclose(np.abs(result.normal), [1.0, 0.0, 0.0], atol=1e-12)
        with pytest.raises(DustError, match="do not approach"):
            analysis.measure_restitution(run, first=15)


def test_bodies_that_have_not_touched_have_no_restitution(tmp_path):
    start = [[3.0, 0.5, 0.0], [-1.0, 0.5, 0.0]]
    with collision(tmp_path, start, [[0, 1], [2, 3]], 4 * R) as run:
        with pytest.raises(DustError, match="have not touched"):
            analysis.measure_restitution(run)


def test_sticking(tmp_path):
    final_velocities = [[1.0, 0.5, 0.0]] * 2
    with collision(tmp_path, final_velocities, [[0, 1], [1, 2], [2, 3]]) as run:
        assert (
            analysis.measure_restitution(run).sticks
            and analysis.measure_restitution(run).coefficient == 0.0
        )
        assert analysis.measure_restitution(run, bodies=([0, 1], [2, 3])).sticks


@pytest.mark.parametrize("wall, axis, sign", [("bottom", 2, 1.0), ("x_max", 0, -1.0)])
def test_restitution_on_a_moving_wall(tmp_path, wall, axis, sign):
    """The wall moves at 0.2 m/s towards the grain, which comes at 1 and leaves at 0.8 m/s."""
    dt, frames = 1e-9, []
    side = {"bottom": 4, "x_max": 1}[wall]
    for n in range(20):
        box = np.full(6, NAN)
        box[side] = sign * 0.2 * n * dt
        v = np.full((1, 3), 0.1)
        v[0, axis] = sign * (-1.0 if n < 10 else 0.8)
        frames.append({"position": np.ones((1, 3)) * 1e-6, "velocity": v, "box": box})
    frames.append(frames[-1] | {"touching": [(0, side)]})
    with open_snapshots(tmp_path, frames, box=np.full(6, NAN), dt=dt) as run:
        result = analysis.measure_wall_restitution(run, wall, last=18)
        speeds = result.approach_speed, result.separation_speed
        assert speeds == (pytest.approx(1.2), pytest.approx(0.6))
        assert result.coefficient == pytest.approx(0.5) and not result.sticks
        assert analysis.measure_wall_restitution(run, wall).sticks
        with pytest.raises(DustError, match=f"have not touched the wall {wall}"):
            analysis.measure_wall_restitution(run, wall, last=5)
        with pytest.raises(DustError, match='no wall "top"'):
            analysis.measure_wall_restitution(run, "top")


def test_restitution_figure_has_the_closed_form():
    speeds = np.array([0.05, 0.2, 1.0])
    figure = plots.restitution(speeds, [0.0, 0.83, 0.99], sticking_speed=0.11)
    closed, points = figure.axes[0].lines
    v, e = closed.get_data()
    np.testing.assert_allclose(e[v >= 0.11], np.sqrt(1 - (0.11 / v[v >= 0.11]) ** 2), atol=1e-12)
    np.testing.assert_allclose(points.get_xdata(), speeds)


def frame(position, radius, edges, periodic=True):
    still, cell = np.zeros_like(position), np.column_stack([np.zeros(3), edges])
    sides = np.array([periodic] * 3)
    return Frame(0, 0.0, 0, position, still, still, radius, cell, sides, None)


def cubic(n):
    """Touching spheres of radius 1."""
    return 2.0 * np.stack(np.meshgrid(*[np.arange(n)] * 3), axis=-1).reshape(-1, 3) + 1.0


def test_the_pores_of_a_simple_cubic_lattice():
    """The largest sphere sits in the middle of eight grains, of radius sqrt(3) - 1; the points that
    it holds have that pore, and few more one that is nearly as large."""
    pores = measure_frame_pores(frame(cubic(3), np.ones(27), np.full(3, 6.0)), 3000)
    void = 1.0 - np.pi / 6.0
    assert pores.void == pytest.approx(void, abs=3.0 * pores.void_error)
    assert pores.void_error == pytest.approx(np.sqrt(void * (1.0 - void) / 3000), rel=0.05)
    # the last steps are 0.02 long
    assert pores.largest == pytest.approx(3**0.5 - 1.0, abs=0.01)
    fraction = np.interp(0.97 * pores.largest, pores.radius, pores.share)
    sphere = 4 / 3 * np.pi * (3**0.5 - 1.0) ** 3 / (8.0 * void)
    assert sphere - 0.04 < fraction < sphere + 0.12
    assert pores.share[0] == 1.0 and np.all(np.diff(pores.share) <= 0.0)


def test_walls_and_unequal_grains():
    """One grain in the corner of a box: the largest sphere touches the three far walls and the
    grain, or all walls."""
    edge, a = 8.0, 3.0
    one = frame(np.full((1, 3), a), np.array([a]), np.full(3, edge), periodic=False)
    pores = measure_frame_pores(one, 400)
    # sqrt(3) (edge - R - a) = R + a
    expected = (3**0.5 * (edge - a) - a) / (1 + 3**0.5)
    assert pores.largest == pytest.approx(expected, rel=0.02)
    rng = np.random.default_rng(3)
    x, r = 10.0 * rng.random((60, 3)), rng.uniform(0.1, 1.5, 60)
    mixed = frame(x, r, np.full(3, 10.0))
    points = 10.0 * rng.random((300, 3))
    apart = points[:, None] - x
    apart -= 10.0 * np.round(apart / 10.0)
    direct = (np.linalg.norm(apart, axis=2) - r).min(axis=1)
    np.testing.assert_allclose(Surfaces(mixed).distances(points), direct)


def test_an_open_body_has_no_room():
    one = frame(np.zeros((1, 3)), np.ones(1), np.full(3, np.nan), periodic=False)
    with pytest.raises(DustError, match="Pores need walls"):
        measure_frame_pores(one)


def test_dimension_of_a_plate_across_a_face(tmp_path):
    """A square plate of touching grains that a periodic face cuts: D = 2."""
    n, d = 24, 1.2e-6
    x = np.stack(np.meshgrid(np.arange(n), np.arange(n)), axis=-1).reshape(-1, 2) * d
    number = np.arange(n * n).reshape(n, n)
    pairs = np.concatenate(
        [
            np.column_stack([number[:, :-1].ravel(), number[:, 1:].ravel()]),
            np.column_stack([number[:-1].ravel(), number[1:].ravel()]),
        ]
    )
    edge = 40 * d
    position = np.column_stack([np.mod(x[:, 0] + 30 * d, edge), x[:, 1], np.zeros(len(x))])
    box = np.array([0.0, edge, np.nan, np.nan, np.nan, np.nan])
    frames = [{"position": position, "pairs": pairs}]
    snapshots.write(tmp_path / "result.nc", frames, 0.6e-6, box=box, periodic="x")
    with analysis.open_run(tmp_path) as run:
        fragment_dimension = analysis.fit_fragment_dimension(run)
        assert (
            fragment_dimension.dimension == pytest.approx(2.0, abs=0.1)
            and fragment_dimension.grains == n * n
        )
        plots.fragment_dimension(run)
        with pytest.raises(DustError, match="There is no fragment 1; allowed: 0 to 0"):
            analysis.fit_fragment_dimension(run, fragment=1)


# -- pair correlation ----------------------------------------------------------------------------


def points(position, edge, periodic=True):
    return frame(position, np.full(len(position), 0.5), np.full(3, edge), periodic)


def test_points_that_know_nothing_of_each_other():
    """g = 1 within four standard deviations of the number of pairs in a bin."""
    rng = np.random.default_rng(5)
    for periodic in (True, False):
        r, g, _ = compute_pair_correlation(points(16.0 * rng.random((4000, 3)), 16.0, periodic))
        far = r > 1.0
        centres = 4000 if periodic else 4000 * (6 / 16) ** 3
        pairs = centres * 4 * np.pi * r**2 * (FARTHEST / BINS) * 4000 / 16.0**3
        assert np.all(np.abs(g - 1.0)[far] < 4.0 * np.sqrt(2.0 / pairs[far]) + 0.02)
    assert np.isnan(compute_pair_correlation(points(np.random.rand(50, 3) * 5, 5.0))[1]).all()


def test_a_lattice_has_its_shells():
    """Simple cubic: 6, 12 and 8 neighbours at 1.01 times 1, sqrt 2 and sqrt 3."""
    x = 1.01 * np.array(np.meshgrid(*[np.arange(11.0)] * 3)).reshape(3, -1).T + 0.2
    r, g, error = compute_pair_correlation(points(x, 11.11))
    width = FARTHEST / BINS
    shells = g * 4 / 3 * np.pi * ((r + width / 2) ** 3 - (r - width / 2) ** 3)
    assert g.min() == 0.0 and not g[r < 1.0].any()  # a grain is no neighbour of itself
    first_shells = shells[shells > 1e-9][:3]
    np.testing.assert_allclose(first_shells / 1.01**3, [6, 12, 8], rtol=1e-9)
    assert not error.any()


def test_a_few_random_centres_serve_for_many_grains(monkeypatch):
    """About a quarter of the grains, g(r) is within four of its standard errors of that about all,
    and one standard error contains it in two bins of three."""
    snapshot = points(16.0 * np.random.default_rng(6).random((4000, 3)), 16.0)
    r, exact, _ = compute_pair_correlation(snapshot)
    monkeypatch.setattr(import_module("dusttaichi.analysis.structure"), "CENTRES", 1000)
    _, g, error = compute_pair_correlation(snapshot)
    far = r > 1.0
    deviations = np.abs(g - exact)[far] / error[far]
    assert deviations.max() < 4.0 and 0.6 < np.mean(deviations < 1.0) < 0.95
