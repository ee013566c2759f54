"""Scenes and particles of the continuum for the tests."""

import numpy as np

from dusttaichi import method
from dusttaichi.samples.continuum.particles import Particles
from dusttaichi.scene import Scene

SPACING = 1e-4
DENSITY = 300.0


def scene(material="dust_g09", boundary=None, dimension=2, **numerics):
    """A scene of dust in two dimensions, whose sample the tests replace."""
    return Scene.from_dict(
        {
            "name": "dust",
            "method": "continuum",
            "dimension": dimension,
            "material": material,
            "sample": {"kind": "block", "size": ["1 mm", "1 mm"] + ["1 mm"] * (dimension == 3)},
            "boundary": boundary or {"kind": "open"},
            "numerics": {"spacing": f"{SPACING} m", "threads": 1, **numerics},
            "stop": {"steps": 1},
        }
    )


def rows(columns, count):
    """Places (n, 2) of a triangular lattice that repeats after `columns` spacings in x, and the
    area of a particle."""
    high = SPACING * np.sqrt(3.0) / 2.0
    i, k = np.meshgrid(np.arange(columns), np.arange(count), indexing="ij")
    x = (i + 0.25 + 0.5 * (k % 2)) * SPACING
    return np.stack([x.ravel(), (k.ravel() + 0.5) * high], axis=1), SPACING * high


def pressed(count, speed):
    """Scene and particles of so many rows of dust between rigid walls, periodic sideways, pressed
    from above at a speed [m/s]."""
    columns, high = 6, SPACING * np.sqrt(3.0) / 2.0
    x, area = rows(columns, count)
    boundary = {"kind": "faces", "bottom": "rigid", "top": "rigid", "periodic": ["x"]}
    boundary |= {"wall_speed": f"{speed} m/s"}
    room = np.array([[0.0, columns * SPACING], [np.nan, np.nan], [0.0, count * high]])
    return scene(boundary=boundary), particles(x, area, room=room)


def disc(radius):
    """Places (n, 2) of a disc about the origin, and the area of a particle."""
    side = int(2.4 * radius / SPACING) // 2 * 2
    x, area = rows(side, side)
    x = x - x[len(x) // 2 + side // 2]
    return x[np.hypot(*x.T) < radius], area


def particles(x, area, velocity=0.0, **more):
    """Particles at places (n, 2) with velocities (n, 2)."""
    n = len(x)
    position, v = np.zeros((n, 3)), np.zeros((n, 3))
    position[:, [0, 2]] = x
    v[:, [0, 2]] = velocity
    return Particles(
        position=position,
        velocity=v,
        mass=np.full(n, DENSITY * area),
        density=np.full(n, DENSITY),
        spacing=SPACING,
        dimension=2,
        **more,
    )


def moving(scene, sample):
    """The simulation of a scene with these particles."""
    return method.of(scene).build(scene, sample)


def momenta(motion):
    """Momentum (3,) and angular momentum about y of all dust."""
    sim = motion.sim
    x, v = sim.raised(sim.of_particles("x")), sim.velocities()
    m = sim.of_particles("mass")
    return m @ v, float(m @ np.cross(x, v)[:, 1])


def ledger(motion, start, scale):
    """Residual of the ledger since the Measurement `start` over an energy [fJ]."""
    m = motion.measure()
    return (m.energy - start.energy - m.work + m.lost - start.lost) / scale
