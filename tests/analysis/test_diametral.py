"""Brazilian test of grains: closed forms of a lattice, the strength of a known bond; spin-up."""

import numpy as np
import pytest
import reference as ref
import synthetic
import xarray as xr
from program import invoke
from scenes import RADIUS, extensions_forgotten, import_bundled, make_scene

from dusttaichi import analysis, plots
from dusttaichi.errors import DustError
from dusttaichi.running import execute
from dusttaichi.scene import Scene

PAIR = ref.numbers()
D = 2 * RADIUS - PAIR.delta0
ROW = D * np.sqrt(3.0) / 2.0


@pytest.fixture(scope="module", autouse=True)
def extension():
    with import_bundled("diametral/diametral.py") as module:
        yield module


def disc_scene(positions, diameter, *, speed, strain, damping="viscoelastic"):
    """Grains in the plane y = 0 between two plates, without friction; lengths in m."""
    listed = [[f"{v:.17g} m" for v in row] for row in positions]
    sample = {
        "kind": "cutout",
        "of": {"kind": "explicit", "positions": listed},
        "diameter": f"{diameter:.17g} m",
        "length": f"{2 * RADIUS:.17g} m",
    }
    return make_scene(
        sample=sample,
        effects=(),
        damping=damping,
        dt="0.2 ns",
        boundary={"kind": "plates", "wall_speed": f"{speed:.17g} m/s"},
        stop={"strain": strain},
        output={"series": {"strain": strain / 200}, "snapshots": "off"},
    )


@pytest.fixture(scope="module")
def rhombus(tmp_path_factory):
    """Two grains that touch, and one above and below both of them."""
    x = [[-D / 2, 0, 0], [D / 2, 0, 0], [0, 0, ROW], [0, 0, -ROW]]
    folder = tmp_path_factory.mktemp("rhombus") / "run"
    execute(disc_scene(x, 2.001 * ROW, speed=1e-3, strain=4e-4), folder)
    with analysis.open_run(folder) as run:
        yield run


@pytest.mark.long
def test_four_grains_break_where_mechanics_says(extension, rhombus):
    """The forces N of the slanted contacts carry F = 2 N cos 30° and pull the middle contact apart
    with 2 N sin 30° = F/sqrt(3), which holds up to F_c."""
    measurement = extension.measure_diametral(rhombus)
    assert extension.is_diametral(rhombus) and measurement.passed
    diameter, length = 2.001 * ROW, 2 * RADIUS
    expected = 2.0 * np.sqrt(3.0) * PAIR.F_c / (np.pi * diameter * length)
    # the mean over ten of 200 records misses the peak by the rise of five, and the grains swing
    assert measurement.strength == pytest.approx(expected, rel=0.02)
    volume = 4.0 * 4.0 / 3.0 * RADIUS**3 / (diameter**2 / 4.0 * length)
    assert measurement.filling_factor == pytest.approx(volume, rel=1e-9)
    numbers, failed = extension.DIAMETRAL.evaluate(rhombus)
    assert (
        not failed
        and numbers["diametral_strength"] == extension.measure_diametral(rhombus).strength
    )
    assert 0.0 < numbers["diametral_strain"] < 4e-4 and numbers["diametral_passed"]
    (axes,) = plots.draw_figures(rhombus)["diametral"].axes
    assert axes.get_xlabel() == "deflection over the diameter"
    assert any(
        row[0] == "diametral strength" for row in analysis.tabulate(analysis.summarise(rhombus))
    )


# -- an elastic disc -----------------------------------------------------------------------------


@pytest.fixture(scope="module")
def elastic(tmp_path_factory):
    """A disc of a triangular lattice, which is elastically isotropic in its plane; its top grain
    alone touches the plate, with half of the force that breaks the contact below it."""
    j, i = np.meshgrid(np.arange(-14, 15), np.arange(-14, 15))
    x = np.stack([(i + 0.5 * (j % 2)) * D, 0.0 * i, j * ROW], -1).reshape(-1, 3)
    x = x[np.linalg.norm(x, axis=1) < 12 * ROW + 1e-3 * D]  # one grain at the top, one below
    scene = disc_scene(x, 24 * ROW + 2e-3 * D, speed=1e-3, strain=1e-3).input_data
    press = {"name": "press", "drive": {"wall_speed": "1 mm/s"}, "stop": {"strain": 1.2e-5}}
    rest_stage = {"name": "rest", "drive": {"wall_speed": "0 m/s"}, "stop": {"time": "2 us"}}
    output = {"series": {"steps": 200}, "snapshots": "off"}
    scene = {k: v for k, v in scene.items() if k != "stop"} | {"boundary": {"kind": "plates"}}
    folder = tmp_path_factory.mktemp("elastic") / "run"
    execute(Scene.from_dict(scene | {"stages": [press, rest_stage], "output": output}), folder)
    with analysis.open_run(folder) as run:
        yield run


def stress_of_point_loads(x, z, force, radius):
    """xx, zz of a disc of that radius under two forces per length along z at (0, +-radius): two
    Flamant solutions and a uniform tension (Timoshenko & Goodier, sec. 41)."""
    out = []
    for ends in (radius - z, radius + z):
        square = x**2 + ends**2
        out.append((x**2 * ends / square**2, ends**3 / square**2))
    xx, zz = np.sum(out, axis=0)
    scale = 2.0 * force / np.pi
    return scale * (0.5 / radius - xx), scale * (0.5 / radius - zz)


@pytest.mark.long
def test_stress_in_an_elastic_disc(extension, elastic):
    """Contact forces within a third of the radius add up to the closed form, which does not depend
    on the elastic constants. The rim is a lattice's: its radius is known to half a row."""
    frame = analysis.read_frame(elastic, -1)
    measurement = extension.measure_diametral(elastic)
    radius = measurement.diameter / 2.0
    force = measurement.stress[-1] * np.pi * measurement.diameter * measurement.length / 2.0
    assert 0.2 * PAIR.F_c < force < np.sqrt(3.0) * PAIR.F_c
    ends = frame.contacts
    first, two = (frame.position[ends[name].values] for name in ("grain_i", "grain_j"))
    # points along each line of centres; those within the circle are its part there
    fractions = (np.arange(50) + 0.5) / 50.0
    along = first[:, None] + fractions[:, None] * (two - first)[:, None]
    reach = radius / 3.0
    fraction = np.mean(np.hypot(along[..., 0], along[..., 2]) < reach, axis=1)
    sums = np.einsum("c,ca,cb->ab", fraction, ends.force.values.astype(float), two - first)
    measured = sums[[0, 2], [0, 2]] / (np.pi * reach**2)
    r, angle = reach * np.sqrt((np.arange(60) + 0.5) / 60.0), np.linspace(0, 2 * np.pi, 90)[:-1]
    x, z = r * np.cos(angle)[:, None], r * np.sin(angle)[:, None]
    expected = [np.mean(s) for s in stress_of_point_loads(x, z, force, radius)]
    np.testing.assert_allclose(measured, expected, rtol=0.5 / 12.0)
    # in the very middle it is the formula of the test, across the load
    middle = stress_of_point_loads(0.0, 0.0, force, radius)
    np.testing.assert_allclose(
        middle, measurement.stress[-1] * measurement.length * np.array([1.0, -3.0])
    )
    assert not extension.measure_diametral(elastic).passed
    rows = {row[0]: row[1] for row in analysis.tabulate(analysis.summarise(elastic))}
    assert rows["diametral strength"].startswith("at least")


# -- what is found in the records ----------------------------------------------------------------


def record_press(stress):
    """A run whose plates push with the forces of a nominal stress."""
    area = np.pi * 20e-6 * 10e-6 / 2.0
    force = np.zeros((len(stress) + 1, 6, 3))
    force[1:, 4, 2], force[1:, 5, 2] = np.array(stress) * area, -np.array(stress) * area
    height = 20e-6 * (1.0 - 1e-3 * np.arange(len(force)))
    run = synthetic.make_run(scene="boundary: {kind: plates}", height=height, wall_force=force)
    run.attrs["sample"] = "{shape: lying cylinder, diameter: 20.0e-6, length: 10.0e-6}"
    snapshots = xr.Dataset({"radius": ("grain", np.full(100, RADIUS))})
    run._tree = xr.DataTree.from_dict({"snapshots": snapshots})
    return run


def test_the_strength_is_the_first_maximum_that_the_force_stays_below(extension):
    """A peak of 1 kPa, a lasting fall by 30 %, and a second rise when the remnant is pressed."""
    up, down = np.linspace(0, 1e3, 100), np.linspace(1e3, 7e2, 50)
    second_rise = np.concatenate([np.full(60, 7e2), np.linspace(7e2, 5e3, 99)])
    measurement = extension.measure_diametral(record_press(np.concatenate([up, down, second_rise])))
    # the mean over ten records about the peak, by hand: 5 of a slope of 10.1, 5 of one of 6.1 Pa
    assert measurement.passed and measurement.strength == pytest.approx(1e3, rel=0.04)
    assert measurement.strength_strain == pytest.approx(0.1, abs=5e-3)
    small = np.concatenate(
        [up, np.linspace(1e3, (1 - extension.FALL + 0.05) * 1e3, 50), second_rise[60:]]
    )
    measurement = extension.measure_diametral(record_press(small))
    assert not measurement.passed and measurement.strength == pytest.approx(5e3, rel=0.05)
    assert np.interp(0.05, measurement.strain, measurement.mean) == pytest.approx(500, rel=0.02)
    # a grain that slips between the plates: a fall by half that is over after 2 % of the diameter
    blip = np.concatenate([np.linspace(0, 500, 30), np.linspace(250, 500, 20), 0.5e3 + up])
    assert not extension.measure_diametral(record_press(blip)).passed


def test_what_is_no_diametral_compression(extension):
    run = record_press([1.0] * 5)
    with pytest.raises(DustError, match="has 5 records of the force; allowed: 10 or more"):
        extension.measure_diametral(run)
    run.attrs["sample"] = "{shape: cylinder}"
    assert not extension.is_diametral(run)
    with pytest.raises(DustError, match="is no diametral compression, which needs a lying"):
        extension.measure_diametral(run)


MASS, _ = ref.mass_and_inertia()
# of the critical rate: steps so small at the end that the chain, which swings about its new
# length, does not break before
RATES = [0.5, 0.7, 0.8, 0.86, 0.9, 0.92, 0.94, 0.96, 0.98, 1.0, 1.02]
STEPS = 4000
OWN = "reissl2024/spin_up.py"


@pytest.fixture(scope="module")
def spin_up():
    with import_bundled(OWN) as module:
        yield module


@pytest.fixture(scope="module")
def spun(spin_up, tmp_path_factory):
    """A chain of four grains that is spun up, and the rate [rad/s] at which its middle contact
    pulls with F_c: m omega^2 (d/2 + 3d/2), d the distance of two grains."""
    d = 2 * RADIUS - PAIR.delta0
    critical = np.sqrt(PAIR.F_c / (MASS * 2.0 * d))
    stages = [{"name": "rest", "stop": {"steps": 1}}]
    for number, step in enumerate(np.diff([0.0, *RATES])):
        spin = ["0 rad/s", "0 rad/s", f"{step * critical:.17g} rad/s"]
        drive = {"push": [{"grains": "all", "spin": spin}]}
        stages.append({"name": f"s{number}", "drive": drive, "stop": {"steps": STEPS}})
    scene = make_scene(
        sample={"kind": "chain", "grains": 4, "axis": "x"}, stages=stages, stop=None,
        damping="viscoelastic", output={"series": {"steps": 400}}, extensions=[OWN],
    )  # fmt: skip
    folder = tmp_path_factory.mktemp("spun") / "chain"
    execute(scene, folder)
    with analysis.open_run(folder) as run:
        yield run, critical


@pytest.mark.long
def test_a_chain_breaks_where_its_middle_pulls_with_the_largest_force(spin_up, spun):
    run, critical = spun
    spin = spin_up.measure_spin_up(run)
    assert (
        spin_up.is_spun(run) and spin.broken is not None and spin.largest_share[spin.broken] == 0.5
    )
    # the step before the critical one, or that which swings beyond it
    assert 0.95 * critical < spin.rate[spin.top] < 1.01 * critical
    rates = spin.rigid_rate[: spin.broken] / critical
    nearest = np.abs(rates[:, None] - [0.0, *RATES]).min(axis=1)
    # the moment of inertia is that of the chain already stretched by half of the critical rate
    assert nearest.max() < 1e-3 and rates[-1] >= 0.96
    assert np.all(spin.rate[: spin.broken] <= 1.001 * spin.rigid_rate[: spin.broken])
    run, critical = spun
    numbers, failed = spin_up.SPIN_UP.evaluate(run)
    assert not failed and numbers["spin_broken"] and numbers["spin_rate"] < 1.01 * critical
    # rho R^2 omega^2 / 4 = M omega^2 / (16 pi R / 3), and R^2 = 5/3 of the mean square distance
    square = 5.0 / 3.0 * 1.25 * (2 * RADIUS - PAIR.delta0) ** 2
    stress = 3 * 4 * MASS / (16 * np.pi * np.sqrt(square)) * numbers["spin_rate"] ** 2
    assert numbers["spin_stress"] == pytest.approx(stress, rel=1e-3)
    upper, lower = plots.draw_figures(run)["spin_up"].axes
    assert "rad/s" in upper.get_ylabel() and "largest fragment" in lower.get_ylabel()


@pytest.mark.long
def test_a_later_process_shows_them(spun, tmp_path):
    """The result names the bundled file by its content, and no option is needed."""
    run, _ = spun
    largest = f"{analysis.summarise(run)['spin_rate']:.3g}"
    for words in (["compare", run.path], ["plot", run.path, "-o", tmp_path]):
        with extensions_forgotten():
            result = invoke(*words)
            assert result.exit_code == 0 and "--extension" not in result.output
            assert largest in result.stdout or (tmp_path / "spin_up.png").exists()


@pytest.mark.long
def test_what_is_no_aggregate_is_refused(spin_up, spun, monkeypatch):
    run, _ = spun
    monkeypatch.setattr(spin_up, "count_frames", lambda run: 1)
    monkeypatch.setattr(spin_up, "read_frame", lambda run, n: last)
    last = analysis.read_frame(run, -1)
    with pytest.raises(DustError, match="must be one piece"):
        spin_up.measure_spin_up(run)
