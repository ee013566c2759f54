"""Variables of the result of a continuum, and the names of its bodies."""

import numpy as np

from dusttaichi.continuum.continuum_variables import VARIABLES
from dusttaichi.results.variables import select_variables


def choose_variables(scene, sample, layout, domain):
    """The variables of the result of a scene with its Particles, Layout and Domain."""
    has_feature = {
        "walls": domain.box is not None,
        "height": not np.isnan(domain.lengths(0)[2]),
        "stages": bool(scene.stages),
        "bodies": len(name_bodies(sample)) > 0,
        "snapshots": True,
        "heat": layout.heat,
        "damage": layout.damage,
        "materials": layout.materials,
        "outside": bool(layout.forces),
    }
    features = {name for name, is_present in has_feature.items() if is_present}
    return select_variables(VARIABLES, features, *scene.output.variable_selection)


def name_bodies(sample):
    """Names of the bodies in the records: rigid ones, then elastic ones, all distinct."""
    rigid = [body.name for body in sample.bodies if body.rigid]
    names = (*rigid, *(body.name for body in sample.bodies if body.elastic))
    if len(set(names)) == len(names):
        return names
    return tuple(f"{name}_{k}" for k, name in enumerate(names))


def flying_bodies(sample):
    """Names of the rigid bodies by their number."""
    return dict(enumerate(body.name for body in sample.bodies if body.rigid))
