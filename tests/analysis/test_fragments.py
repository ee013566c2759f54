"""Fragments of snapshots and their dimension, against a brute-force search and known bodies."""

import numpy as np
import pytest
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from snapshots import DENSITY, open_snapshots
from synthetic import make_run

from dusttaichi import analysis, plots
from dusttaichi.errors import DustError

R = 0.6e-6
NAN = float("nan")


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
    mass = 4 / 3 * np.pi * radius**3 * DENSITY
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
        mass = 4 / 3 * np.pi * R**3 * DENSITY
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
    with open_snapshots(tmp_path, frames, box=box, periodic="x") as run:
        fragment_dimension = analysis.fit_fragment_dimension(run)
        assert (
            fragment_dimension.dimension == pytest.approx(2.0, abs=0.1)
            and fragment_dimension.grains == n * n
        )
        plots.fragment_dimension(run)
        with pytest.raises(DustError, match="There is no fragment 1; allowed: 0 to 0"):
            analysis.fit_fragment_dimension(run, fragment=1)


def test_a_run_without_a_file_has_no_snapshots():
    run = make_run(height=np.ones(3), attrs={"periodic_axes": "x"})
    for measure in (analysis.count_frames, analysis.read_frame, analysis.read_grain_masses):
        with pytest.raises(DustError, match="has no snapshots"):
            measure(run)
    with pytest.raises(DustError, match="has no snapshots"):
        run.period()
