"""Parameters that a trade varies in scenes of the continuum: resolution, viscosity, time step."""

from dusttaichi.method.variants import NUMERICAL, PHYSICAL, Parameter, Parameters, Variant
from dusttaichi.scene import quantities

# spacing of the reference over that of the scene, by dimension: errors are of its first order, and
# half of it costs a plane 16 times as much with its step, a space 64 times
FINER = {2: 0.25, 3: 0.5}
FINEST = 0.25  # CFL number of the reference


def change_spacing(scene, factor):
    """Changes that make the spacing `factor` times as long."""
    return {"numerics.spacing": quantities.format(scene.numerics.spacing * factor, "length")}


def _change_above_reference(scene, factor):
    return change_spacing(scene, factor) if factor > FINER[scene.dimension] else {}


def _without_surfaces(scene):
    return "nothing is rigid or fixed" if scene.boundary.kind == "open" else ""


def _key(name, value_type, key, *values, obstacle=lambda scene: ""):
    return Parameter(name, value_type, f"numerics.{key}", values, obstacle)


PARAMETERS_OF_DUST = (
    Parameter("spacing", NUMERICAL, _change_above_reference, (0.5, 0.71, 1.41, 2.0)),
    _key("h_over_spacing", NUMERICAL, "h_over_spacing", 1.1, 1.2, 1.3, 1.5, 1.8),
    _key("cfl", NUMERICAL, "cfl", 0.1, 0.25, 0.5, 0.7),
    _key("viscosity_grid", NUMERICAL, "viscosity.grid", 0.0, 0.005, 0.02, 0.1),
    _key("viscosity_contact", PHYSICAL, "viscosity.contact", 0.0, 0.01, 0.1, 1.0,
         obstacle=_without_surfaces),
)  # fmt: skip


def _list_presets(scene):
    """The reference: finer, at half the CFL number of most scenes."""
    return [Variant("reference", "preset", "reference", changes=_change_to_reference(scene))]


def _coarsen_reference(scene):
    """The reference at twice its spacing.

    If the error is at least of first order in the spacing, their difference is an upper bound of
    the error of the reference.
    """
    changes = _change_to_reference(scene) | change_spacing(scene, 2.0 * FINER[scene.dimension])
    text = "twice its spacing"
    return Variant(f"reference, {text}", "reference", text, changes=changes)


def _change_to_reference(scene):
    return change_spacing(scene, FINER[scene.dimension]) | {"numerics.cfl": FINEST}


PARAMETERS = Parameters(PARAMETERS_OF_DUST, _list_presets, _coarsen_reference)
