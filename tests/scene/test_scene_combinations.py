"""What a user is told whose blocks are right one by one, but not together."""

import pytest
from scenes import OPEN, POSITIONS, edited, scene

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
