"""Parameters that `dust trade` varies in a scene of grains, their levels, and its presets."""

from dusttaichi import samples
from dusttaichi.errors import DustError
from dusttaichi.grains.contact_table import ContactTable
from dusttaichi.grains.time_step import chosen_step
from dusttaichi.method.variants import (
    NUMERICAL,
    PHYSICAL,
    SAMPLE,
    Parameter,
    Parameters,
    Variant,
    change_scene,
    list_stage_paths,
)
from dusttaichi.samples.values import CylinderSize
from dusttaichi.scene import quantities
from dusttaichi.scene.drive import SHEARS, SPEEDS
from dusttaichi.scene.numerics import DRAFT, PRESETS

FRACTIONS = (0.05, 0.1, 0.15, 0.2, 0.25, 0.28, 0.3)
# keys that a preset sets; other keys of the user in numerics stay
PRESET_KEYS = ("accuracy", "time_step")
# keys without effect on the result: the only ones that stay in the reference
NEUTRAL_KEYS = ("backend", "threads", "ledger_tolerance")


# -- changes of levels ---------------------------------------------------------------------------


def _change_step(scene, fraction):
    return {"numerics.time_step": "auto", "numerics.step_fraction": fraction}


def change_speeds(scene, factor):
    """Changes that make every wall and face move `factor` times as fast; {} where none moves.

    The times of these stages become shorter by the factor: the displacement stays the same.
    """
    changes = {}
    for path, plan in zip(list_stage_paths(scene), scene.stage_plans, strict=True):
        block = f"{path}drive" if path else "boundary"
        if not plan.drive.moves or plan.drive.controls_load:  # a load determines the speed
            continue
        for law in (*SPEEDS, *SHEARS):
            value = getattr(plan.drive, law)
            if value is not None and (value if law != "wall_speed" else value != 0.0):
                changes[f"{block}.{law}"] = _scale_law(law, value, factor)
        if plan.stop.time is not None:
            changes[f"{path}stop.time"] = quantities.format(plan.stop.time / factor, "time")
    return changes


def _scale_law(law, value, factor):
    if law == "compression_rate":
        return value * factor
    dimension = "rate" if law in ("strain_rate", "shear_rate") else "speed"
    if isinstance(value, tuple):
        return [quantities.format(v * factor, dimension) for v in value]
    return quantities.format(value * factor, dimension)


def _soften(scene, factor):
    """Changes to softer contacts; {} where the scene refuses them."""
    # a trade measures its effect, also where the scene itself would refuse it
    changes = {"numerics.scaling_anyway": True, "numerics.stiffness_scaling": factor}
    try:
        change_scene(scene, changes)
    except DustError:
        return {}
    return changes


def change_size(scene, factor):
    """Changes for `factor` times as many grains, where `explain_fixed_size` has no reason."""
    changes = {}
    for path, body in _list_bodies(scene).items():
        key, value = _scale_body(body, factor)
        changes[f"{path}.{key}"] = value
    return changes


def _list_bodies(scene):
    """Block by path of each body of the sample."""
    if scene.sample.kind != "collision":
        return {"sample": scene.sample}
    return {f"sample.{name}": getattr(scene.sample, name) for name in ("target", "projectile")}


def _scale_body(body, factor):
    """(key, value) of a body with `factor` times its grains; None where it has no such key."""
    if getattr(body, "grains", None) is not None:
        return "grains", max(1, round(body.grains * factor))
    size, stretch = getattr(body, "size", None), factor ** (1 / 3)
    if isinstance(size, tuple):
        return "size", [quantities.format(edge * stretch, "length") for edge in size]
    if isinstance(size, CylinderSize):
        edges = {"diameter": size.diameter, "height": size.height}
        return "size", {k: quantities.format(v * stretch, "length") for k, v in edges.items()}
    return None


# -- reasons against varying a parameter ---------------------------------------------------------


def _explain_still_walls(scene):
    return "" if change_speeds(scene, 1.0) else "no wall or face moves"


def explain_fixed_size(scene):
    """Reason why a scene cannot have another number of grains, or ""."""
    boxed = getattr(scene.boundary, "size", "fit")
    if isinstance(boxed, tuple) or isinstance(getattr(scene.boundary, "gap", "fit"), float):
        return "boundary sets the size of the domain, whose filling factor would change"
    for path, body in _list_bodies(scene).items():
        if _scale_body(body, 1.0) is None:
            return f"{path} (kind: {body.kind}) has no number of grains"
    return ""


def _explain_no_averages(scene):
    is_averaged = scene.has_walls or scene.output.stress
    return "" if is_averaged else "neither pressures nor stresses are averaged"


def _explain_inertia(scene):
    if not any(plan.drive.moves for plan in scene.stage_plans):
        return "only for runs with slow walls or faces, and none moves"
    if scene.push or scene.sample.flies:
        return "only for runs with slow walls or faces; inertia matters here"
    return ""


def _explain_sound(scene):
    reason = "it changes the speed of sound, at which the response to a push travels"
    return reason if scene.push else ""


def _explain_no_side_walls(scene):
    sides = {"x_min", "x_max", "y_min", "y_max"}
    has_sides = scene.boundary.kind == "box" and sides & set(scene.boundary.walls)
    return "" if has_sides else "only a box has side walls"


def _explain_undamped(scene):
    return "it is off" if scene.interaction.damping.model == "none" else ""


def _effect(name):
    """The Parameter of an effect that is left out."""
    return Parameter(
        name,
        PHYSICAL,
        f"interaction.{name}",
        ("off",),
        lambda scene: "it is off" if getattr(scene.interaction, name) is None else "",
    )


PARAMETERS_OF_GRAINS = (
    Parameter("step_fraction", NUMERICAL, _change_step, FRACTIONS),
    Parameter("precision", NUMERICAL, "numerics.precision", ("f64", "mixed", "f32")),
    Parameter("newton_steps", NUMERICAL, "numerics.newton_steps", (0, 1, 2, 3)),
    Parameter("skin", NUMERICAL, "numerics.skin", ("auto", 0.02, 0.05, 0.1, 0.2, 0.4)),
    Parameter("window", NUMERICAL, "output.window", ("interval", 10, 100, 1000),
              _explain_no_averages),
    Parameter("speed", PHYSICAL, change_speeds, (0.25, 0.5, 2.0, 4.0), _explain_still_walls),
    Parameter("mass_scaling", PHYSICAL, "numerics.mass_scaling", (1.0, 4.0, 16.0, 64.0),
              _explain_inertia),
    Parameter("stiffness_scaling", PHYSICAL, _soften, (0.3, 0.1, 0.03, 0.01, 0.003),
              _explain_sound),
    Parameter("side_walls", PHYSICAL, "boundary.side_walls", (0.0, 0.001, 0.01, 0.1, 1.0),
              _explain_no_side_walls),
    *(_effect(name) for name in ("rolling", "sliding", "twisting")),
    Parameter("damping", PHYSICAL, lambda scene, off: {"interaction.damping": "none"}, ("off",),
              _explain_undamped),
    _effect("asperities"),
    Parameter("grains", SAMPLE, change_size, (0.25, 0.5, 2.0), explain_fixed_size),
)  # fmt: skip


# -- presets and reference -----------------------------------------------------------------------


def _change_to_preset(scene, name):
    """Changes to a preset, without keys of the user that it sets."""
    preset_keys = (*PRESET_KEYS, *PRESETS[name])
    return {"numerics": _select(scene, lambda key: key not in preset_keys) | {"accuracy": name}}


def _change_to_reference(scene):
    """Changes to the converged reference: all numerics of the preset `reference`."""
    numerics = _select(scene, lambda key: key in NEUTRAL_KEYS)
    return {"numerics": numerics | {"accuracy": "reference"}}


def _select(scene, condition):
    """Keys of the user in `numerics` that fulfil a condition."""
    numerics = scene.input_data.get("numerics") or {}
    return {key: value for key, value in numerics.items() if condition(key)}


def _list_presets(scene):
    """Variants of the presets; that of `reference` is converged in all numerics."""
    changes = {name: _change_to_preset(scene, name) for name in PRESETS}
    changes["reference"] = _change_to_reference(scene)
    return [
        Variant(name, "preset", name, kind=PHYSICAL if name == DRAFT else NUMERICAL, changes=values)
        for name, values in changes.items()
    ]


def _halve_step(scene):
    """The reference at half its step, for its error."""
    changes = _change_to_reference(scene)
    fraction = change_scene(scene, changes).numerics.step_fraction
    changes |= {"numerics.step_fraction": 0.5 * fraction}
    return Variant("reference, half the step", "reference", "half its step", changes=changes)


def compute_step(scene):
    """Time step of a scene [s]."""
    sample = samples.apply_pushes(scene, samples.make(scene))
    return chosen_step(ContactTable.for_sample(scene, sample), sample).dt


def compute_step_fraction(scene):
    """Time step of a scene over its stiffest period, as `step_fraction`, None where it is that."""
    if scene.numerics.time_step == "auto":
        return None
    return (
        0.1 * scene.numerics.time_step / compute_step(change_scene(scene, _change_step(scene, 0.1)))
    )


def classify_scene(scene):
    """Kind of a scene, as in the table of `--suggest`; None where it is of none."""
    if scene.push or scene.sphere is not None:
        return None
    if scene.sample.flies:
        return "collision"
    drives = [plan.drive for plan in scene.stage_plans]
    if any(drive.shears for drive in drives):
        return "shear"
    if any(any(speed > 0 for speed in drive.face_speed or ()) for drive in drives):
        return "tension"
    pressed = any((drive.wall_speed or 0.0) > 0 or drive.pressure is not None for drive in drives)
    if pressed and scene.boundary.kind in ("box", "plates"):
        return f"compression {'in a box' if scene.boundary.kind == 'box' else 'between plates'}"
    if scene.boundary.kind == "periodic" and any(drive.moving_faces for drive in drives):
        return "compression from all sides"
    return None


PARAMETERS = Parameters(
    PARAMETERS_OF_GRAINS,
    _list_presets,
    _halve_step,
    step=compute_step,
    fraction=compute_step_fraction,
    kind=classify_scene,
)
