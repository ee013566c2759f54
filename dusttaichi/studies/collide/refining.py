"""Speeds added where the growth efficiency falls below 0: the threshold by bisection."""

import numpy as np

from dusttaichi.analysis.collisions import collisions_dataset
from dusttaichi.analysis.thresholds import growth_bracket
from dusttaichi.studies.collide.plan import make_study
from dusttaichi.studies.collide.runner import collide

NARROW = 1.02
"""Ratio of two speeds below which an interval is not halved any more."""


def collide_and_refine(scene, directory, *, force=False, resume=False, **how):
    """The Study of a scene with its refined speeds, and the rows of all of its collisions.

    how: as `runner.collide` takes it, which raises what this raises.
    """
    study, added = make_study(scene, directory), ()
    rows = collide(study, force=force, resume=resume, **how)
    for _ in range(scene.collisions.refine):
        speed = next_speed(collisions_dataset(rows, study.axes))
        if speed is None:
            break
        added = (*added, speed)
        study = make_study(scene, directory, added)
        rows = collide(study, resume=True, **how)
    return study, rows


def next_speed(data):
    """Speed [m/s] that halves the widest interval in which a growth efficiency falls below 0.

    It considers all bodies and mass ratios; None where none is left to halve. Three digits.
    """
    brackets = [
        growth_bracket(data, body, ratio)
        for body, ratio in np.ndindex(data.sizes["body"], data.sizes["mass_ratio"])
    ]
    brackets = [b for b in brackets if b is not None and b[1] > NARROW * b[0]]
    if not brackets:
        return None
    low, high = max(brackets, key=lambda b: b[1] / b[0])
    return float(f"{np.sqrt(low * high):.3g}")
