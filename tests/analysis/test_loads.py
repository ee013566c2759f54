"""Strengths in shear, controlled loads, and a wall that outruns the cake, from known series."""

import numpy as np
import pytest
import synthetic
import xarray as xr
import yaml
from synthetic import make_run

from dusttaichi import analysis
from dusttaichi.analysis import (
    Friction,
    fit_friction,
    is_triaxial,
    measure_controlled_loads,
    measure_shear_tests,
    measure_triaxial_tests,
)
from dusttaichi.analysis import dynamic as fast
from dusttaichi.analysis.numbers.compression import FAST
from dusttaichi.analysis.summary import summarise, tabulate
from dusttaichi.errors import DustError
from dusttaichi.physics.laws import S12_STATIC, dynamic_law
from dusttaichi.plots import loads, shear, triaxial
from dusttaichi.scene.material import NAMED

N = 40
SCENE = "boundary: {kind: box, pressure: 5 kPa}"


def run(scene="", stages="", **variables):
    length = len(next(iter(variables.values())))
    attrs = {"stages": stages} if stages else {}
    return make_run(np.linspace(0.0, 1e-5, length), scene, attrs, **variables)


def triaxial_run(drive, stress, length):
    """A stage `test` at a filling factor of 0.3, its edges (N,) alike along all axes."""
    scene = f"stages: [{{name: test, drive: {{stress: [{drive}, {drive}, free]}}}}]"
    box = np.broadcast_to(length[:, None], (N, 3))
    variables = {"stress": stress, "box_length": box, "filling_factor": np.full(N, 0.3)}
    return run(scene, "test", stage=np.zeros(N, int), **variables)


HELD = "boundary: {kind: periodic, stress: [free, free, %s Pa]}"


def shear_cell(load, strength, scene=HELD):
    """A cell that yields at once at this normal stress, as prescribed, and this strength [Pa]."""
    stress = np.zeros((N, 3, 3))
    stress[:, 0, 2] = stress[:, 2, 0] = -strength  # against the way of the image above
    stress[:, 2, 2] = -load
    strain = -np.linspace(0.0, 0.2, N)
    scene = scene.replace("%s", f"{-load}")
    return run(scene, stress=stress, shear_strain=strain, filling_factor=np.full(N, 0.3))


def cyclic(drive=""):
    """A cell sheared to 0.2, back to -0.2 and to 0 again, at 1, 2 and 3 kPa of normal stress."""
    ends, level = (0.0, 0.2, -0.2, 0.0), np.repeat([1e3, 2e3, 3e3], N)
    strain = np.hstack([np.linspace(a, b, N) for a, b in zip(ends, ends[1:], strict=False)])
    stress = np.zeros((3 * N, 3, 3))
    stress[:, 0, 2] = stress[:, 2, 0] = np.repeat([1.0, -1.0, 1.0], N) * 5e3
    stress[:, 2, 2] = -level
    drives = [drive.replace("LOAD", f"{k} kPa") for k in (1, 2, 3)]
    stages = "".join(
        f"- {{name: {n}, drive: {{shear_rate: 1{own}}}}}\n"
        for n, own in zip("abc", drives, strict=True)
    )
    return run(
        f"stages:\n{stages}", "a b c", stress=stress, shear_strain=strain,
        filling_factor=np.full(3 * N, 0.3), stage=np.repeat([0, 1, 2], N),
    )  # fmt: skip


def test_a_line_of_friction_needs_a_prescribed_compressive_normal_stress():
    """At constant volume the normal stress is what comes of it; a tensile one has no friction."""
    free = [cyclic(), cyclic(", stress: [-LOAD, -LOAD, free]"), cyclic(", strain_rate: 1")]
    for free_run in free:
        assert (
            fit_friction(measure_shear_tests(free_run)) is None and len(shear(free_run).axes) == 1
        )
    for drive in (", stress: [free, free, -LOAD]", ", stress: -LOAD", ", pressure: LOAD"):
        assert fit_friction(measure_shear_tests(cyclic(drive))).slope == pytest.approx(
            0.0, abs=1e-9
        )
    tensile = [measure_shear_tests(shear_cell(load, 2e3))[0] for load in (-2e3, -5e3)]
    assert (
        fit_friction(tensile) is None
        and fit_friction([*tensile, *measure_shear_tests(shear_cell(1e3, 1.0))]) is None
    )


def test_shear_there_and_back_is_a_loop():
    """Against the total shear strain, with the sign of the stress."""
    first, back, repeated = measure_shear_tests(cyclic())
    assert [test.direction for test in (first, back, repeated)] == [1.0, -1.0, 1.0]
    assert back.total_strain[[0, -1]] == pytest.approx([0.2, -0.2])
    assert repeated.total_strain[-1] == pytest.approx(0.0)
    axes = shear(cyclic()).axes[0]
    forth, and_back = axes.lines[:2]
    np.testing.assert_allclose(and_back.get_xdata(), back.total_strain)
    assert forth.get_ydata()[0] == pytest.approx(5.0)
    assert and_back.get_ydata()[0] == pytest.approx(-5.0)
    assert axes.get_xlabel() == "total shear strain"


def test_strength_and_friction():
    shear_tests = [
        measure_shear_tests(shear_cell(load, 1e3 + 0.5 * load))[0] for load in (2e3, 5e3, 1e4)
    ]
    assert [test.strength for test in shear_tests] == pytest.approx([2e3, 3.5e3, 6e3])
    assert [test.load for test in shear_tests] == pytest.approx([2e3, 5e3, 1e4])
    assert (shear_tests[0].strain >= 0.0).all() and shear_tests[0].density == pytest.approx(0.3)
    fit = fit_friction(shear_tests)
    assert fit.cohesion == pytest.approx(1e3) and fit.angle == pytest.approx(26.565, abs=1e-3)
    assert fit_friction(shear_tests[:1]) is None
    assert (
        shear(shear_cell(2e3, 2e3), [shear_cell(5e3, 3e3)]).axes[0].get_xlabel()
        == "shear strain of the stage"
    )
    assert len(shear(shear_cell(2e3, 2e3)).axes) == 1  # one strength is no line
    with pytest.raises(DustError, match="no stage shears"):
        measure_shear_tests(run(filling_factor=np.full(N, 0.3)))


def test_a_wall_that_comes_down_has_not_sheared():
    """The way of a wall over the height changes as the height does; only what it goes counts."""
    height, way = np.linspace(6e-6, 4e-6, N), np.full(N, 1e-6)
    force = np.zeros((N, 6, 3))
    force[:, 5] = 2e-9, 0.0, -1e-8  # of the wall on the grains
    data = {"height": height, "wall_force": force, "pressure": np.full((N, 6), 5e3)}
    still = run(shear_strain=way / height, **data)
    with pytest.raises(DustError, match="no stage shears"):
        measure_shear_tests(still)
    way = np.linspace(0.0, 1e-6, N)
    moved = run(shear_strain=way / height, **data)
    (shear_test,) = measure_shear_tests(moved)
    # the integral of dx / h with h = 6 - 2 x: ln(6/4) / 2
    assert shear_test.strain[-1] == pytest.approx(0.5 * np.log(1.5), rel=1e-3)
    assert shear_test.strength == pytest.approx(1e3) and shear_test.load == pytest.approx(5e3)


def test_controlled_loads():
    phi = 0.2 * np.exp(np.linspace(0.0, 1e-3, N))
    stress = -np.eye(3) * np.linspace(0.0, 1.0, N).clip(max=0.5)[:, None, None] * 1e4
    loaded_run = run(SCENE, stress=stress, filling_factor=phi)
    (load,) = measure_controlled_loads(loaded_run)
    assert load.pressure == pytest.approx(5e3) and load.prescribed == 5e3 and not load.missed
    assert load.overshoot == pytest.approx(0.0, abs=1e-12)
    assert load.creep == pytest.approx(1e-3 / 1e-5)
    assert len(loads(loaded_run, [loaded_run], repeats=[loaded_run]).axes) == 1
    low = run(SCENE, stress=0.2 * stress, filling_factor=phi)
    assert measure_controlled_loads(low)[0].missed and loads(low).axes[0].get_xlim()[0] < 0.2
    with pytest.raises(DustError, match="no stage controls a pressure"):
        loads(run("boundary: {kind: box}", stress=stress, filling_factor=phi))


def test_triaxial_test_and_the_circles_of_mohr():
    """A material that yields where the largest stress is M times the smallest and more."""
    parts, confined = [], (5e3, 2e4)
    for load in confined:
        stress = -np.eye(3) * np.ones(N)[:, None, None] * load
        stress[:, 2, 2] -= 1e3 + 1.5 * load
        one = triaxial_run(f"-{load} Pa", stress, np.exp(-np.linspace(0.0, 0.2, N)))
        (triaxial_test,) = measure_triaxial_tests(one)
        assert triaxial_test.axis == "z" and triaxial_test.strain[-1] == pytest.approx(0.2)
        parts.append(triaxial_test)
    assert [one.strength for one in parts] == pytest.approx([8.5e3, 3.1e4])
    line = fit_friction(parts)
    assert line.triaxial_angle == pytest.approx(np.degrees(np.arcsin(1.5 / 3.5)))
    # the line touches both circles: as far from their middles as their radii
    angle = np.radians(line.triaxial_angle)
    for part in parts:
        radius = 0.5 * part.strength
        distance = (part.load + radius) * np.sin(angle) + line.triaxial_cohesion * np.cos(angle)
        assert distance == pytest.approx(radius)
    near = Friction(1e3, 0.0, 1.5 + 1e-6, 1e-6)  # by the difference of angles
    assert near.triaxial_angle_sigma == pytest.approx(near.triaxial_angle - line.triaxial_angle)
    assert len(triaxial(one).axes) == 3 and is_triaxial(one)
    drawn = triaxial(one, [one]).axes[2]
    assert len(drawn.lines) == 2  # one load: no line of friction
    with pytest.raises(DustError, match="no stage is a triaxial test"):
        measure_triaxial_tests(shear_cell(2e3, 2e3))


@pytest.mark.parametrize("result", [4.4e3, 5.6e3])
def test_a_strength_under_another_load_is_no_strength(result):
    """The deviator of a sample that is confined by more than was prescribed measures nothing."""
    stress = -np.eye(3) * np.ones(N)[:, None, None] * result
    stress[:, 2, 2] -= 2e3
    one = triaxial_run("-5 kPa", stress, np.exp(-np.arange(N) / N))
    (test,) = measure_triaxial_tests(one)
    assert test.missed and not test.has_friction
    numbers = summarise(one)
    assert numbers["triaxial_strength"] is None
    assert numbers["missed_loads"] == [("test", pytest.approx(result), 5e3)]
    assert any(row[1].endswith("instead of 5 kPa") for row in tabulate(numbers))


def test_a_mere_release_is_no_stretch():
    """Let go by 5e-4 into a tension of half a kPa; ten times as far is a tensile test."""
    for way, pulled in ((5e-4, False), (5e-3, True)):
        stress = np.zeros((N, 3, 3))
        stress[:, 2, 2] = np.linspace(-1e2, 5e2, N)
        released_run = run(stress=stress, filling_factor=0.3 / np.linspace(1.0, 1.0 + way, N))
        assert released_run.stretches is pulled and not released_run.compresses


PHI0, LAYER, HEIGHT, SPEED = 0.15, 0.55, 40e-6, 5.0
FRONT = SPEED / (1.0 - PHI0 / LAYER)  # balance of mass
DENSITY = 2650.0
MOMENTUM = DENSITY * PHI0 * FRONT * SPEED


def plough(speed=SPEED, points=400, bins=40, kind="box"):
    """A Run pressed at `speed`: a layer of LAYER grows below the wall until it meets the bottom."""
    time = np.linspace(0.0, HEIGHT * (1 - PHI0 / 0.56) / speed, points)
    height = HEIGHT - speed * time
    phi = PHI0 * HEIGHT / height
    pressure = np.where(phi < 0.53, MOMENTUM * (speed / SPEED) ** 2, 1e6)
    pressure = pressure * 10 ** (0.02 * np.random.default_rng(1).standard_normal(points))
    edges = np.linspace(0.0, HEIGHT, bins + 1)
    lower, upper = edges[:-1], edges[1:]
    shown = np.arange(0, points, 10)
    rows = []
    for number in shown:
        top, front = height[number], HEIGHT - FRONT * time[number] * speed / SPEED
        below = np.clip(np.minimum(upper, front) - lower, 0.0, None)
        layer = np.clip(np.minimum(upper, top) - np.maximum(lower, front), 0.0, None)
        inside = np.clip(np.minimum(upper, top) - lower, 1e-30, None)
        rows.append((PHI0 * below + LAYER * layer) / inside)
    profiles = xr.Dataset(
        {
            "filling_factor": (("profile", "bin"), np.array(rows)),
            "height": ("profile", height[shown]),
            "box_filling_factor": ("profile", phi[shown]),
            "bin_lower": ("bin", lower),
            "bin_upper": ("bin", upper),
        },
        {"profile_time": ("profile", time[shown]), "bin_height": ("bin", 0.5 * (lower + upper))},
    )
    series = {"filling_factor": phi, "height": height, "pressure": pressure}
    return synthetic.make_run(time, yaml.safe_dump(scene(kind)), profiles=profiles, **series)


def scene(load_kind):
    return {"boundary": {"kind": load_kind}, "material": {"name": "s", **NAMED["silicate_s12"]}}


def test_plateau_front_and_layer():
    dynamic_compression = fast.measure_dynamic_compression(plough())
    assert dynamic_compression.speed == pytest.approx(SPEED)
    # within its own standard error; the scatter put in is 0.02 dex of some 200 records
    assert (
        abs(dynamic_compression.plateau - MOMENTUM)
        < 4 * dynamic_compression.plateau_sigma
        < 0.02 * MOMENTUM
    )
    # a bin of 1 um lies across the front, which moves by 20 um on the plateau
    assert dynamic_compression.front == pytest.approx(FRONT, rel=0.02)
    assert dynamic_compression.layer == pytest.approx(LAYER, abs=0.02)
    # this layer is a little less dense than phi2 = 0.58
    closed = DENSITY * PHI0 * SPEED**2 / (1 - PHI0 / 0.58)
    assert dynamic_compression.momentum == pytest.approx(closed, rel=1e-6)
    # one pressure at every filling factor has no width in lg P
    assert fast.measure_dynamic_compression(plough()).fits["plateau", "bins"] is None


def test_fits_depend_on_range_and_weights():
    """A fit that ends before the closing rise finds the law, the rise draws it up, and more so
    where every decade of pressure weighs alike: it spans most of them."""
    law = dynamic_law(SPEED)
    phi = np.linspace(0.16, 0.56, 400)
    closing = 10 ** np.clip((phi - 0.45) / 0.05, 0.0, None)  # a decade each 0.05
    run = synthetic.make_run(filling_factor=phi, pressure=law.pressure(phi) * closing)
    curve = analysis.measure_compression_curve(run)
    early = analysis.fit_compression(curve, phi_high=0.4)
    assert early.p_m == pytest.approx(law.p_m, rel=1e-2)
    assert early.delta == pytest.approx(law.delta, rel=2e-2)
    full_fit = analysis.fit_compression(curve)
    assert full_fit.delta > 1.2 * early.delta
    decades = analysis.fit_compression(curve, weights="decades")
    assert decades.delta > 1.2 * full_fit.delta


def test_the_law_beside_is_that_of_the_speed():
    assert analysis.choose_compression_law(plough()).name == dynamic_law(SPEED).name
    slow = plough(speed=0.05)
    assert analysis.choose_compression_law(slow) is S12_STATIC
    with pytest.raises(DustError, match="no dynamic compression"):
        fast.measure_dynamic_compression(slow)
    assert not fast.is_dynamic(plough(kind="plates"))
    halting = plough()
    halting.series["height"] = halting.series.height[0] - 0.5 * (
        halting.series.height[0] - halting.series.height
    ) * (1 + (halting.series.time > halting.series.time[200]))
    assert np.isnan(fast.measure_wall_speed(halting)) and not fast.is_dynamic(halting)


def test_rows_of_the_summary_and_columns_of_a_comparison(tmp_path):
    numbers, failed = FAST.evaluate(plough())
    shown = [row for number in FAST.numbers for row in number.table_rows(numbers)]
    assert not failed and [title for title, *_ in shown][-2:] == [
        "plateau of the pressure, phi 0.2-0.4",
        "compaction front",
    ]
    assert "behind it" in shown[-1][1]
    # a run from a file, so that all that `compare` asks for is there; it is not fast
    slow = analysis.open_run(synthetic.compression_run(tmp_path / "result.nc"))
    assert "front_speed" not in analysis.compare([slow])[0]


def test_the_share_of_a_stage_in_which_its_load_was_missed():
    """By time: the first of ten records is short; the record at the start of the stage before, and
    stages without a load, do not count. Along axes each by itself, a stress of 0 by the scale."""
    names = ["press", "hold"]
    scene = f"stages: [{{name: {names[0]}}}, {{name: {names[1]}, drive: {{pressure: 4 kPa}}}}]"
    pressure = np.zeros((12, 6))
    pressure[:, 5] = [0.0, 3e3, 2e3, 3.9e3, 4e3, 4.1e3, 4.3e3, 4e3, 4e3, 4e3, 4e3, 4e3]
    step = np.array([0, 100, 150, *range(250, 1150, 100)])
    stage = np.repeat([0, 1], [2, 10])
    control_run = run(scene, " ".join(names), stage=stage, pressure=pressure, step=step)
    (control,) = analysis.measure_load_control(control_run)
    assert control.stage == "hold"
    assert control.missed_share == pytest.approx(150 / 950)
    assert (control.lowest, control.highest) == pytest.approx((0.5, 1.075))
    rows = tabulate(summarise(control_run))
    assert any("within 5 % in hold" in row[0] and row[1].startswith("84 %") for row in rows)
    assert summarise(control_run)["load_missed_share"] == pytest.approx(150 / 950)
    stress = np.zeros((N, 3, 3))
    stress[:, 0, 0], stress[: N // 2, 1, 1] = -2e3, 150.0
    mixed = run("boundary: {kind: periodic, stress: [-2 kPa, 0 Pa, free]}", stress=stress)
    assert analysis.measure_load_control(mixed)[0].missed_share == pytest.approx(0.5, abs=1.0 / N)
    assert analysis.measure_load_control(run(pressure=pressure)) == []


def test_the_share_of_a_stage_in_which_the_load_of_a_surface_was_missed():
    """By the same times: of the piston that a stage presses, not of a plate that keeps its force,
    as its own block says, nor in a stage that moves the piston at a velocity."""
    piston = "{kind: plane, name: piston, normal: [0, 0, -1], pressure: 1 kPa}"
    plate = "{kind: plane, name: plate, normal: [0, 0, 1], force: 2 nN}"
    press, move = "{piston: {pressure: 4 kPa}}", "{piston: {velocity: [0 m/s, 0 m/s, 1 m/s]}}"
    scene = (
        f"surfaces: [{piston}, {plate}]\n"
        f"stages: [{{name: press, drive: {{surfaces: {press}}}}},"
        f" {{name: move, drive: {{surfaces: {move}}}}}, {{name: keep}}]"
    )
    pressure, load = np.full((12, 3), np.nan), np.full((12, 3), 2e-9)
    pressure[:, 1] = [0.0, 1e3, 4e3, 4e3, 4.1e3, 0.0, 0.0, 0.0, 1e3, 1e3, 1e3, 0.9e3]
    stage = np.repeat([0, 1, 2], [5, 3, 4])
    pressed = run(
        scene, "press move keep", stage=stage, surface_pressure=pressure, surface_load=load
    )
    pressed.series = pressed.series.assign_coords(surface=["tube", "piston", "plate"])
    controls = analysis.measure_load_control(pressed)
    shares = {(c.stage, c.surface): c.missed_share for c in controls}
    assert shares == {
        ("press", "piston"): pytest.approx(1 / 4),
        ("press", "plate"): 0.0,
        ("move", "plate"): 0.0,
        ("keep", "piston"): pytest.approx(1 / 4),
        ("keep", "plate"): 0.0,
    }
    rows = [row[0] for row in tabulate(summarise(pressed))]
    assert "load within 5 % on piston in press" in rows
    assert summarise(pressed)["load_missed_share"] == pytest.approx(1 / 4)
