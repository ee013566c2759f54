"""A continuum as the run uses it: the Simulation with its sample, records and guards."""

from dataclasses import replace

import numpy as np

from dusttaichi.compute.worker_choice import WorkerChoice
from dusttaichi.continuum import measure, record, validity
from dusttaichi.continuum.advice import advice
from dusttaichi.continuum.build import build, domain_of
from dusttaichi.continuum.continuum_variables import VARIABLES
from dusttaichi.continuum.kernels.store import CHANNELS
from dusttaichi.continuum.pairing import Pairing
from dusttaichi.continuum.samples.particle_arrays import ARRAYS, COMPONENTS, Body, Particles
from dusttaichi.domain.walls import Box
from dusttaichi.method import SimpleSimulation, State
from dusttaichi.physics.geometry import AXES, WALLS
from dusttaichi.results.plain import from_plain, plain
from dusttaichi.results.provenance import yaml_text
from dusttaichi.results.variables import select_variables

BEFORE = "sample_"  # of the names of the arrays of the sample in a State


class MovingDust(SimpleSimulation):
    """The protocol dusttaichi.method.Simulation for the Simulation `sim` of a scene."""

    channels, step_key, storing = CHANNELS, "numerics.cfl", ("artificial",)
    binds = False  # no energy of bonds with which kinetic energy could be compared

    def __init__(self, scene, sample, sim):
        self.scene, self.sample, self.sim = scene, sample, sim
        self.size, self.dt = sim.n, sim.output_step
        self.workers = WorkerChoice(sim, fixed=scene.numerics.threads != "auto")
        self.around = domain_of(scene, sample, self.dt)
        self.variables = select_variables(
            VARIABLES, self._features(), *scene.output.variable_selection
        )
        start = measure.energies(sim)
        self.started, self.forces_started = start["loss"], start["forces"]
        self.channels = (*CHANNELS, *sim.layout.forces.channels)
        self._pairing = Pairing(sim, sample)
        self._warms = measure.Warming(scene, sample, sim) if sim.layout.heat else None
        # walls whose force is summed: over particles of a layer, or contacts of a rigid face
        self._pressed = {WALLS[face] for face in np.unique(sample.face) if face >= 0}
        self._pressed |= set(getattr(scene.boundary, "rigid", ()))
        rigid = [body for body in sample.bodies if body.rigid]
        self._flying = {b: body.name for b, body in enumerate(rigid)}
        self.drive(scene.stage_plans[0].drive)

    def _features(self):
        domain = self.around
        has_feature = {
            "walls": domain.box is not None,
            "height": not np.isnan(domain.lengths(0)[2]),
            "stages": bool(self.scene.stages),
            "bodies": len(self._shown()) > 0,
            "snapshots": True,
            "heat": self.sim.layout.heat,
            "damage": self.sim.layout.damage,
            "materials": self.sim.layout.materials,
            "outside": bool(self.sim.layout.forces),
        }
        return {name for name, is_present in has_feature.items() if is_present}

    @property
    def step(self):
        return self.sim.step

    @property
    def domain(self):
        return self.around

    def advance(self, steps):
        self.workers.advance(steps)

    def drive(self, drive):
        self.around = self.around.driven(drive, self.step)
        speeds = np.zeros((6, 3))
        speeds[5, 2] = -self.around.wall_speed
        self.sim.move_faces(speeds)

    # -- measuring -------------------------------------------------------------------------------

    def measure(self):
        return measure.measurement(self.sim, self.started, self.forces_started)

    def validate(self, measurement):
        validity.validate(self.sim, measurement)
        validity.check_inside(self.sim, self.around.box, self._flying)

    def sums(self):
        # the force on an elastic body is the change of its momentum
        momenta = measure.elastic_momenta(self.sim, self.sample)
        return {"impulse": np.concatenate([self.sim.impulses(), momenta])}

    def series(self, measurement, window):
        self._pairing.check()
        elastic = measure.elastic_bodies(self.sim, self.sample)
        series_record = record.series(self.sim, measurement.parts, window, self._areas(), elastic)
        return series_record | (self._warms.series() if self._warms else {})

    def _shown(self):
        """Names of the bodies in the records: rigid ones, then elastic ones."""
        bodies = self.sample.bodies
        rigid = [body.name for body in bodies if body.rigid]
        return _distinct((*rigid, *(body.name for body in bodies if body.elastic)))

    def _areas(self):
        """Areas of the walls whose force is known [m^2], (6,).

        0 of the others: open faces, and mirrors, whose force is not summed.
        """
        areas = np.zeros(6)
        if self.around.box is not None:
            areas = self.around.wall_areas(self.step)
            areas[[wall not in self._pressed for wall in WALLS]] = 0.0
        return areas

    def snapshot(self):
        return record.snapshot(self.sim) | (self._warms.snapshot() if self._warms else {})

    # -- state -----------------------------------------------------------------------------------

    def state(self):
        sample = self.sample
        arrays = {BEFORE + name: getattr(sample, name) for name in (*ARRAYS, "body", "room")}
        numbers = {
            "dt": self.dt,
            "step": self.step,
            "started": self.started.tolist(),
            "looked": self._pairing.looked,
            "box": plain(self.around.box),
            "sample": {
                "spacing": sample.spacing,
                "dimension": sample.dimension,
                "bodies": plain(sample.bodies),
                "info": sample.info,
            },
        }
        return State(arrays | self.sim.arrays(), numbers)

    def restore(self, state):
        self.sim.restore(state.arrays, state.numbers["step"])
        self.started = np.array(state.numbers["started"])
        self._pairing.looked = state.numbers["looked"]
        self.around = replace(self.around, box=from_plain(Box, state.numbers["box"]))

    # -- result ----------------------------------------------------------------------------------

    def sizes(self):
        rigid = self._shown()
        sizes = {"particle": self.sim.n, "channel": self.channels, "component": COMPONENTS}
        return sizes | ({"rigid": rigid} if rigid else {})

    def constants(self):
        names = ("mass", "role", "body")
        out = {f"snapshots/{name}": getattr(self.sample, name) for name in names}
        if self.sim.layout.materials:
            solid = self.sim.materials.rho_s[self.sample.material]
            out |= {"snapshots/material": self.sample.material, "snapshots/solid_density": solid}
        return out

    def attributes(self):
        scene = self.scene
        return {
            "seed": getattr(scene.sample, "seed", None),
            "advice": "\n".join(advice(scene, self.sample)) or None,
            "threads": self.sim.threads,
            "dimension": scene.dimension,
            "gravity": 0.0 - self.sim.numbers["gravity"][-1],  # along -z; without any 0, not -0
            "solid_density": self.sim.material.rho_s,
            "spacing": scene.numerics.spacing,
            "smoothing_length": scene.numerics.smoothing_length,
            "particles": self.sim.n,
            "periodic_axes": " ".join(a for a in AXES if a in scene.boundary.periodic_axes),
            "sample": yaml_text(self.sample.info),
        }


def make(scene, sample):
    """MovingDust of a scene and its Particles, at step 0."""
    return MovingDust(scene, sample, build(scene, sample))


def reopen(scene, state):
    """MovingDust in a State of a continuum of that scene."""
    stored = state.numbers["sample"]
    bodies = tuple(from_plain(Body, body) for body in stored["bodies"])
    arrays = {name: state.arrays[BEFORE + name] for name in (*ARRAYS, "body", "room")}
    further = {name: stored[name] for name in ("spacing", "dimension", "info")}
    out = make(scene, Particles(**arrays, **further, bodies=bodies))
    out.restore(state)
    return out


def _distinct(names):
    """The names, numbered where they are not distinct."""
    if len(set(names)) == len(names):
        return names
    return tuple(f"{name}_{k}" for k, name in enumerate(names))
