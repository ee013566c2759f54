"""The engine of a continuum: a built scene in motion, made of named parts. SI inside."""

from dataclasses import replace

import numpy as np

from dusttaichi.compute.worker_choice import WorkerChoice
from dusttaichi.continuum.device_sums import DeviceSums
from dusttaichi.continuum.dust_advice import advice
from dusttaichi.continuum.dust_features import choose_variables, flying_bodies, name_bodies
from dusttaichi.continuum.dust_forces import DustForces
from dusttaichi.continuum.dust_heat import DeviceDustHeat, DustHeat
from dusttaichi.continuum.dust_ledger import DustLedger
from dusttaichi.continuum.dust_motion import DustMotion
from dusttaichi.continuum.dust_placement import pressed_walls
from dusttaichi.continuum.dust_record import DustRecorder
from dusttaichi.continuum.dust_start import start
from dusttaichi.continuum.dust_state import DustState
from dusttaichi.continuum.dust_stepper import DustStepper
from dusttaichi.continuum.dust_validity import check_inside, validate
from dusttaichi.continuum.elastic_bodies import DeviceElasticBodies, ElasticBodies
from dusttaichi.continuum.kernel_numbers import KernelNumbers
from dusttaichi.continuum.kernels.store import CHANNELS
from dusttaichi.continuum.pairing import Pairing
from dusttaichi.continuum.particle_search import DustSearch
from dusttaichi.continuum.samples.particle_arrays import ARRAYS, COMPONENTS
from dusttaichi.continuum.self_gravity import SelfGravity
from dusttaichi.domain.environment import Environment
from dusttaichi.domain.walls import Box
from dusttaichi.method import EngineOfParts, State
from dusttaichi.physics.geometry import AXES
from dusttaichi.results.plain import from_plain, plain
from dusttaichi.results.provenance import yaml_text

PREFIX = "sample_"  # of the names of the arrays of the sample in a State


class DustEngine(EngineOfParts):
    """The protocol dusttaichi.method.Engine for a scene of a continuum.

    dust_state: DustState. environment: Environment. numbers: KernelNumbers. outside: DustForces, or
    None. motion: DustMotion. search: DustSearch. ledger: DustLedger. stepper: DustStepper. pairing:
    Pairing. recorder: DustRecorder. No part has the engine. Its step is an output step, which the
    method divides into time steps.
    """

    step_key, storing = "numerics.cfl", ("artificial",)
    remedies = ("a larger numerics.viscosity.grid", "a lower speed")
    binds = False  # no energy of bonds with which kinetic energy could be compared

    def __init__(self, scene, prepared, compiled, tables):
        """scene: as it was read. prepared: Prepared. compiled: Compiled.

        tables: fields and lists of the Compiled as this scene uses them, by name.
        """
        self.scene, self.sample = scene, prepared.sample
        self.kernels, self.layout = compiled.kernels, compiled.layout
        self.fields, self.scratch = tables

        self.dust_state = DustState(
            *(self.fields, self.layout),
            count=len(self.sample),
            bodies=prepared.bodies,
            materials=prepared.materials,
        )
        self.environment = Environment(prepared.domain)
        self.numbers = KernelNumbers(
            *(self.kernels.StepNumbers, prepared.numbers, self.environment, self.dust_state)
        )
        evaluated = self.kernels, self.scratch, self.dust_state, self.numbers
        self.outside = DustForces(*evaluated) if self.layout.forces else None
        device_sums = DeviceSums(*evaluated) if self.kernels.sums else None
        self.motion = DustMotion(self.dust_state, self.outside, device_sums)
        self.search = DustSearch(
            *(self.kernels.search, self.scratch, self.dust_state, self.environment),
            h=scene.numerics.smoothing_length,
            surfaces=prepared.surfaces,
            threads=prepared.threads,
        )
        self_gravity = SelfGravity(*evaluated) if self.layout.self_gravity else None
        self.ledger = DustLedger(self.motion, self_gravity, prepared.numbers["gravity"])
        self.stepper = DustStepper(
            *(self.kernels, self.scratch, self.environment, self.search),
            numbers=self.numbers,
            threads=prepared.threads,
        )
        start(
            *(scene, self.sample, self.motion, self.search, self.stepper),
            environment=self.environment,
            scratch=self.scratch,
        )
        self.ledger.begin()
        self.stepper.drive(scene.stage_plans[0].drive)

        self.workers = WorkerChoice(self.stepper, fixed=scene.numerics.threads != "auto")
        self.variables = choose_variables(scene, self.sample, self.layout, self.domain)
        self.pairing = Pairing(self.dust_state, self.environment, self.sample, prepared.threads)
        self.recorder = self._make_recorder()
        self.size, self.channels = len(self.sample), (*CHANNELS, *self.layout.forces.channels)

    def _make_recorder(self):
        scene, sample, heat = self.scene, self.sample, None
        on_device = self.motion.device_sums is not None
        if self.layout.heat:
            arguments = self.dust_state, scene.all_materials, sample
            heat = DeviceDustHeat(*arguments, self.scratch) if on_device else DustHeat(*arguments)
        elastic_bodies = (DeviceElasticBodies if on_device else ElasticBodies)(self.motion, sample)
        arguments = self.motion, self.environment, elastic_bodies, heat
        return DustRecorder(*arguments, pressed=pressed_walls(scene, sample))

    # -- measuring -------------------------------------------------------------------------------

    def validate(self, measurement):
        validate(measurement, self.environment)
        check_inside(self.dust_state, self.environment, flying_bodies(self.sample))

    def sums(self):
        return self.recorder.sums()

    def series(self, measurement, window):
        self.pairing.check()
        return self.recorder.make_series(measurement.parts, window)

    def snapshot(self):
        return self.recorder.make_snapshot()

    # -- checkpoint ------------------------------------------------------------------------------

    def state(self):
        arrays, numbers = self.view_state()
        return State(dict(arrays), numbers)

    def view_state(self):
        sample = self.sample
        arrays = {PREFIX + name: getattr(sample, name) for name in (*ARRAYS, "body", "room")}
        numbers = {
            "dt": self.dt,
            "step": self.step,
            "started": self.ledger.loss_at_start.tolist(),
            "looked": self.pairing.looked,
            "box": plain(self.domain.box),
            "sample": {
                "spacing": sample.spacing,
                "dimension": sample.dimension,
                "bodies": plain(sample.bodies),
                "info": sample.info,
            },
        }
        return State(self.dust_state.arrays() | arrays, numbers)

    def restore(self, state):
        arrays, numbers = state
        self.dust_state.restore(arrays)
        self.environment.step = numbers["step"]
        self.search.again()
        self.ledger.loss_at_start = np.array(numbers["started"])
        self.pairing.looked = numbers["looked"]
        box = from_plain(Box, numbers["box"])
        self.environment.domain = replace(self.domain, box=box)

    # -- result ----------------------------------------------------------------------------------

    def sizes(self):
        bodies = name_bodies(self.sample)
        sizes = {"particle": self.size, "channel": self.channels, "component": COMPONENTS}
        return sizes | ({"rigid": bodies} if bodies else {})

    def constants(self):
        names = ("mass", "role", "body")
        out = {f"snapshots/{name}": getattr(self.sample, name) for name in names}
        if self.layout.materials:
            solid = self.dust_state.materials.rho_s[self.sample.material]
            out |= {"snapshots/material": self.sample.material, "snapshots/solid_density": solid}
        return out

    def attributes(self):
        scene = self.scene
        return {
            "seed": getattr(scene.sample, "seed", None),
            "advice": "\n".join(advice(scene, self.sample)) or None,
            "threads": self.stepper.threads,
            "dimension": scene.dimension,
            "gravity": 0.0 - self.numbers.values["gravity"][-1],  # along -z; without any 0, not -0
            "solid_density": self.dust_state.material.rho_s,
            "spacing": scene.numerics.spacing,
            "smoothing_length": scene.numerics.smoothing_length,
            "particles": self.size,
            "periodic_axes": " ".join(a for a in AXES if a in scene.boundary.periodic_axes),
            "sample": yaml_text(self.sample.info),
        }
