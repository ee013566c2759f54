"""Variables and attributes of the result of a scene of grains."""

import numpy as np

from dusttaichi import units
from dusttaichi.grains.grain_variables import VARIABLES, variables_of
from dusttaichi.results.variables import select_variables


def choose_variables(scene, sample, layout, domain, push):
    """The Variables in the result of a scene with a Sample; domain: the Domain at the start."""
    features = list_features(scene, sample, layout, domain, push)
    variables = (*VARIABLES.values(), *variables_of(layout.model))
    return select_variables(variables, features, *scene.output.variable_selection)


def list_features(scene, sample, layout, domain, push):
    """Names of the features that variables of the result need (grains/grain_variables.py)."""
    bounded, stages = domain.bounded, scene.stage_plans
    features = {
        "snapshots": True,
        "polydisperse": layout.polydisperse,
        "contacts": scene.output.contacts,
        "forces": scene.output.forces,
        "open": not domain.there,
        "walls": domain.box is not None,
        "tube": domain.is_round,
        "surfaces": domain.surfaces is not None,
        "cell": domain.cell is not None,
        "height": not np.isnan(domain.lengths(0)[2]),
        "plates": scene.boundary.kind == "plates",
        "room": domain.there,
        "filling": bounded or scene.boundary.kind == "plates",
        "stress": layout.stress,
        "push": push.works,
        "gravity": scene.gravity is not None,
        "outside": bool(scene.forces),
        "pair": count_first_body(scene, sample) is not None,
        "sphere": layout.sphere,
        "stages": bool(scene.stages),
        "shear": any(plan.drive.shears for plan in stages),
        "tilt": layout.tilted,
        "profiles": has_profiles(scene, domain),
    }
    return {name for name, is_present in features.items() if is_present}


def has_profiles(scene, domain):
    """True where the result has profiles: in a finite Domain, if a stage records them."""
    return domain.bounded and any(plan.profiles is not None for plan in scene.stage_plans)


def count_first_body(scene, sample):
    """Number of grains of the first of two bodies that collide in open space, or None."""
    if not scene.sample.flies or scene.boundary.kind != "open":
        return None
    return sample.info.get("target_grains", 1 if len(sample) == 2 else None)


def grain_constants(bodies, radius):
    """Values of the constant variables of grains, by key [SI].

    bodies: GrainBodies. radius [m]: of equal grains.
    """
    properties = bodies.properties
    if properties is None:
        return {"snapshots/radius": np.full(bodies.count, radius)}
    return {
        "snapshots/radius": properties.radius,
        "snapshots/mass": properties.mass,
        "snapshots/material": properties.material,
    }


def profile_constants(edges):
    """Lower and upper ends and heights of the bins of profiles [m], by key; edges [um] or None."""
    if edges is None:
        return {}
    ends = edges * units.LENGTH
    return {
        "profiles/bin_lower": ends[:-1],
        "profiles/bin_upper": ends[1:],
        "profiles/bin_height": 0.5 * (ends[1:] + ends[:-1]),
    }
