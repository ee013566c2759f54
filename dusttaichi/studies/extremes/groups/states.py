"""Single grains, contacts about to form or break, coinciding grains, fast spins."""

from dusttaichi.studies.extremes.groups.grains import BOTTOM, NEAR, ONE, given, scene
from dusttaichi.studies.extremes.results import Cell

FAST = 1e9  # rad/s
TOUCHING = [[0, 0, 0], [2, 0, 0]]  # in radii
ORIGIN = ["0 m"] * 3


def special(quick):
    """Single grains, contacts about to form or break, coinciding grains, fast spins."""
    things = _single() | _touching() | _overlapping() | _pulled() | _spinning()
    cluster = {"kind": "cluster", "grains": 13}
    effects = dict.fromkeys(("rolling", "sliding", "twisting"), "off")
    things["cluster at rest"] = scene(), cluster
    things["no effects, pair"] = (
        scene(interaction={**effects, "damping": "none"}),
        {"kind": "meeting", "sticking": 0.5},
    )
    return [
        Cell("special states", name, blocks, sample, 3_000, kernels="special", row=name)
        for name, (blocks, sample) in things.items()
    ]


def _single():
    """Grains without contacts, and two bound ones: name -> (scene, sample)."""
    timed = scene(numerics={"time_step": "0.1 ns"})
    return {
        "one grain, auto": (scene(), given(ONE)),
        "one grain at rest": (timed, given(ONE)),
        "one grain flying": (timed, given(ONE, velocities=[[1, 2, 3]])),
        "one grain spinning": (timed, given(ONE, spins=[[FAST, 0, 0]])),
        "two grains at rest": (scene(), given([[0, 0, 0], [3, 0, 0]])),
        "two grains, bound": (scene(), {"kind": "chain", "grains": 2}),
    }


def _touching():
    """Two grains at the distance of first contact."""
    found = {"touching exactly, at rest": (scene(), given(TOUCHING))}
    for way, velocity in (
        ("approaching", [1e-3, 0, 0]),
        ("leaving", [-1e-3, 0, 0]),
        ("sliding past", [0, 0.1, 0]),
    ):
        sample = given(TOUCHING, velocities=[velocity, [0, 0, 0]])
        found[f"touching exactly, {way}"] = scene(), sample
    return found


def _overlapping():
    """Two grains with too large an overlap: the scene refuses most of them."""
    found = {}
    for name, second in (
        ("coinciding", "0 m"),
        ("nearly coinciding", "1e-15 m"),
        ("overlapping by half", "0.6 um"),
        ("overlapping by 9 %", "1.092 um"),
    ):
        positions = [ORIGIN, [second, "0 m", "0 m"]]
        found[name] = scene(sample={"kind": "explicit", "positions": positions}), None
    return found


def _pulled():
    """Chains at pull-off."""
    chain = {"kind": "pulled", "grains": 10}
    return {
        "at pull-off, two": (scene(), {"kind": "pulled", "grains": 2}),
        "at pull-off, ten": (scene(), chain),
        "at pull-off, ten, hot": (scene(), chain | {"speed": 0.01}),
    }


def _spinning():
    """Grains in contact with spins at which every spring slips."""
    found = {}
    for name, spins in (
        ("pair rolling", [[0, 0, FAST], [0, 0, -FAST]]),
        ("pair sliding", [[0, 0, FAST], [0, 0, FAST]]),
        ("pair twisting", [[FAST, 0, 0], [-FAST, 0, 0]]),
        ("one of two", [[FAST, FAST, FAST], [0, 0, 0]]),
    ):
        found[f"spin 1e9, {name}"] = scene(), given(NEAR, spins=spins)
    floor = scene(boundary=BOTTOM)
    found["spin 1e9, on a wall"] = floor, given(ONE, spins=[[0, FAST, 0]])
    found["spin 1e9, upright on a wall"] = floor, given(ONE, spins=[[0, 0, FAST]])
    found["spin 1e9, cluster"] = scene(), {"kind": "cluster", "grains": 13, "spin": FAST}
    return found
