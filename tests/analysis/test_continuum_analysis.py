"""Measurements of the continuum against what was put into a result file."""

import numpy as np
import pytest
import xarray as xr
import yaml

from dusttaichi.analysis import open_run, summarise, tabulate
from dusttaichi.analysis.ledger import Ledger, compute_ledger
from dusttaichi.continuum import analysis as of
from dusttaichi.continuum.analysis import laboratory
from dusttaichi.continuum.analysis.continuum_numbers import numerical_dissipation
from dusttaichi.continuum.analysis.dust_fragments import pieces_of
from dusttaichi.continuum.analysis.filling import denser_than
from dusttaichi.errors import DustError
from dusttaichi.export import export
from dusttaichi.plots import animation, save_figures

A, G, SOLID = 1e-4, 9.81, 2000.0
T, D = 3.1e-3, 1.2e-3
BEAD = {
    "name": "bead",
    "shape": "sphere",
    "density": 2540.0,
    "diameter": 1.1e-3,
    "mass": 2540 * np.pi * 0.55e-3**2,
}
IMPACT = {"kind": "impact", "surface": 0.0, "gap": 0.0, "projectile": BEAD}


def write(path, *, series, snapshots, static, sample, **attributes):
    """A result.nc with these series (time, ...), snapshots (a list of dicts), and static arrays.

    By default records are a millisecond apart, and the ledger closes.
    """
    length = len(next(iter(series.values())))
    zero = np.zeros(length)
    series = {"time": 1e-3 * np.arange(length), "step": np.arange(length), "wall_clock": zero,
              "energy_residual": zero, "energy_residual_relative": zero} | series  # fmt: skip
    static = {"role": 0.0 * static["mass"], "body": 0.0 * static["mass"]} | static
    options = {"spacing": 1e-4, "solid_density": 2000.0, "dimension": 2, "gravity": 9.81}
    options |= {"sample": yaml.safe_dump(sample), "particles": len(static["mass"])}
    options |= {"scene_resolved": "method: continuum"} | attributes
    of_time = {}
    for name, values in series.items():
        dims = ("time", "rigid", "xyz") if name.startswith("body") else ("time", "xyz")
        of_time[name] = (dims[: np.ndim(values)], values)
    of_frames = {name: ("particle", values) for name, values in static.items()}
    for name in {"snapshot_time": 0, "step": 0} | snapshots[0]:
        rows = np.array([frame.get(name, n) for n, frame in enumerate(snapshots)])
        last = {"deviator": "component"}.get(name, "xyz")
        of_frames[name] = (("snapshot", "particle", last)[: rows.ndim], rows)
    labels = {"xyz": list("xyz"), "rigid": ["bead"]}
    groups = {"/": xr.Dataset(of_time, labels, options), "/snapshots": xr.Dataset(of_frames)}
    xr.DataTree.from_dict(groups).to_netcdf(path)
    return path


def frame(position, velocity=None, density=300.0):
    """A snapshot of particles (N, 3) without stress."""
    n = len(position)
    return {
        "position": position,
        "velocity": np.zeros((n, 3)) if velocity is None else velocity,
        "density": np.zeros(n) + density,
        "pressure": np.zeros(n),
        "deviator": np.zeros((n, 6)),
    }


def bed(width=24, depth=20):
    """A triangular bed whose surface is at z = 0, middles of the rows half a row below."""
    i, j = np.meshgrid(np.arange(width), np.arange(depth), indexing="ij")
    x = (i + 0.5 * (j % 2) - width / 2 + 0.25) * A
    z = -(j + 0.5) * A * 3**0.5 / 2
    return np.stack([x.ravel(), 0 * x.ravel(), z.ravel()], axis=1)


ONE = 300.0 * A**2 * 3**0.5 / 2  # mass of a particle of dust [kg/m]


def of_dust(folder, *snapshots, mass, momentum=None, kind="sphere", scene="", **static):
    """The run of a body of dust at its start and at its end."""
    path = write(
        folder / "result.nc",
        series={"momentum": np.zeros((2, 3)) if momentum is None else momentum},
        snapshots=snapshots,
        static={"mass": mass} | static,
        sample={"kind": kind},
        scene_resolved=f"method: continuum\n{scene}",
    )
    return open_run(path)


@pytest.fixture(scope="module")
def fallen(tmp_path_factory):
    """A bead on a sine with g t^2 / 2 on top; below it phi = 0.25 in 0.3 mm, 0.15 else."""
    time = np.linspace(0, 4.5e-3, 901)
    sine = np.minimum(time, T)
    height = -D * np.sin(np.pi * sine / 2 / T) - 0.5 * G * time**2
    velocity = -D * np.pi / 2 / T * np.cos(np.pi * sine / 2 / T) * (time < T) - G * time
    velocity[time > T] = 0.01
    positions, speed = np.zeros((901, 1, 3)), np.zeros((901, 1, 3))
    positions[:, 0, 2], speed[:, 0, 2] = height + 0.65e-3, velocity
    dust, bead = bed(), np.array([[0.0, 0.0, -0.5e-3]])
    x = np.concatenate([dust, bead])
    low = -0.5e-3 - 0.55e-3
    phi = np.where((dust[:, 2] < low) & (dust[:, 2] > low - 0.3e-3), 0.25, 0.15)
    density = np.append(SOLID * phi, 2540.0)
    mass = np.append(np.full(len(dust), ONE), BEAD["mass"])
    role = np.append(np.zeros(len(dust)), 1)
    path = write(
        tmp_path_factory.mktemp("fallen") / "result.nc",
        series={"time": time, "body_position": positions, "body_velocity": speed},
        snapshots=[frame(x, density=np.append(np.full(len(dust), 300.0), 2540.0)),
                   frame(x, density=density)],
        static={"mass": mass, "role": role, "body": role},
        sample=IMPACT,
        scene_resolved="method: continuum\nnumerics: {viscosity: {contact: 0.1}}",
    )  # fmt: skip
    with open_run(path) as run:
        yield run


def test_intrusion_finds_the_sine_again_where_the_surfaces_meet(fallen):
    way = of.intrusion(fallen)
    assert way.speed == pytest.approx(D * np.pi / 2 / T, rel=1e-6)
    stop = way.without_gravity
    assert stop.time == pytest.approx(T, rel=2e-3) and stop.depth == pytest.approx(D, rel=1e-4)
    assert stop.rms < 1e-3 * D
    assert stop.normalised[:, 0] == pytest.approx([0, 0]) and stop.normalised[0, -1] == 1.0
    assert way.stop.depth == pytest.approx(D + 0.5 * G * T**2, rel=1e-2)
    assert way.rebound == pytest.approx(0.01)
    # with a gap to fall the depth is that below the surface, the time that from there on
    with open_run(fallen.path) as run:
        run.attrs["sample"] = yaml.safe_dump(IMPACT | {"gap": 0.1e-3})
        later, fallen_stop = of.intrusion(run).stop, of.intrusion(fallen).stop
    assert later.depth == pytest.approx(fallen_stop.depth - 0.1e-3, rel=5e-3)
    assert later.time < fallen_stop.time - 0.1e-3 / (D * np.pi / 2 / T) + 1e-5


def test_the_share_of_numerical_dissipation_is_told(fallen):
    with open_run(fallen.path) as run:
        assert summarise(run)["numerical_dissipation"] is None  # nothing is lost
        channels = ["compaction", "tension", "shear", "viscosity", "artificial", "grid"]
        lost = np.linspace(0.0, 1.0, len(run.series.time))[:, None] * [50, 3, 20, 6, 1, 20]
        run.series["loss"] = xr.DataArray(lost, {"channel": channels}, ("time", "channel"))
        run.series["substeps"] = ("time", 8 * np.arange(len(run.series.time)))
        numbers = summarise(run)
    assert numbers["numerical_dissipation"] == pytest.approx(0.27)
    assert numbers["time_steps"] == 8 * (len(lost) - 1)
    rows = dict(row[:2] for row in tabulate(numbers))
    assert rows["numerical dissipation"] == "27.0 % of the energy lost"
    # a turning elastic block gains by rounding in one channel what it loses in another
    with open_run(fallen.path) as run:
        lost = np.linspace(0.0, 1.0, len(run.series.time))[:, None] * [-3, 4, 1]
        names = ["shear", "grid", "tension"]
        run.series["loss"] = xr.DataArray(lost, {"channel": names}, ("time", "channel"))
        assert compute_ledger(run).shares == pytest.approx(
            {"shear": -0.375, "grid": 0.5, "tension": 0.125}
        )
        assert summarise(run)["numerical_dissipation"] == pytest.approx(0.5)


def ledger_of(energy, **losses):
    """A Ledger of one moment, with the energy that has gone through the system."""
    ends = {channel: np.array([loss]) for channel, loss in losses.items()}
    size = sum(map(abs, losses.values()))
    fractions = {channel: loss / size for channel, loss in losses.items()}
    none = np.zeros(1)
    return Ledger(none, ends, none, none, none, np.array([energy]), none, 0.0, fractions)


def test_no_share_of_numerical_dissipation_where_nothing_is_lost():
    """An elastic block that turns: 3.6 uJ gained and 2.5 uJ lost of 6.65 mJ."""
    turning = {"shear": -3.58e-6, "grid": 2.33e-6, "artificial": 0.19e-6}
    numbers = numerical_dissipation(ledger_of(6.65e-3, **turning))
    text = "0.038 % of the energy; all losses, -0.016 % of it, are too small for a share"
    assert numbers == {"numerical_dissipation_problem": text}
    assert numerical_dissipation(ledger_of(1e-4, shear=1e-6, grid=1e-6)) == {
        "numerical_dissipation": 0.5
    }
    # gains that make up for losses
    numbers = numerical_dissipation(ledger_of(1.0, shear=-0.40, grid=0.45))
    assert "45 % of the energy; all losses, 5 % of it," in numbers["numerical_dissipation_problem"]


def test_the_laws_of_the_laboratory():
    """CONTINUUM section 5: 3.20 ms and 1.25 mm for 1.1 mm at 0.65 m/s;"""
    sphere = laboratory.sphere_mass(1.1e-3, 2540.0)
    assert laboratory.depth(sphere, 0.65) == pytest.approx(1.25e-3, rel=5e-3)
    assert laboratory.stopping_time(sphere, 0.65) == pytest.approx(3.20e-3, rel=1e-2)
    drops = laboratory.drops()
    ratio = drops["depth"] / drops["momentum"] * 1e3
    assert len(ratio) == 15 and 0.76 < ratio.min() and ratio.max() < 1.4
    # G09 eq 16: the disc of the same density and diameter has the sphere's value
    sphere = laboratory.sphere_mass(1.1e-3, 2540.0)
    assert of.momentum_per_area(BEAD["mass"], 0.65, 1.1e-3, 2) == pytest.approx(
        of.momentum_per_area(sphere, 0.65, 1.1e-3, 3), rel=1e-12
    )


def test_the_profile_below_the_bead_and_cumulated_volume(fallen):
    profile = of.axis_profile(fallen)
    assert profile.bead == pytest.approx(1.05e-3)
    inside = profile.below_bead < 0.25e-3
    assert profile.filling_factor[inside] == pytest.approx(0.25)
    beyond = (profile.below_bead > 0.45e-3) & np.isfinite(profile.filling_factor)
    assert beyond.any() and profile.filling_factor[beyond] == pytest.approx(0.15)
    assert profile.nearest == pytest.approx(0.25)
    volume = of.cumulated_volume(fallen)
    last = of.read_particles(fallen)
    dense = last.filling_factor > 0.2
    expected = last.volume[dense].sum() / (np.pi * 0.55e-3**2)
    assert volume.above(0.2) == pytest.approx(expected, rel=1e-6)
    assert volume.above(0.3) == 0.0
    grid, fraction = denser_than(np.full(1000, 0.15), np.full(1000, 1e-3), scatter=0.01)
    assert np.interp(0.15, grid, fraction) == pytest.approx(0.5, abs=1e-3)
    assert np.interp(0.16, grid, fraction) == pytest.approx(0.1587, abs=1e-3)


def test_a_map_shows_dust_where_it_is(fallen):
    last = of.read_particles(fallen)
    section = of.section(last, last.filling_factor, (-1e-3, 1e-3, -2e-3, 1e-3), 150)
    rows = section.values.shape[0]
    assert np.isnan(section.values[-1]).all() and np.isfinite(section.values[rows // 10]).all()
    band = section.values[int(rows * (2e-3 - 1.2e-3) / 3e-3)]
    assert np.nanmedian(band) == pytest.approx(0.25)


def test_the_final_table_has_the_numbers(fallen):
    numbers = summarise(fallen)
    assert numbers["depth_weightless"] == pytest.approx(D, rel=1e-3)
    assert numbers["depth_law"] == pytest.approx(laboratory.depth(
        laboratory.sphere_mass(1.1e-3, 2540.0), numbers["impact_speed"]), rel=1e-9)  # fmt: skip
    rows = {title: (value, literature) for title, value, literature in tabulate(numbers)}
    assert rows["filling factor within 0.3 mm below"][0] == "0.250"
    assert rows["particles"][0] == "481" and "eq 12" in rows["… with g t^2/2 taken away"][1]


@pytest.mark.filterwarnings("error")
def test_a_body_that_spins_in_place_has_no_restitution(tmp_path):
    """Its particles move, its momentum is 0 up to rounding: nothing comes back of nothing."""
    x = bed(6, 6)
    mass = np.full(len(x), ONE)
    about = x - x.mean(axis=0)
    spin = np.cross([0.0, 10.0, 0.0], about)
    spin -= np.average(spin, axis=0, weights=mass) - [0.0, 0.0, 1e-17]
    with of_dust(tmp_path, frame(x, spin), frame(x, spin), mass=mass) as run:
        numbers = summarise(run)
    assert numbers["dust_restitution"] is None and numbers["largest_rebound"] is None


def test_pieces_fly_apart_and_stick(tmp_path):
    """Two discs of dust, one above a mirror that it touches, and one that flies back."""
    disc = bed(6, 6)
    low = disc - [0, 0, disc[:, 2].min() - 0.5 * A]
    up = disc + [0, 0, 3e-3]
    x = np.concatenate([low, up])
    n = len(disc)
    mass = np.full(2 * n, ONE)
    mass[n:] *= 2
    velocity = np.zeros((2 * n, 3))
    start, end = velocity.copy(), velocity.copy()
    start[:, 2], end[n:, 2] = -0.2, 0.05
    momentum = np.zeros((2, 3))
    momentum[:, 2] = mass.sum() * np.array([-0.2, 0.03])
    density = np.append(np.full(n, 300.0), np.full(n, 600.0))
    frames = [frame(x, moving, density) for moving in (start, end)]
    with of_dust(tmp_path, *frames, mass=mass, momentum=momentum) as run:
        back = of.bounce(run)
        pieces = pieces_of(of.read_particles(run), [(2, 0.0)])
        numbers = summarise(run)
    assert len(back.parts.mass) == 2 and back.coefficient == pytest.approx(0.25)
    assert back.rebound == pytest.approx(0.15) and back.axis == "z"
    assert pieces.largest_share == pytest.approx(2 / 3)
    assert pieces.sticks.tolist() == [False, True]
    assert pieces.sticking_share == pytest.approx(1 / 3)
    assert numbers["pieces"] == 2 and numbers["dust_restitution"] == pytest.approx(0.25)


@pytest.mark.parametrize(
    ("after", "coefficient", "problem"),
    [
        ({"gap": 1e-3, "velocity": 0.05}, 0.25, None),
        ({"gap": 1e-3, "velocity": -0.05}, None, "still approach"),
        ({"gap": A}, None, "stick together"),
        ({"gap": A, "loose": True}, None, "stick together"),  # a fragment is no body
        ({"gap": 1e-3, "broken": True}, None, "broken up"),
    ],
    ids=["bounce", "not met", "stick", "stick but for a fragment", "broken up"],
)
def test_two_bodies_that_merge_or_break_up_have_no_restitution(
    after, coefficient, problem, tmp_path
):
    """Two discs of dust, the upper one flies at the lower one."""
    disc = bed(6, 6)
    n, high = len(disc), np.ptp(disc[:, 2])
    positions = np.concatenate([disc, disc + [0, 0, high + 2e-3]])
    x = np.concatenate([disc, disc + [0, 0, high + after["gap"]]])
    start, end = np.zeros((2 * n, 3)), np.zeros((2 * n, 3))
    start[n:, 2], end[n:, 2] = -0.2, after.get("velocity", 0.0)
    if "loose" in after:
        x[-1] += [0, 0, 1e-2]
        end[-1, 2] = 0.1
    if "broken" in after:
        x[:n] += 1e-2 * np.arange(n)[:, None]
    options = {"mass": np.full(2 * n, ONE), "body": np.repeat([0, 1], n), "kind": "several"}
    with of_dust(tmp_path, frame(positions, start), frame(x, end), **options) as run:
        numbers = summarise(run)
        shown = {title: value for title, value, _ in tabulate(numbers)}
    restitution = numbers["dust_restitution"]
    assert restitution is None if coefficient is None else restitution == pytest.approx(coefficient)
    assert (problem or "0.2500") in shown["coefficient of restitution"]


@pytest.mark.parametrize(
    ("offset", "problem"),
    [(-1e-2, "have not met yet; let the run continue"), (1e-2, "passed each other without")],
)
def test_two_bodies_that_do_not_touch_have_no_restitution(offset, problem, tmp_path):
    """Their relative velocity at the end is that of the start."""
    disc = bed(6, 6)
    n = len(disc)
    x = np.concatenate([disc, disc + [offset, 0, 3e-3]])
    velocity = np.zeros((2 * n, 3))
    velocity[n:, 0] = 0.2
    options = {"mass": np.full(2 * n, ONE), "body": np.repeat([0, 1], n), "kind": "several"}
    moved = frame(x + 5e-4 * velocity / 0.2, velocity)
    with of_dust(tmp_path, frame(x, velocity), moved, **options) as run:
        numbers = summarise(run)
    assert numbers["dust_restitution"] is None and problem in numbers["restitution_problem"]


@pytest.mark.parametrize(
    ("after", "velocity", "problem"),
    [
        (-0.2, -0.2, "the body has met nothing"),
        (-0.2 - 9.81e-3, -0.2 - 9.81e-3, "the body has met nothing"),  # it falls
        (-0.1, -0.1, "still moves on"),
        (0.1, 0.1, None),
    ],
)
def test_a_body_that_meets_nothing_has_no_restitution(after, velocity, problem, tmp_path):
    x = bed(6, 6)
    mass = np.full(len(x), ONE)
    start, end, momentum = np.zeros_like(x), np.zeros_like(x), np.zeros((2, 3))
    start[:, 2], end[:, 2] = -0.2, velocity
    momentum[:, 2] = mass.sum() * np.array([-0.2, after])
    fall = "gravity: {acceleration: [0 m/s^2, 0 m/s^2, -9.81 m/s^2]}" if after < -0.2 else ""
    frames = (frame(x, start), frame(x, end) | {"snapshot_time": 1e-3})
    with of_dust(tmp_path, *frames, mass=mass, momentum=momentum, scene=fall) as run:
        numbers = summarise(run)
    if problem is None:
        assert numbers["dust_restitution"] == pytest.approx(0.5)
        return
    assert problem in numbers["restitution_problem"]
    names = ("dust_restitution", "largest_rebound", "sticking_mass")
    assert all(numbers[name] is None for name in names)


def test_a_bead_that_falls_beside_dust_has_no_depth(tmp_path):
    time = np.linspace(0, 4.5e-3, 91)
    positions, speed = np.zeros((91, 1, 3)), np.zeros((91, 1, 3))
    speed[:, 0, 2] = -0.65 - G * time
    positions[:, 0, 2] = -0.65 * time - 0.5 * G * time**2
    x = np.concatenate([bed(), np.array([[0.0, 0.0, 3e-3]])])
    role = np.append(np.zeros(len(x) - 1), 1)
    path = write(
        tmp_path / "result.nc",
        series={"time": time, "body_position": positions, "body_velocity": speed},
        snapshots=[frame(x), frame(x)],
        static={"mass": np.append(np.full(len(x) - 1, ONE), BEAD["mass"]), "role": role},
        sample=IMPACT,
    )
    with open_run(path) as run:
        numbers = summarise(run)
        with pytest.raises(DustError, match="has not met the dust"):
            of.intrusion(run)
    assert numbers["stop_problem"].startswith("none: the body has not met the dust")
    names = ("impact_speed", "depth", "rebound", "momentum_per_area", "depth_law",
             "compacted_volume", "bead_filling_factor")  # fmt: skip
    assert all(numbers[name] is None for name in names)


def test_figures_film_and_table_of_runs(fallen, tmp_path):
    names = {path.stem for path in save_figures(fallen, tmp_path)}
    assert names == {"dust", "filling_factors", "impact", "bead_profile", "deceleration",
                     "compacted_volume"}  # fmt: skip
    assert animation(fallen, tmp_path / "dust.gif", dpi=40).stat().st_size > 1000
    names = {path.stem for path in save_figures([fallen, fallen], tmp_path)}
    assert names == {"bead_profile", "compacted_volume", "deceleration", "drops", "resolution"}


def test_export_to_vtk(fallen, tmp_path):
    import meshio

    paths = export(fallen, "vtk", tmp_path, snapshot=-1)
    mesh = meshio.read(paths[1])
    assert mesh.point_data["deviator"].shape == (481, 9)
    assert np.nanmax(mesh.point_data["filling_factor"]) == pytest.approx(0.25)
    with pytest.raises(DustError, match="allowed: vtk"):
        export(fallen, "lammps", tmp_path)


def test_straight_line_to_spacing_zero():
    value, slope = of.at_zero_spacing(np.array([1e-4, 2e-4, 4e-4]), np.array([1.1, 1.2, 1.4]))
    assert value == pytest.approx(1.0) and slope == pytest.approx(1e3)
