"""Parameters that a trade varies in scenes of the continuum: resolution, viscosity, time step."""

from dusttaichi.method.trade import NUMERICAL, PHYSICAL, Parameter, Parameters, Point, levels_of
from dusttaichi.scene import quantities

SPACINGS = (0.5, 0.71, 1.41, 2.0)  # over that of the scene; only those above the reference's
SMOOTHING = (1.1, 1.2, 1.3, 1.5, 1.8)
CONTACT = (0.0, 0.01, 0.1, 1.0)
GRID = (0.0, 0.005, 0.02, 0.1)
CFL = (0.1, 0.25, 0.5, 0.7)
# spacing of the reference over that of the scene, by dimension: errors are of its first order, and
# half of it costs a plane 16 times as much with its step, a space 64 times
FINER = {2: 0.25, 3: 0.5}
FINEST = 0.25  # CFL number of the reference


def spaced(scene, factor):
    """Changes that make the spacing `factor` times as long."""
    return {"numerics.spacing": quantities.format(scene.numerics.spacing * factor, "length")}


def _spacing(scene):
    factors = [factor for factor in SPACINGS if factor > FINER[scene.dimension]]
    return [(f"{factor:g}", spaced(scene, factor)) for factor in factors]


def _contact(scene):
    found = levels_of("numerics.viscosity.contact", CONTACT)(scene)
    return found if scene.boundary.kind != "open" else "nothing is rigid or fixed"


_PARAMETERS = (
    Parameter("spacing", NUMERICAL, "spacing of particles over that of the scene", _spacing),
    Parameter(
        "h_over_spacing",
        NUMERICAL,
        "smoothing length over the spacing",
        levels_of("numerics.h_over_spacing", SMOOTHING),
    ),
    Parameter("cfl", NUMERICAL, "CFL number", levels_of("numerics.cfl", CFL)),
    Parameter(
        "viscosity_grid",
        NUMERICAL,
        "viscosity of grid noise",
        levels_of("numerics.viscosity.grid", GRID),
    ),
    Parameter("viscosity_contact", PHYSICAL, "viscosity at rigid surfaces", _contact),
)


def _presets(scene):
    """The reference: finer, at half the CFL number of most scenes."""
    return [Point("reference", "preset", "reference", changes=_reference(scene))]


def _coarser(scene):
    """The reference at twice its spacing.

    If the error is at least of first order in the spacing, their difference is an upper bound of
    the error of the reference.
    """
    changes = _reference(scene) | spaced(scene, 2.0 * FINER[scene.dimension])
    text = "twice its spacing"
    return Point(f"reference, {text}", "reference", text, changes=changes)


def _reference(scene):
    return spaced(scene, FINER[scene.dimension]) | {"numerics.cfl": FINEST}


PARAMETERS = Parameters(_PARAMETERS, _presets, _coarser)
