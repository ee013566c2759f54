"""Parameters that `dust trade` varies in a scene of grains, their levels, and its presets."""

from dusttaichi import samples
from dusttaichi.errors import DustError
from dusttaichi.grains.contact_table import ContactTable
from dusttaichi.grains.time_step import chosen_step
from dusttaichi.method.trade import (
    NUMERICAL,
    PHYSICAL,
    SAMPLE,
    Parameter,
    Parameters,
    Point,
    changed,
    levels_of,
    stage_paths,
)
from dusttaichi.samples.values import CylinderSize
from dusttaichi.scene import quantities
from dusttaichi.scene.drive import SHEARS, SPEEDS
from dusttaichi.scene.numerics import DRAFT, PRESETS

FRACTIONS = (0.05, 0.1, 0.15, 0.2, 0.25, 0.28, 0.3)
PRECISIONS = ("f64", "mixed", "f32")
NEWTON_STEPS = (0, 1, 2, 3)
SKINS = ("auto", 0.02, 0.05, 0.1, 0.2, 0.4)
FASTER = (0.25, 0.5, 1.0, 2.0, 4.0)
SIZES = (0.25, 0.5, 1.0, 2.0)
WINDOWS = ("interval", 10, 100, 1000)
MASSES = (1.0, 4.0, 16.0, 64.0)
SOFTNESS = (1.0, 0.3, 0.1, 0.03, 0.01, 0.003)
SIDES = (0.0, 0.001, 0.01, 0.1, 1.0)
# keys that a preset sets; other keys of the user in numerics stay
PRESET_KEYS = ("accuracy", "time_step")
# keys without effect on the result: the only ones that stay in the reference
NEUTRAL_KEYS = ("backend", "threads", "ledger_tolerance")


def _step_fraction(scene):
    return [
        (f"{f:g}", {"numerics.time_step": "auto", "numerics.step_fraction": f}) for f in FRACTIONS
    ]


def _speed(scene):
    if not faster(scene, 1.0):
        return "no wall or face moves"
    return [(f"{f:g}", faster(scene, f)) for f in FASTER if f != 1.0]


def _grains(scene):
    found = []
    for factor in SIZES:
        changes = resized(scene, factor)
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
        return bool(changed(scene, changes))
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


_PARAMETERS = (
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


def faster(scene, factor):
    """Changes that make every wall and face move `factor` times as fast; {} where none moves.

    The times of these stages become shorter by the factor: the displacement stays the same.
    """
    changes = {}
    for path, plan in zip(stage_paths(scene), scene.stage_plans, strict=True):
        where = f"{path}drive" if path else "boundary"
        if not plan.drive.moves or plan.drive.controls_load:  # a load determines the speed
            continue
        for law in (*SPEEDS, *SHEARS):
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
    given = scene.input_data.get("numerics") or {}
    return {key: value for key, value in given.items() if which(key)}


def _presets(scene):
    """Points of the presets; that of `reference` is converged in all numerics."""
    kinds = {DRAFT: PHYSICAL}
    changes = {name: preset(scene, name) for name in PRESETS} | {"reference": reference(scene)}
    return [
        Point(name, "preset", name, kind=kinds.get(name, NUMERICAL), changes=own)
        for name, own in changes.items()
    ]


def _half_step(scene):
    """The reference at half its step, for its error."""
    fraction = changed(scene, reference(scene)).numerics.step_fraction
    changes = reference(scene) | {"numerics.step_fraction": 0.5 * fraction}
    return Point("reference, half the step", "reference", "half its step", changes=changes)


def own_step(scene):
    """Time step of a scene [s]."""
    sample = samples.apply_pushes(scene, samples.make(scene))
    return chosen_step(ContactTable.for_sample(scene, sample), sample).dt


def own_fraction(scene):
    """Time step of a scene over its stiffest period, as `step_fraction`, None where it is that."""
    if scene.numerics.time_step == "auto":
        return None
    tenth = changed(scene, {"numerics.time_step": "auto", "numerics.step_fraction": 0.1})
    return 0.1 * scene.numerics.time_step / own_step(tenth)


def kind_of(scene):
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
    _PARAMETERS, _presets, _half_step, step=own_step, fraction=own_fraction, kind=kind_of
)
