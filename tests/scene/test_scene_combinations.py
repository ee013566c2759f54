"""What a user is told whose blocks are right one by one, but not together."""

import pytest
from scenes import OPEN, POSITIONS, edited, scene, text_of

from dusttaichi.errors import DustError
from dusttaichi.scene import from_yaml


@pytest.mark.parametrize(
    "blocks, parts",
    [
        (
            {"boundary": "{kind: open}"},
            ["stop.filling_factor = 0.55", "without all six walls", "kind: box"],
        ),
        ({"boundary": "{kind: box}"}, ["stop.filling_factor", "while the top wall is stationary"]),
        (
            {"boundary": "{kind: box, omit: [x_min], wall_speed: 1 m/s}"},
            ["stop.filling_factor", "without all six walls"],
        ),
        ({**OPEN, "stop": "{pressure: 1 kPa, steps: 5}"}, ["stop.pressure", "the top wall"]),
        (
            {"boundary": "{kind: box, omit: [top]}", "stop": "{pressure: 1 kPa, steps: 5}"},
            ["stop.pressure", "the top wall, and there is none"],
        ),
        (
            {"boundary": "{kind: box}", "stop": "{pressure: 1 kPa}"},
            ["stop.pressure", "wall is stationary", "add a time or steps"],
        ),
        (
            {
                "boundary": "{kind: box, omit: [bottom], wall_speed: 1 m/s}",
                "stop": "{pressure: 1 kPa}",
            },
            ["stop.pressure", "without a bottom wall"],
        ),
        (
            {**OPEN, "output": "{profiles: {filling_factor: 0.1}}"},
            ["output.profiles.filling_factor = 0.1", "use strain, steps or time"],
        ),
        (
            {"numerics": "{time_step: 1 ns}", "output": "{series: {time: 0.1 ns}}"},
            ['output.series.time = "0.1 ns"', "shorter than numerics.time_step"],
        ),
        (
            {
                "sample": "{kind: rbd, size: [40 um, 40 um, 40 um]}",
                "boundary": "{kind: box, wall_speed: 1 m/s, size: [40 um, 40 um, 39 um]}",
            },
            ["boundary.size", "the sample does not fit"],
        ),
        (
            {
                "sample": f"{{kind: explicit, {POSITIONS}}}",
                "boundary": "{kind: box, wall_speed: 1 m/s, size: [2 um, 9 um, 9 um]}",
            },
            ["boundary.size", "the sample does not fit"],
        ),
        # far outside of what can be computed
        ({"boundary": "{kind: box, wall_speed: 1e-300 m/s}"}, ["boundary.wall_speed", "1e-20 m/s"]),
        ({"boundary": "{kind: box, wall_speed: 1e200 m/s}"}, ["boundary.wall_speed", "3e+08 m/s"]),
        ({"boundary": "{kind: box, side_walls: 1e300}"}, ["boundary.side_walls", "1e+12 can"]),
        ({"boundary": "{kind: plates, glue: 1e300}"}, ["boundary.glue", "1e+12 can"]),
        ({"sample": "{kind: pair, gap: 1e200 m}"}, ["sample.gap", "1e+07 m can"]),
        ({"sample": "{kind: pair, gap: 1e9999999 um}"}, ["sample.gap", "not a finite number"]),
        ({"stop": "{steps: 1e18}"}, ["stop.steps", "1e+15 can"]),
        # what would hold a pressure or a stress
        ({"boundary": "{kind: plates, shear_rate: 1 s^-1}"}, ["boundary.shear_rate", "unknown"]),
        (
            {"boundary": "{kind: box, omit: [top], pressure: 5 kPa}"},
            ["boundary.pressure", "nothing that it could move"],
        ),
        (
            {"boundary": "{kind: periodic, stress: [free, free, free]}"},
            ["boundary.stress", "it sets the scale"],
        ),
        (
            {"boundary": "{kind: periodic, axes: [x, y], shear_rate: 1 s^-1}"},
            ["boundary.shear_rate", "no cell that it"],
        ),
        ({"boundary": "{kind: periodic, gain: 0.3}"}, ["boundary.gain", "neither is given"]),
        (
            {"boundary": "{kind: periodic, pressure: 1 kPa, stress: -1 kPa}"},
            ["boundary.", "not allowed together with stress"],
        ),
        (
            {"boundary": "{kind: box, pressure: 1 kPa, shear_speed: 1 m/s, gain: 0}"},
            ["boundary.gain", "above 0"],
        ),
    ],
)
def test_blocks_that_do_not_go_together(blocks, parts):
    with pytest.raises(DustError) as error:
        scene(**blocks)
    assert all(part in str(error.value) for part in [*parts, "(line "])


def test_all_problems_at_once_in_the_order_of_the_file():
    text = edited("boundary", "boundary:\n  kind: box\n  wall_speed: 1 cm\n  sides: 5")
    text = text.replace("grains: 100", "grains: -1")
    with pytest.raises(DustError) as error:
        from_yaml(text, title="a.yaml")
    lines = str(error.value).splitlines()
    assert lines[1].lstrip().startswith("sample.grains = -1") and lines[1].endswith("(line 4)")
    assert lines[2] == (
        '  boundary.wall_speed = "1 cm": a speed of at least 0 is needed, for example "1 cm/s"'
        "  (line 7)"
    )
    assert lines[3].lstrip().startswith("boundary.sides = 5") and lines[3].endswith("(line 8)")
    assert len(lines) == 4


@pytest.mark.parametrize("block", ["name", "material", "sample", "boundary", "stop"])
def test_missing_block(block):
    text = edited(block, "# left out")
    with pytest.raises(DustError, match=f"  {block}: it is missing"):
        from_yaml(text)


DUST = """
name: falling
method: continuum
material: dust_g09
sample: {kind: block, size: [1 mm, 1 mm]}
numerics: {spacing: 0.1 mm}
stop: {steps: 1}
"""
GRAINS = text_of(**OPEN)


def acceleration(scene, gravity):
    return from_yaml(f"{scene}\ngravity: {gravity}\n").gravity.acceleration


@pytest.mark.parametrize("scene", [GRAINS, DUST], ids=["grains", "continuum"])
def test_one_number_is_downwards_and_a_list_goes_anywhere(scene):
    assert acceleration(scene, "9.81 m/s^2") == (0.0, 0.0, -9.81)
    assert acceleration(scene, "0 m/s^2") == (0.0, 0.0, 0.0)
    for written in ("{}", "{{acceleration: {}}}"):
        slant = written.format("[1 m/s^2, 0 m/s^2, -2 m/s^2]")
        assert acceleration(scene, slant) == (1.0, 0.0, -2.0)


def test_plane_strain_has_x_and_z():
    assert acceleration(DUST, "[1 m/s^2, -2 m/s^2]") == (1.0, 0.0, -2.0)
    again = from_yaml(from_yaml(f"{DUST}gravity: [1 m/s^2, -2 m/s^2]").to_yaml())
    assert again.gravity.acceleration == (1.0, 0.0, -2.0)


@pytest.mark.parametrize(
    "scene, gravity, said",
    [
        (GRAINS, "-9.81 m/s^2", ["of at least 0 (downwards)", "acceleration: [0 m/s^2"]),
        (GRAINS, "9.81", ["gravity = 9.81", '"9.81 m/s^2"']),
        (GRAINS, "[1 m/s^2, 2 m/s^2]", ["gravity", "a list of 3 accelerations"]),
        (GRAINS, "{}", ["exactly one of acceleration and central"]),
        (GRAINS, "1e300 m/s^2", ["cannot be computed with", "1e+15 m/s^2 can"]),
        (GRAINS, "[0 m/s^2, 0 m/s^2, -1e16 m/s^2]", ["computed with", "1e+15 m/s^2 can"]),
        (GRAINS, "1e-30 m/s^2", ["cannot be computed with", "1e+15 m/s^2 can"]),
        (DUST, "up", ['gravity = "up"', '"9.81 m/s^2"']),
        (DUST, "[0 m/s^2, 1 m/s^2, 0 m/s^2]", ["gravity.acceleration[1]", "no y in plane strain"]),
        (DUST, "{central: {mass: 1 kg}}", ["gravity.central", "method: grains only"]),
        (
            f"{DUST}boundary: {{kind: faces, periodic: [x]}}",
            "[1 m/s^2, -2 m/s^2]",
            ["gravity.acceleration[0]", "the cell is periodic along x"],
        ),
    ],
)
def test_what_it_is_not(scene, gravity, said):
    with pytest.raises(DustError) as refused:
        from_yaml(f"{scene}\ngravity: {gravity}\n")
    for words in said:
        assert words in str(refused.value), str(refused.value)
