"""Conditions on the blocks of the method `grains`: its model must be valid for the scene."""

import math

from dusttaichi.physics.contact import constants
from dusttaichi.physics.contact.effect_registry import DEFAULT, law_name, properties_of
from dusttaichi.physics.geometry import AXES
from dusttaichi.samples.values import TOO_NARROW
from dusttaichi.scene import forces, gravity, push, sphere, surfaces
from dusttaichi.scene.boundary import BoxBoundary, PeriodicBoundary, PlatesBoundary
from dusttaichi.scene.dimensions import DIMENSIONS
from dusttaichi.scene.fields import Faults

LARGEST_CONTACT = 0.25  # of the radius: grains at rest then overlap by a twentieth of it
LEAST_POISSON = 0.01
FARTHEST = 0.25  # of the radius: gap across which a softened contact may hold
DENSEST = 0.74  # filling factor of the densest packing of equal spheres


def check(scene) -> Faults:
    """Faults of the blocks that belong to the method `grains`."""
    sample = list(scene.sample.conflicts(scene))
    yield from push.check(scene)
    yield from sphere.check(scene)
    yield from gravity.check(scene)
    yield from forces.check(scene)
    yield from surfaces.check(scene)
    yield from _lost(scene)
    yield from _asperities(scene)
    yield from _properties(scene)
    yield from _contacts(scene)
    yield from _damping(scene)
    yield from _mass_scaling(scene)
    yield from _softening(scene)
    yield from ((f"sample.{path}", text) for path, text in sample)
    yield from _sizes(scene)
    yield from _box(scene)


def _lost(scene) -> Faults:
    """Losses of a contact are small differences of large sums."""
    for name, noun in (("loss", "contact"), ("grain_loss", "grain")):
        if scene.numerics.precision != "f64" and scene.output.requests(name):
            yield "output.variables", f"{name} of each {noun} needs numerics.precision: f64"


def _asperities(scene) -> Faults:
    """Asperities have a volume of their own or that of the material."""
    asperities = scene.interaction.asperities
    if asperities is None or asperities.volume is not None:
        return
    if scene.material.asperity_volume is None:
        text = (
            "it is missing, and the material has no asperity_volume; give one, for example "
            "{volume: 0.01 nm}"
        )
        yield "interaction.asperities.volume", text


def _properties(scene) -> Faults:
    """Properties that the chosen laws need, of every material."""
    for path, material in _all_materials(scene):
        for name, declared in properties_of(scene.interaction).items():
            if name not in dict(material.properties):
                example = f"{{{name}: {DIMENSIONS[declared.dimension].example}}}"
                text = f"it is missing: {declared.meaning}, for example {example}"
                yield f"{path}.properties.{name}", text


def _all_materials(scene):
    """(path, Material) of all materials."""
    return [("material", scene.material)] + [
        (f"materials.{name}", material) for name, material in scene.materials.items()
    ]


def _contacts(scene) -> Faults:
    """JKR is a law for contacts that are small compared with the grains."""
    for path, m in _all_materials(scene):
        R, E_star = constants.reduced_radius(m.radius, m.radius), constants.reduced_modulus(m)
        radius_ratio = constants.equilibrium_contact_radius(m.surface_energy, R, E_star) / m.radius
        if radius_ratio > LARGEST_CONTACT:
            text = (
                "the contact radius of two grains at rest would be "
                f"{radius_ratio:.3g} of their radius, and adhesive elastic contacts (JKR) are "
                f"valid up to {LARGEST_CONTACT}; allowed: grains that are "
                "stiffer, larger or stick less"
            )
            yield path, text


def _damping(scene) -> Faults:
    """Viscoelastic damping divides by nu^2."""
    if scene.interaction.damping.model != "viscoelastic":
        return
    for path, material in _all_materials(scene):
        if material.poisson_ratio < LEAST_POISSON:
            text = (
                f"viscoelastic damping grows as 1/nu^2; allowed with it: {LEAST_POISSON} and "
                "more, or interaction.damping: viscous, scaled or none"
            )
            yield f"{path}.poisson_ratio", text


def _depends_on(scene, reasons: dict[str, str]) -> str | None:
    """The first of the reasons, by what may be in a scene, that applies to this one."""
    sphere = scene.sphere
    present = {
        "push": scene.push or push.list_stage_pushes(scene),
        "free sphere": sphere is not None and not sphere.driven,
        "gravity": scene.gravity is not None,
        "forces": scene.forces,
        "flight": scene.sample.flies,
        "asperities": scene.interaction.asperities is not None,
        "rest": not any(plan.drive.moves for plan in scene.stage_plans)
        and not surfaces.any_moves(scene),
    }
    return next((text for name, text in reasons.items() if present[name]), None)


INERTIA = {
    "push": "the response to a push depends on the inertia of the grains",
    "free sphere": "the motion of a free sphere depends on the inertia of the grains",
    "gravity": "weights grow with the masses",
    "forces": "accelerations by forces from outside depend on the masses",
    "flight": "the outcome of a collision depends on the kinetic energy",
    "asperities": "the loss to asperities depends on the kinetic energy",
    "rest": "no wall or face moves",
}
"""Reasons against mass_scaling."""
ELASTICITY = {
    "push": "a push travels at the speed of sound",
    "free sphere": "the depth that a free sphere reaches depends on the energy of contacts",
    "flight": "whether bodies stick depends on the energy that breaks contacts",
    "asperities": "asperities act at impacts",
    "rest": "no wall or face moves, and grains vibrate, collide or stick",
}
"""Reasons against stiffness_scaling."""


def _mass_scaling(scene) -> Faults:
    """Heavier grains change everything but the forces at rest."""
    if scene.numerics.mass_scaling == 1.0:
        return
    reasons = dict(INERTIA)
    if scene.sphere is not None or not (scene.stop or scene.stages):
        del reasons["rest"]
    if reason := _depends_on(scene, reasons):
        text = (
            "it is for quasi-static runs, in which a wall or a face moves slowly; 1 is allowed here"
        )
        yield _scaling("mass_scaling", scene, f"{text}: {reason}")


def _scaling(key, scene, text):
    """A fault of a key of numerics, which the preset of a draft may have set."""
    numerics = scene.numerics
    if numerics.preset.get(key) == getattr(numerics, key):
        text = f"it sets {key}: {numerics.preset[key]:g}, and {text}"
        return "numerics.accuracy", f"{text}; fast, balanced and reference do not set it"
    return f"numerics.{key}", text


def _softening(scene) -> Faults:
    """Softer contacts press, roll and slide alike, but store more energy."""
    scale = scene.numerics.stiffness_scaling
    if scale == 1.0:
        return
    law = law_name(scene.interaction, "normal")
    texts = [text for _, m in _all_materials(scene) if (text := _too_soft(m, scale))]
    if law != DEFAULT["normal"]:
        texts = [f"it is not made for the normal law {law}; 1 is allowed here"]
    reason = None if scene.numerics.scaling_anyway else _depends_on(scene, ELASTICITY)
    if reason is not None:
        texts.append(
            f"{reason}, which changes with the stiffness of contacts; 1 is allowed here, or "
            "scaling_anyway: true beside it"
        )
    if texts:
        yield _scaling("stiffness_scaling", scene, texts[0])


def _too_soft(material, scale):
    """Reason why a Material must not be softened so much; None where it may be."""
    R = constants.reduced_radius(material.radius, material.radius)
    a0 = constants.equilibrium_contact_radius(
        material.surface_energy, R, constants.reduced_modulus(material)
    )
    rest_overlap = constants.equilibrium_overlap(a0, R)
    soft = rest_overlap * scale ** (-2.0 / 3.0)
    gap = soft - rest_overlap + constants.PULL_OFF * soft
    largest = FARTHEST * material.radius
    if gap <= largest:
        return None
    least = (rest_overlap * (1.0 + constants.PULL_OFF) / (largest + rest_overlap)) ** 1.5
    return (
        f"contacts would hold across a gap of {gap / material.radius:.3g} of the radius, more than "
        f"{FARTHEST}: grains would feel those behind their neighbours; allowed with this material: "
        f"{least:.2g} and more"
    )


def _wall_overlap(scene) -> float:
    """Overlap of a grain with a wall in equilibrium [m]."""
    return constants.wall_constants(scene.material, scene.interaction).delta0


def _sizes(scene) -> Faults:
    """A box must be wide enough for its grains."""
    boundary, diameter = scene.boundary, 2 * scene.material.radius
    sizes = {}
    if isinstance(boundary, BoxBoundary):
        edges = [] if boundary.size == "fit" else boundary.size
        sizes["boundary.size"] = [edge for edge in edges if edge != "fit"]
    if isinstance(boundary, PlatesBoundary) and boundary.gap != "fit":
        sizes["boundary.gap"] = (boundary.gap,)
    least = diameter - 2.0 * _wall_overlap(scene)
    for path, size in sizes.items():
        if min(size, default=least) < least:
            yield path, TOO_NARROW
    if isinstance(boundary, PeriodicBoundary) and not isinstance(boundary.size, str):
        for axis, edge in zip(AXES, boundary.size, strict=True):
            if axis in boundary.axes and not isinstance(edge, str) and edge < 2 * diameter:
                text = (
                    f"the edge along {axis} is shorter than four radii: a grain would touch "
                    "another twice, across both faces"
                )
                yield "boundary.size", text
                return


def _box(scene) -> Faults:
    """The sample must fit into a box whose size is given."""
    box, radius = scene.boundary, scene.material.radius
    if not isinstance(box, BoxBoundary) or box.size == "fit":
        return
    extent, grains = scene.sample.least_room(radius)
    # The extent is a sum of rounded numbers; a millionth of a millionth is far below any length.
    # With "fit" the outermost grains overlap with the walls as they do at rest.
    overlap = 2.0 * _wall_overlap(scene)
    pairs = zip(extent, box.size, strict=True)
    if any(have != "fit" and need - overlap > have * (1 + 1e-12) for need, have in pairs):
        yield "boundary.size", 'the sample does not fit into it; make it larger or write "fit"'
    elif "fit" not in box.size:
        filling = grains * 4 / 3 * math.pi * radius**3 / math.prod(box.size)
        if filling > DENSEST:
            text = (
                f"{grains} grains would fill {filling:.2f} of it, more than {DENSEST}; "
                'make it larger or write "fit"'
            )
            yield "boundary.size", text
