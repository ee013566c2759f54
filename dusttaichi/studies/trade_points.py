"""Points of a trade: which parameters at which levels, from which scene, with which seeds."""

import math
import re

from dusttaichi import method
from dusttaichi.errors import DustError
from dusttaichi.method.trade import SAMPLE, Point, changed, stage_paths
from dusttaichi.scene import quantities
from dusttaichi.studies.settings import keys_of

QUICK = 3  # levels of a parameter
NAMES = tuple(
    parameter.name
    for name in method.METHODS
    for parameter in getattr(
        method.attribute(method.load_method(name).trade_parameters), "parameters", ()
    )
)


def parameters_of(scene):
    """The Parameters of the method of a scene. Raises DustError where it has none."""
    found = method.attribute(method.find_method(scene).trade_parameters)
    if found is None:
        raise DustError(f"method: {scene.method} has no parameters for dust trade")
    return found


def base(scene, threads=1):
    """The scene before the changes: one run, with a time in place of a number of steps.

    threads: of each run, by default one, so that costs do not contain what is shared among several.

    A number of steps would be another time at another time step.
    """
    given = scene.input_data
    given.pop("replicas", None)
    scene = scene.with_data(given).with_value("numerics.threads", threads)
    counted = [
        path
        for path, plan in zip(stage_paths(scene), scene.stage_plans, strict=True)
        if plan.stop.steps is not None
    ]
    if not counted:
        return scene
    step = parameters_of(scene).step
    if step is None:
        text = "a number of steps is another time at another spacing; set stop.time"
        raise DustError(f"{counted[0]}stop.steps: {text}")
    dt = step(scene)
    for path in counted:
        given = scene.input_data
        block = given
        for key in [k for k in path.split(".") if k]:
            block = block[int(key) if key.isdigit() else key]
        steps = block["stop"].pop("steps")
        if block["stop"].get("time") is None:
            # a little less, so that rounding does not add a step
            block["stop"]["time"] = quantities.format((float(steps) - 0.01) * dt, "time")
        scene = scene.with_data(given)
    return scene


def chosen(text):
    """Names of parameters in a text such as "skin,speed"; None: all. Raises DustError."""
    if text is None:
        return NAMES
    names = [name.strip() for name in text.split(",") if name.strip()]
    unknown = [name for name in names if name not in NAMES]
    if unknown or not names:
        what = ", ".join(unknown) or text
        raise DustError(f"--parameters {what}: unknown parameter; allowed: {', '.join(NAMES)}")
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
            f"--parameters {', '.join(names)}: no parameter of method: {scene.method}; allowed: "
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
        Point(f"seed + {n}", "seed", f"+{n}", n, SAMPLE, changes)
        for n in range(1, count)
        if (changes := seeds_moved(scene, n))
    ]


def seeds_moved(scene, number):
    """Changes that add `number` to every seed of the sample; {} where none has an effect.

    Among the lattices of the continuum only a glass is random.
    """
    found = keys_of({"sample": scene.sample.model_dump(mode="json")}, "seed")
    return {
        ".".join(path): (block["seed"] + number) % 2**32
        for path, block in found
        if block.get("lattice", "glass") == "glass"
    }


def _is(scene, changes):
    """True where the changes leave the scene unchanged."""
    try:
        return changed(scene, changes) == scene
    except DustError:  # it stays, as a point that is refused
        return False


def _number(text):
    try:
        return float(text)
    except ValueError:
        return math.nan


def share_of(text):
    """A share from "5%", "5 %" or "0.05". Raises DustError."""
    match = re.fullmatch(r"\s*([\d.eE+-]+)\s*(%?)\s*", text)
    try:
        value = float(match[1]) / (100.0 if match[2] else 1.0)
    except (TypeError, ValueError):
        value = 0.0
    if not 0.0 < value <= 1.0:
        raise DustError(f"--tolerance {text}: must be a share above 0 and up to 1, such as 5%")
    return value
