"""Parameters that a trade varies in a scene of grains, and their levels."""

import math

from dusttaichi import method
from dusttaichi.errors import DustError
from dusttaichi.scene.numerics import DRAFT, PRESETS
from dusttaichi.studies.trade import scenes
from dusttaichi.studies.trade.point import (
    NUMERICAL,
    PHYSICAL,
    SAMPLE,
    Parameter,
    Parameters,
    Point,
    levels_of,
    parameters_of,
)
from dusttaichi.studies.trade.suggest import kind_of_grains

FRACTIONS = (0.05, 0.1, 0.15, 0.2, 0.25, 0.28, 0.3)
PRECISIONS = ("f64", "mixed", "f32")
NEWTON_STEPS = (0, 1, 2, 3)
SKINS = ("auto", 0.02, 0.05, 0.1, 0.2, 0.4)
SPEEDS = (0.25, 0.5, 1.0, 2.0, 4.0)
SIZES = (0.25, 0.5, 1.0, 2.0)
WINDOWS = ("interval", 10, 100, 1000)
MASSES = (1.0, 4.0, 16.0, 64.0)
SOFTNESS = (1.0, 0.3, 0.1, 0.03, 0.01, 0.003)
SIDES = (0.0, 0.001, 0.01, 0.1, 1.0)
QUICK = 3  # levels of a parameter


def _step_fraction(scene):
    return [
        (f"{f:g}", {"numerics.time_step": "auto", "numerics.step_fraction": f}) for f in FRACTIONS
    ]


def _speed(scene):
    if not scenes.faster(scene, 1.0):
        return "no wall or face moves"
    return [(f"{f:g}", scenes.faster(scene, f)) for f in SPEEDS if f != 1.0]


def _grains(scene):
    found = []
    for factor in SIZES:
        changes = scenes.resized(scene, factor)
        if isinstance(changes, str):
            return changes
        if factor != 1.0:
            found.append((f"{factor:g}", changes))
    return found


def _window(scene):
    if not scene.boundary.walls and not scene.output.stress:
        return "neither pressures nor stresses are averaged"
    return levels_of("output.window", WINDOWS)(scene)


def _mass_scaling(scene):
    if not any(plan.drive.moves for plan in scene.stage_plans):
        return "only for runs with slow walls or faces, and none moves"
    if scene.push or scene.sample.flies:
        return "only for runs with slow walls or faces; inertia matters here"
    return levels_of("numerics.mass_scaling", MASSES)(scene)


def _stiffness_scaling(scene):
    if scene.push:
        return "it changes the speed of sound, at which the response to a push travels"
    levels = levels_of("numerics.stiffness_scaling", SOFTNESS[1:])(scene)
    # a trade measures its effect, also where the scene itself would refuse it
    levels = [(text, {"numerics.scaling_anyway": True} | changes) for text, changes in levels]
    return [row for row in levels if _allowed(scene, row[1])] or "contacts are too soft already"


def _allowed(scene, changes):
    """False where the scene refuses the changes."""
    try:
        return bool(scenes.changed(scene, changes))
    except DustError:
        return False


def _side_walls(scene):
    sides = {"x_min", "x_max", "y_min", "y_max"}
    if scene.boundary.kind != "box" or not sides & set(scene.boundary.walls):
        return "only a box has side walls"
    return levels_of("boundary.side_walls", SIDES)(scene)


def _part(name):
    def levels(scene):
        if getattr(scene.interaction, name) is None:
            return "it is off"
        return [("off", {f"interaction.{name}": "off"})]

    return levels


def _damping(scene):
    if scene.interaction.damping.model == "none":
        return "it is off"
    return [("off", {"interaction.damping": "none"})]


PARAMETERS = (
    Parameter("step_fraction", NUMERICAL, "time step over the stiffest period", _step_fraction),
    Parameter("precision", NUMERICAL, "precision", levels_of("numerics.precision", PRECISIONS)),
    Parameter(
        "newton_steps",
        NUMERICAL,
        "Newton steps of the contact radius",
        levels_of("numerics.newton_steps", NEWTON_STEPS),
    ),
    Parameter(
        "skin", NUMERICAL, "skin of the search over the radius", levels_of("numerics.skin", SKINS)
    ),
    Parameter("window", NUMERICAL, "steps that pressures are averaged over", _window),
    Parameter("speed", PHYSICAL, "speed of walls and faces over that of the scene", _speed),
    Parameter("mass_scaling", PHYSICAL, "factor on the mass of all grains", _mass_scaling),
    Parameter("stiffness_scaling", PHYSICAL, "factor on the elastic moduli", _stiffness_scaling),
    Parameter("side_walls", PHYSICAL, "factor on the side walls", _side_walls),
    *(
        Parameter(name, PHYSICAL, f"{name} on or off", _part(name))
        for name in ("rolling", "sliding", "twisting")
    ),
    Parameter("damping", PHYSICAL, "damping on or off", _damping),
    Parameter("asperities", PHYSICAL, "asperities on or off", _part("asperities")),
    Parameter("grains", SAMPLE, "number of grains over that of the scene", _grains),
)


def _presets(scene):
    """Points of the presets; that of `reference` is converged in all numerics."""
    return [
        Point(
            name,
            "preset",
            name,
            math.nan,
            PHYSICAL if name == DRAFT else NUMERICAL,
            scenes.reference(scene) if name == "reference" else scenes.preset(scene, name),
        )
        for name in PRESETS
    ]


def _half_step(scene):
    """The reference at half its step, for its error."""
    reference = scenes.changed(scene, scenes.reference(scene))
    changes = scenes.reference(scene)
    changes["numerics.step_fraction"] = 0.5 * reference.numerics.step_fraction
    return Point(
        "reference, half the step",
        "reference",
        "half its step",
        math.nan,
        NUMERICAL,
        changes,
    )


GRAINS = Parameters(
    PARAMETERS,
    _presets,
    _half_step,
    step=lambda scene: scenes.own_step(scene).dt,
    kind=kind_of_grains,
)
NAMES = tuple(
    parameter.name
    for name in method.METHODS
    for parameter in getattr(
        method.attribute(method.named(name).trade_parameters), "parameters", ()
    )
)


def chosen(text):
    """Names of parameters in a text such as "skin,speed"; None: all. Raises DustError."""
    if text is None:
        return NAMES
    names = [name.strip() for name in text.split(",") if name.strip()]
    unknown = [name for name in names if name not in NAMES]
    if unknown or not names:
        what = ", ".join(unknown) or text
        raise DustError(f"--knobs {what}: unknown parameter; allowed: {', '.join(NAMES)}")
    return tuple(name for name in NAMES if name in names)


def ladder(scene, names=NAMES, quick=False):
    """(points, left out: parameter -> reason) of a base scene: every level but its own.

    quick: at most three levels of a parameter, the first and the last among them. Raises DustError
    where the method of the scene has none of the parameters.
    """
    own = [parameter.name for parameter in parameters_of(scene).parameters]
    foreign = [] if names == NAMES else [name for name in names if name not in own]
    if foreign and len(foreign) == len(names):
        raise DustError(
            f"--knobs {', '.join(names)}: no parameter of method: {scene.method}; allowed: "
            f"{', '.join(own)}"
        )
    points, left_out = [], dict.fromkeys(foreign, f"no parameter of method: {scene.method}")
    for parameter in parameters_of(scene).parameters:
        if (name := parameter.name) not in names:
            continue
        levels = parameter.levels(scene)
        if isinstance(levels, str):
            left_out[name] = levels
            continue
        levels = [level for level in levels if not _is(scene, level[1])]
        if quick and len(levels) > QUICK:
            levels = [levels[round(n * (len(levels) - 1) / (QUICK - 1))] for n in range(QUICK)]
        points += [
            Point(f"{name} = {text}", name, text, _number(text), parameter.kind, changes)
            for text, changes in levels
        ]
    return points, left_out


def seeds(scene, count):
    """Points with further seeds, `count` with that of the scene; [] for a sample without seeds."""
    return [
        Point(f"seed + {n}", "seed", f"+{n}", float(n), SAMPLE, changes)
        for n in range(1, count)
        if (changes := scenes.seeds_moved(scene, n))
    ]


def _is(scene, changes):
    """True where the changes leave the scene unchanged."""
    try:
        return scenes.changed(scene, changes) == scene
    except DustError:  # it stays, as a point that is refused
        return False


def _number(text):
    try:
        return float(text)
    except ValueError:
        return math.nan
