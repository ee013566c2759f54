"""The start of a continuum: particles and bodies into their fields, stresses and forces."""

import numpy as np

from dusttaichi.continuum import dust_time_step
from dusttaichi.continuum.dust_placement import faces_of
from dusttaichi.continuum.kernels.separation import CLOSED
from dusttaichi.continuum.kernels.store import COLUMN, DT, FACES, LEFT, WANT
from dusttaichi.continuum.kernels.tensor_rows import write_rows
from dusttaichi.continuum.physics.elasticity import bulk_modulus
from dusttaichi.continuum.samples.flaws import flaws_of
from dusttaichi.errors import DustError
from dusttaichi.results.roles import DUST, ELASTIC, RIGID


def start(scene, sample, motion, search, stepper, *, environment, scratch):
    """Put the Particles of a scene into the fields of a DustMotion, at step 0.

    search: DustSearch. stepper: DustStepper. environment: Environment, which gets the output step.
    scratch: memory.Table of the lists, by name.
    """
    state = motion.state
    for name in ("sync", "most"):
        scratch[name].fill(0)
    if state.layout.materials:
        scratch["materials"].from_numpy(np.stack(state.materials.values(), axis=1))
        state["material"] = sample.material.astype(np.int32)
    put_particles(sample, state, put_bodies(scene, sample, state))
    if state.layout.damage:
        state["flaws"] = flaws_of(sample, scene.all_materials)
    if motion.outside is not None:
        motion.outside.place(scene, sample)
    search.update()
    stepper.load_particles()
    fastest = float(scratch["most"].to_numpy().max())
    environment.dt = dust_time_step.output_step(scene, fastest)
    state["clock"] = first_clock(scene, fastest, environment.dt)


def put_bodies(scene, sample, state):
    """Put faces and rigid bodies into fields; returns their rows of `rigid`."""
    moving = [body for body in sample.bodies if body.rigid]
    mirrors = faces_of(scene.boundary, "mirrors")
    rows = np.zeros((FACES + len(moving), COLUMN.count))
    rows[:FACES, COLUMN.turn] = 1.0
    planes = sample.room.ravel()
    for face in np.flatnonzero(np.isfinite(planes)):
        rows[face, COLUMN.centre + face // 2] = planes[face]
        rows[face, COLUMN.layer] = np.any(sample.face == face)
    rows[:, COLUMN["freedom"]] = 1.0
    for k, body in enumerate(moving):
        rows[FACES + k] = body_row(body, cut_by_mirrors(body, sample, mirrors))
    state["rigid"] = rows
    return rows


def put_particles(sample, state, rows):
    """Put particles into fields; rows: of the faces and rigid bodies.

    Raises DustError where all of them are rigid or fixed.
    """
    axes, count = state.axes, len(sample)
    role = sample.role.astype(np.int32)
    rank = np.cumsum([body.rigid for body in sample.bodies]) - 1
    group = sample.face.astype(np.int32)
    rigid = role == RIGID
    group[rigid] = FACES + rank[sample.body[rigid]]
    group[role == DUST] = -1
    elastic = role == ELASTIC
    moves = elastic | (role == DUST)
    deviator = write_rows(sample.deviator, state.dimension)
    deviator[rigid] = 0.0
    state["deviator"] = deviator
    del deviator  # large samples: one array at a time
    arm = np.zeros((count, state.dimension))
    centre = rows[:, COLUMN["centre"]][group[rigid]]
    arm[rigid] = (sample.position[rigid] - centre)[:, axes]
    state["arm"] = arm
    state["x"], state["v"] = sample.position[:, axes], sample.velocity[:, axes]
    for name in ("mass", "density", "reference"):
        state[name] = getattr(sample, name)
    state["volume"] = np.where(moves, sample.mass / sample.density, 0.0)
    _put_moduli(sample, state, elastic)
    state["group"], state["role"] = group, role
    state["number"] = np.arange(count, dtype=np.int32)
    if "side" in state:
        state["side"] = np.where(elastic, 2 + sample.body, np.where(rigid, 1, 0))
    if state.layout.separate:
        state["gap"] = np.full(count, CLOSED)
    if not moves.any():
        raise DustError(
            "sample: all particles are rigid or fixed; dust or an elastic body is needed"
        )


def _put_moduli(sample, state, elastic):
    """Put moduli into fields; elastic: True of the particles of elastic bodies."""
    dust = state.material
    if state.layout.materials:
        dust = state.materials.take(sample.material)
    of_dust = bulk_modulus(sample.reference, dust)
    state["modulus"] = np.where(elastic, sample.modulus, of_dust)
    state["shear_ratio"] = np.where(elastic, sample.shear_ratio, dust.mu_over_K)


def cut_by_mirrors(body, sample, mirrors):
    """Axes of the mirrors that go through the centre of a rigid body: of it a half is there."""
    planes, near = sample.room.ravel(), 1e-3 * sample.spacing
    return [k // 2 for k in mirrors if abs(body.centre[k // 2] - planes[k]) < near]


def body_row(body, mirrors=()):
    """The row of `rigid` of a body at the start (samples.continuum.particles.Body) [SI].

    mirrors: axes of the mirrors through its centre. Each leaves half of its mass, no force across
    the mirror, and no torque but the one about its normal.
    """
    out, mirror_fraction = np.zeros(COLUMN.count), 0.5 ** len(mirrors)
    forces, torques = np.ones(3), np.ones(3)
    for axis in mirrors:
        forces[axis] = 0.0
        torques *= np.arange(3) == axis
    values = {
        "centre": body.centre,
        "speed": body.velocity,
        "turn": [1.0, 0.0, 0.0, 0.0],
        "spin": body.spin,
        "momentum": mirror_fraction * body.inertia @ body.spin,
        "mass": mirror_fraction * body.mass,
        "inertia": np.linalg.pinv(mirror_fraction * body.inertia).ravel(),
        "radius": body.radius,
        "half_height": body.half_height,
        "freedom": [*forces, *torques],
    }
    for name, value in values.items():
        out[COLUMN[name]] = value
    return out


def first_clock(scene, fastest, output_step):
    """The `clock` of step 0; fastest: the initial speeds of signals [m/s]."""
    step = scene.numerics.cfl * scene.numerics.smoothing_length / fastest
    clock = np.zeros(8)
    clock[LEFT], clock[WANT] = output_step, step
    clock[DT] = output_step / np.ceil(output_step / step * (1.0 - 1e-12))
    return clock
