"""Blocks of the method `grains`: its model must mean something for what the scene asks."""

import math

from dusttaichi.names import AXES
from dusttaichi.physics.contact import constants
from dusttaichi.physics.contact.registry import DEFAULT, law_name, properties_of
from dusttaichi.samples.values import TOO_NARROW
from dusttaichi.scene import gravity, push, sphere
from dusttaichi.scene.boundary import BoxBoundary, PeriodicBoundary, PlatesBoundary
from dusttaichi.scene.quantities import DIMENSIONS

Found = list[tuple[str, str]]
LARGEST_CONTACT = 0.25  # of the radius: grains at rest then overlap by a twentieth of it
LEAST_POISSON = 0.01
FARTHEST = 0.25  # of the radius: gap across which a softened contact may hold
DENSEST = 0.74  # filling factor of the densest packing of equal spheres


def check(scene) -> Found:
    """Every problem of the blocks that belong to the method `grains`, as (dotted path, text)."""
    sample = [(f"sample.{path}", text) for path, text in scene.sample.conflicts(scene)]
    found = [*push.check(scene), *sphere.check(scene), *gravity.check(scene)]
    found += [
        *_lost(scene),
        *_asperities(scene),
        *_properties(scene),
        *_contacts(scene),
        *_damping(scene),
    ]
    return [
        *found,
        *_mass_scaling(scene),
        *_softening(scene),
        *sample,
        *_sizes(scene),
        *_room(scene),
    ]


def _lost(scene) -> Found:
    """Losses of a contact are small differences of large sums."""
    if scene.numerics.precision == "f64":
        return []
    asked = (("loss", "contact"), ("grain_loss", "grain"))
    return [
        ("output.variables", f"{name} of each {what} needs numerics.precision: f64")
        for name, what in asked
        if scene.output.asks_for(name)
    ]


def _asperities(scene) -> Found:
    """Asperities have a volume of their own or that of the material."""
    asperities = scene.interaction.asperities
    if asperities is None or asperities.volume is not None:
        return []
    if scene.material.asperity_volume is not None:
        return []
    return [
        (
            "interaction.asperities.volume",
            "it is missing, and the material has no "
            "asperity_volume; give one, for example {volume: 0.01 nm}",
        )
    ]


def _properties(scene):
    """Properties that the chosen laws need, of every material."""
    return [
        (
            f"{path}.properties.{name}",
            f"it is missing: {declared.meaning}, for example {{{name}: "
            f"{DIMENSIONS[declared.dimension].example}}}",
        )
        for path, material in _all_materials(scene)
        for name, declared in properties_of(scene.interaction).items()
        if name not in dict(material.properties)
    ]


def _all_materials(scene):
    """(path, Material) of all materials."""
    return [("material", scene.material)] + [
        (f"materials.{name}", material) for name, material in scene.materials.items()
    ]


def _contacts(scene) -> Found:
    """JKR is a law for contacts that are small against the grains."""
    found = []
    for path, m in _all_materials(scene):
        R, E_star = constants.reduced_radius(m.radius, m.radius), constants.reduced_modulus(m)
        share = constants.equilibrium_contact_radius(m.surface_energy, R, E_star) / m.radius
        if share > LARGEST_CONTACT:
            text = (
                f"the contact of two grains at rest would have {share:.3g} of their radius, and "
                f"adhesive elastic contacts (JKR) mean nothing beyond {LARGEST_CONTACT}; allowed: "
                "grains that are stiffer, larger or stick less"
            )
            found.append((path, text))
    return found


def _damping(scene) -> Found:
    """Viscoelastic damping divides by nu^2."""
    if scene.interaction.damping.model != "viscoelastic":
        return []
    text = (
        f"viscoelastic damping grows as 1/nu^2; allowed with it: {LEAST_POISSON} and more, or "
        "interaction.damping: viscous, scaled or none"
    )
    return [
        (f"{path}.poisson_ratio", text)
        for path, material in _all_materials(scene)
        if material.poisson_ratio < LEAST_POISSON
    ]


def _mass_scaling(scene) -> Found:
    """Heavier grains leave forces at rest as they are, and nothing else."""
    if scene.numerics.mass_scaling == 1.0:
        return []
    driven = (
        any(plan.drive.moves for plan in scene.stage_plans) if scene.stop or scene.stages else True
    ) or scene.sphere is not None
    why = None
    if scene.push or push.of_stages(scene):
        why = "a push is answered by the inertia of the grains"
    elif scene.sphere is not None and not scene.sphere.driven:
        why = "a free sphere is answered by the inertia of the grains"
    elif scene.gravity is not None:
        why = "weights grow with the masses"
    elif scene.sample.flies:
        why = "a collision is a matter of kinetic energy"
    elif scene.interaction.asperities is not None:
        why = "asperities take kinetic energy"
    elif not driven:
        why = "no wall or face moves"
    text = "it is for quasi-static runs, in which a wall or a face moves slowly; 1 is allowed here"
    return [_scaling("mass_scaling", scene, f"{text}: {why}")] if why else []


def _scaling(key, scene, text):
    """A problem of a key of numerics, which the preset of a draft may have set."""
    numerics = scene.numerics
    if numerics.preset.get(key) == getattr(numerics, key):
        text = f"it sets {key}: {numerics.preset[key]:g}, and {text}"
        return "numerics.accuracy", f"{text}; fast, balanced and reference leave that alone"
    return f"numerics.{key}", text


def _softening(scene) -> Found:
    """Softer contacts press, roll and slide alike, but store more energy."""
    scale, own = min(scene.stiffnesses), _stiffness_of_stages(scene)
    if scale == 1.0 or own:
        return own
    law = law_name(scene.interaction, "normal")
    texts = [text for _, m in _all_materials(scene) if (text := _too_soft(m, scale))]
    if law != DEFAULT["normal"]:
        texts = [f"it is not made for the normal law {law}; 1 is allowed here"]
    why = None if scene.numerics.scaling_anyway else _elastic(scene)
    if why is not None:
        texts.append(
            f"{why}, which goes with the stiffness of contacts; 1 is allowed here, or "
            "scaling_anyway: true beside it"
        )
    return [_scaling("stiffness_scaling", scene, text) for text in texts[:1]]


def _stiffness_of_stages(scene):
    """Problems of stages with a stiffness of their own."""
    if scene.stages and (own := scene.stages[0].drive.stiffness_scaling) is not None:
        text = f"the first stage has that of numerics; give numerics.stiffness_scaling: {own:g}"
        return [("stages.0.drive.stiffness_scaling", text)]
    if not scene.restiffens:
        return []
    with_it = {
        "a push": bool(scene.push or push.of_stages(scene)),
        "a free sphere": scene.sphere is not None and not scene.sphere.driven,
        "asperities": scene.interaction.asperities is not None,
    }
    number = next(n for n, s in enumerate(scene.stiffnesses) if s != scene.stiffnesses[0])
    return [
        (f"stages.{number}.drive.stiffness_scaling", f"it may not change in a scene with {what}")
        for what, there in with_it.items()
        if there
    ]


def _too_soft(material, scale):
    """Problem of a Material softened so much; None where there is none."""
    R = constants.reduced_radius(material.radius, material.radius)
    a0 = constants.equilibrium_contact_radius(
        material.surface_energy, R, constants.reduced_modulus(material)
    )
    own = constants.equilibrium_overlap(a0, R)
    soft = own * scale ** (-2.0 / 3.0)
    gap = soft - own + constants.PULL_OFF * soft
    most = FARTHEST * material.radius
    if gap <= most:
        return None
    least = (own * (1.0 + constants.PULL_OFF) / (most + own)) ** 1.5
    return (
        f"contacts would hold across a gap of {gap / material.radius:.3g} of the radius, more than "
        f"{FARTHEST}: grains would feel those behind their neighbours; allowed with this material: "
        f"{least:.2g} and more"
    )


def _elastic(scene):
    """Reason why a scene depends on the stiffness of contacts; None where it does not."""
    if scene.push or push.of_stages(scene):
        return "a push is answered at the speed of sound"
    if scene.sphere is not None and not scene.sphere.driven:
        return "how far a free sphere gets is decided by the energy of contacts"
    if scene.sample.flies:
        return "whether bodies stick is decided by the energy that breaks contacts"
    if scene.interaction.asperities is not None:
        return "asperities act at impacts"
    if not any(plan.drive.moves for plan in scene.stage_plans):
        return "no wall or face moves, and grains vibrate, collide or stick"
    return None


def _lengths(boundary) -> list[float]:
    """The lengths [m] that a size gives, without those that are to fit."""
    size = boundary.size
    return [] if isinstance(size, str) else [edge for edge in size if not isinstance(edge, str)]


def _wall_overlap(scene) -> float:
    """Overlap of a grain at rest with a wall [m]."""
    return constants.wall_constants(scene.material, scene.interaction).delta0


def _sizes(scene) -> Found:
    """A room must be wide enough for its grains."""
    diameter = 2 * scene.material.radius
    sizes = {}
    if isinstance(scene.boundary, BoxBoundary):
        sizes["boundary.size"] = _lengths(scene.boundary)
    if isinstance(scene.boundary, PlatesBoundary) and scene.boundary.gap != "fit":
        sizes["boundary.gap"] = (scene.boundary.gap,)
    least = diameter - 2.0 * _wall_overlap(scene)
    found = [(path, TOO_NARROW) for path, size in sizes.items() if min(size, default=least) < least]
    cell = scene.boundary
    if isinstance(cell, PeriodicBoundary) and not isinstance(cell.size, str):
        short = [
            axis
            for axis, edge in zip(AXES, cell.size, strict=True)
            if axis in cell.axes and not isinstance(edge, str) and edge < 2 * diameter
        ]
        if short:
            found.append(
                (
                    "boundary.size",
                    f"the edge along {short[0]} is shorter than four radii: "
                    "a grain would touch another twice, across both faces",
                )
            )
    return found


def _room(scene) -> Found:
    """The sample must fit into a box whose size is given."""
    box, radius = scene.boundary, scene.material.radius
    if not isinstance(box, BoxBoundary) or box.size == "fit":
        return []
    extent, grains = scene.sample.least_room(radius)
    # The extent is a sum of rounded numbers; a millionth of a millionth is far below any length.
    # With "fit" the outermost grains overlap with the walls as they do at rest.
    overlap = 2.0 * _wall_overlap(scene)
    pairs = zip(extent, box.size, strict=True)
    if any(have != "fit" and need - overlap > have * (1 + 1e-12) for need, have in pairs):
        return [("boundary.size", 'the sample does not fit into it; make it larger or write "fit"')]
    if "fit" in box.size:
        return []
    filling = grains * 4 / 3 * math.pi * radius**3 / math.prod(box.size)
    if filling <= DENSEST:
        return []
    text = (
        f"{grains} grains would fill {filling:.2f} of it, more than {DENSEST}; "
        'make it larger or write "fit"'
    )
    return [("boundary.size", text)]
