"""How fast the bodies of a scene can meet at first: what its time step must resolve."""

from dataclasses import dataclass

import numpy as np

from dusttaichi.physics.contact import constants

LOOSE = 1.0  # contacts a grain, below which hardly any energy is bound at the start
FEW = 13  # grains below which one collision is most of what happens


@dataclass(frozen=True)
class Motion:
    """Largest relative speed of two grains and of a grain and a wall [m/s], and spin [rad/s].

    alone: one collision is most of what happens: few grains, or hardly any that touch.
    """

    grains: float
    walls: float
    spin: float
    alone: bool


def fastest(scene, sample, radii, scenes=None):
    """Motion of a scene with a sample (already pushed). radii [m]: one number, or (N,).

    scenes: of a batch, the number of the scene of each grain. Bounds, not estimates: velocities by
    their range along each axis; a wall throws grains at twice its speed, a face moves their images
    by that of the cell's edge; a spinning surface may turn all of its speed into flight. What
    forces from outside will do is not known beforehand.
    """
    v, number = sample.velocities, np.zeros(len(sample), int) if scenes is None else scenes
    apart = max(
        (float(np.linalg.norm(np.ptp(v[number == k], axis=0))) for k in np.unique(number)),
        default=0.0,
    )
    surface = float(np.max(np.linalg.norm(sample.spins, axis=1) * radii, initial=0.0))
    spin = float(np.max(np.linalg.norm(sample.spins, axis=1), initial=0.0))
    wall = max(abs(plan.drive.wall_speed or 0.0) for plan in scene.stage_plans)
    face = max(_face_speed(scene, plan.drive, sample, radii) for plan in scene.stage_plans)
    own = float(np.max(np.linalg.norm(v, axis=1), initial=0.0))
    grains = len(sample) if scenes is None else int(np.bincount(scenes).max())
    loose = sample.info.get("coordination", 2.0 * LOOSE) < LOOSE
    meet = apart + surface + face + (2.0 * wall if scene.boundary.walls else 0.0)
    return Motion(meet, own + surface + wall, spin, grains < FEW or loose)


def _face_speed(scene, drive, sample, radii):
    """Largest speed of an image against the cell [m/s]."""
    axes = ["xyz".index(axis) for axis in scene.boundary.periodic_axes]
    if not axes or not drive.moving_faces:
        return 0.0
    if drive.face_speed is not None:
        return float(np.linalg.norm(2.0 * np.array(drive.face_speed)[axes]))
    size = getattr(scene.boundary, "size", "fit")
    edges = np.ptp(sample.positions, axis=0) + 2.0 * np.max(radii)
    edges = edges if isinstance(size, str) else np.array(size)
    if drive.strain_rate is not None:
        return float(np.linalg.norm((np.array(drive.strain_rate) * edges)[axes]))
    rate = 2.0 * drive.compression_rate / constants.characteristic_time(scene.material)
    return float(np.linalg.norm(rate * edges[axes]))
