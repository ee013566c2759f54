"""Scenes and particles of the continuum for the tests."""

import numpy as np

from dusttaichi import method
from dusttaichi.continuum.samples.particle_arrays import Particles
from dusttaichi.scene import Scene

SPACING = 1e-4
ROW = SPACING * np.sqrt(3.0) / 2.0  # height of a row of a triangular lattice
DENSITY = 300.0
K, MU = 3e5, 1.5e5  # of dust_g09 at its own density
WALLS = {"kind": "faces", "bottom": "rigid", "top": "rigid", "periodic": ["x"]}


def scene(material="dust_g09", boundary=None, dimension=2, sample=None, **numerics):
    """A scene of dust; without a sample it has a block, which the tests replace."""
    size = ["1 mm", "1 mm"] + ["1 mm"] * (dimension == 3)
    return Scene.from_dict(
        {
            "name": "dust",
            "method": "continuum",
            "dimension": dimension,
            "material": material,
            "sample": sample or {"kind": "block", "size": size},
            "boundary": boundary or {"kind": "open"},
            "numerics": {"spacing": f"{SPACING} m", "threads": 1, **numerics},
            "stop": {"steps": 1},
        }
    )


def rows(columns, count):
    """Places (n, 2) of a triangular lattice that repeats after `columns` spacings in x, and the
    area of a particle."""
    i, k = np.meshgrid(np.arange(columns), np.arange(count), indexing="ij")
    x = (i + 0.25 + 0.5 * (k % 2)) * SPACING
    return np.stack([x.ravel(), (k.ravel() + 0.5) * ROW], axis=1), SPACING * ROW


def column(columns, count, velocity=0.0, boundary=WALLS, material="dust_g09", **numerics):
    """Scene and particles of so many rows of dust between faces, in a room as wide as they are;
    velocity: (n, 2), or a function of the places."""
    x, area = rows(columns, count)
    top = np.nan if boundary.get("top", "open") == "open" else count * ROW
    room = np.array([[0.0, columns * SPACING], [np.nan, np.nan], [0.0, top]])
    v = velocity(x) if callable(velocity) else velocity
    return scene(material, boundary, **numerics), particles(x, area, v, room=room)


def press_column(count, speed):
    """A column of six spacings between rigid walls, pressed from above at a speed [m/s]."""
    return column(6, count, boundary=WALLS | {"wall_speed": f"{speed} m/s"})


def mirror_column(count, _speed):
    """Scene and particles of so many rows between a rigid floor and mirrors on both sides."""
    x, area = rows(6, count)
    boundary = {"kind": "faces", "bottom": "rigid", "x_min": "mirror", "x_max": "mirror"}
    room = np.array([[0.0, 6 * SPACING], [np.nan, np.nan], [0.0, np.nan]])
    return scene(boundary=boundary), particles(x, area, room=room)


def disc(radius):
    """Places (n, 2) of a disc about the origin, and the area of a particle."""
    side = int(2.4 * radius / SPACING) // 2 * 2
    x, area = rows(side, side)
    x = x - x[len(x) // 2 + side // 2]
    return x[np.hypot(*x.T) < radius], area


def particles(x, area, velocity=0.0, **options):
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
        **options,
    )


def moving(scene, sample=None):
    """The simulation of a scene, with these particles or its own."""
    own = method.make_sample(scene) if sample is None else sample
    return method.find_method(scene).build(scene, own)


def period(engine, mode, until, every=1):
    """Period [s] of a mode, a function of the simulation: twice the time between two zeros.

    until [s]; it is looked at every so many steps, and between two looks it is a line.
    """
    times, values = [], []
    while engine.step * engine.dt < until:
        engine.advance(every)
        times.append(engine.step * engine.dt)
        values.append(mode(engine))
    values = np.array(values)
    at = np.flatnonzero(np.sign(values[1:]) != np.sign(values[:-1]))[:2]
    zeros = [
        times[n] + (times[n + 1] - times[n]) * values[n] / (values[n] - values[n + 1]) for n in at
    ]
    return 2.0 * (zeros[1] - zeros[0])


def stir_particles(engine):
    """Particles in a random order, near where they were, some beyond the periodic faces."""
    rng = np.random.default_rng(5)
    order = rng.permutation(engine.size)
    engine.dust_state.reorder(order)
    x = engine.dust_state.of_particles("x")
    x += rng.uniform(-0.2, 0.2, x.shape) * SPACING
    for axis, low, high in engine.search.surfaces.edges:
        x[:, axis] += 0.4 * (high - low)
    engine.dust_state["x"] = x


def momenta(engine):
    """Momentum (3,) and angular momentum about y of all dust."""
    state, v = engine.dust_state, engine.motion.velocities()
    x, m = state.raise_to_space(state.of_particles("x")), state.of_particles("mass")
    return m @ v, float(m @ np.cross(x, v)[:, 1])


def ledger(engine, start, scale):
    """Residual of the ledger since the Measurement `start` over an energy [J]."""
    m = engine.measure()
    return (m.energy - start.energy - m.work + m.lost - start.lost) / scale
