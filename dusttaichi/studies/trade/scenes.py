"""Changes of a scene by a trade: dicts, path in the YAML -> value."""

from dusttaichi.errors import DustError
from dusttaichi.samples.values import CylinderSize
from dusttaichi.scene import quantities
from dusttaichi.scene.drive import SHEARS, SPEEDS
from dusttaichi.scene.numerics import PRESETS
from dusttaichi.studies.settings import keys_of
from dusttaichi.studies.trade.point import parameters_of

DRIVES = (*SPEEDS, *SHEARS)
# keys that a preset sets; other keys of the user in numerics stay
PRESET_KEYS = ("accuracy", "time_step")
# keys without effect on the result: the only ones that stay in the reference
NEUTRAL_KEYS = ("backend", "threads", "ledger_tolerance")


def changed(scene, changes):
    """The scene with changes, made in their order. Raises DustError."""
    for path, value in changes.items():
        scene = scene.with_value(path, value)
    return scene


def base(scene, threads=1):
    """The scene before the changes: one run, with a time in place of a number of steps.

    threads: of each run, by default one, so that costs do not contain what is shared among several.

    A number of steps would be another time at another time step.
    """
    given = scene.given
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
        given = scene.given
        block = given
        for key in [k for k in path.split(".") if k]:
            block = block[int(key) if key.isdigit() else key]
        steps = block["stop"].pop("steps")
        if block["stop"].get("time") is None:
            # a little less, so that rounding does not add a step
            block["stop"]["time"] = quantities.format((float(steps) - 0.01) * dt, "time")
        scene = scene.with_data(given)
    return scene


def own_step(scene):
    """time_step.TimeStep of a scene."""
    from dusttaichi import samples
    from dusttaichi.grains.grain_contacts import grain_properties
    from dusttaichi.grains.time_step import chosen_step

    sample = samples.pushed(scene, samples.make(scene))
    return chosen_step(scene, sample, grain_properties(scene, sample))


def own_fraction(scene):
    """Time step of a scene over its stiffest period, as `step_fraction`."""
    if scene.numerics.time_step == "auto":
        return scene.numerics.step_fraction
    tenth = own_step(changed(scene, {"numerics.time_step": "auto", "numerics.step_fraction": 0.1}))
    return 0.1 * scene.numerics.time_step / tenth.dt


def stage_paths(scene):
    """Prefix of the path of each stage's stop: "" or "stages.0." ..."""
    return [f"stages.{n}." for n in range(len(scene.stages))] or [""]


def faster(scene, factor):
    """Changes that make every wall and face move `factor` times as fast; {} where none moves.

    The times of these stages become shorter by the factor: the displacement stays the same.
    """
    changes = {}
    for path, plan in zip(stage_paths(scene), scene.stage_plans, strict=True):
        where = f"{path}drive" if path else "boundary"
        if not plan.drive.moves or plan.drive.controls_load:  # a load determines the speed
            continue
        for law in DRIVES:
            value = getattr(plan.drive, law)
            if value is not None and (value if law != "wall_speed" else value != 0.0):
                changes[f"{where}.{law}"] = _written(law, value, factor)
        if plan.stop.time is not None:
            changes[f"{path}stop.time"] = quantities.format(plan.stop.time / factor, "time")
    return changes


def _written(law, value, factor):
    if law == "compression_rate":
        return value * factor
    dimension = "rate" if law in ("strain_rate", "shear_rate") else "speed"
    if isinstance(value, tuple):
        return [quantities.format(v * factor, dimension) for v in value]
    return quantities.format(value * factor, dimension)


def resized(scene, factor):
    """Changes for `factor` times as many grains, or the reason why there are none."""
    boxed = getattr(scene.boundary, "size", "fit")
    if isinstance(boxed, tuple) or isinstance(getattr(scene.boundary, "gap", "fit"), float):
        return "boundary sets the size of the domain, whose filling factor would change"
    if scene.sample.kind == "collision":
        bodies = {
            "sample.target": scene.sample.target,
            "sample.projectile": scene.sample.projectile,
        }
    else:
        bodies = {"sample": scene.sample}
    changes = {}
    for path, body in bodies.items():
        found = _body(body, factor)
        if found is None:
            return f"{path} (kind: {body.kind}) has no number of grains"
        key, value = found
        changes[f"{path}.{key}"] = value
    return changes


def _body(body, factor):
    """(key, value) of a body with `factor` times its grains; None where it has no such key."""
    if getattr(body, "grains", None) is not None:
        return "grains", max(1, round(body.grains * factor))
    size, each = getattr(body, "size", None), factor ** (1 / 3)
    if isinstance(size, tuple):
        return "size", [quantities.format(edge * each, "length") for edge in size]
    if isinstance(size, CylinderSize):
        edges = {"diameter": size.diameter, "height": size.height}
        return "size", {
            key: quantities.format(edge * each, "length") for key, edge in edges.items()
        }
    return None


def preset(scene, name):
    """Changes to a preset, without keys of the user that it sets."""
    filled = (*PRESET_KEYS, *PRESETS[name])
    return {"numerics": _numerics(scene, lambda key: key not in filled) | {"accuracy": name}}


def reference(scene):
    """Changes to the converged reference: all numerics of the preset `reference`."""
    return {
        "numerics": _numerics(scene, lambda key: key in NEUTRAL_KEYS) | {"accuracy": "reference"}
    }


def _numerics(scene, which):
    given = scene.given.get("numerics") or {}
    return {key: value for key, value in given.items() if which(key)}


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
