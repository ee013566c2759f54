"""Ends of the sums over steps of a simulation, which its ledger needs."""

from dataclasses import dataclass, field

import numpy as np


@dataclass
class LedgerSums:
    """Ends of the sums over steps: the force of a step acts half before and half after it.

    wall_force (6, 3), face_power: at the start of the present drive and of the run. wall_work,
    impulse (6, 3): of earlier drives. sphere_force, sphere_impulse (3,), sphere_work: the same of a
    sphere that is driven. face_jumps: what changes of the drive leave over. damping: half of the
    work of step 0, which would belong to a time before it (pairs, walls, the sphere). push_work: of
    pushes that have ended. script_work: of changes by a script. surface_power: of the surfaces at
    the start. surface_jumps: what changes of their motion leave over.
    """

    wall_force: np.ndarray = field(default_factory=lambda: np.zeros((6, 3)))
    impulse: np.ndarray = field(default_factory=lambda: np.zeros((6, 3)))
    sphere_force: np.ndarray = field(default_factory=lambda: np.zeros(3))
    sphere_impulse: np.ndarray = field(default_factory=lambda: np.zeros(3))
    sphere_work: float = 0.0
    push_work: float = 0.0
    script_work: float = 0.0
    wall_work: float = 0.0
    face_power: float = 0.0
    surface_power: float = 0.0
    surface_jumps: float = 0.0
    face_jumps: float = 0.0
    pending: list = field(default_factory=lambda: [[0.0]] * 3)
