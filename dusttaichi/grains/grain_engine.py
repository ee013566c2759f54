"""The engine of grains: a built scene in motion, made of named parts. Internal units."""

from dataclasses import replace

import numpy as np

from dusttaichi import samples, units
from dusttaichi.compute.worker_choice import WorkerChoice
from dusttaichi.domain.cell import Cell
from dusttaichi.domain.moving_surfaces import SurfaceState
from dusttaichi.domain.servo import Servo
from dusttaichi.domain.walls import Box
from dusttaichi.grains import script_access
from dusttaichi.grains.advice import advice
from dusttaichi.grains.bodies import make_bodies
from dusttaichi.grains.features import choose_variables, grain_constants, profile_constants
from dusttaichi.grains.grain_environment import GrainEnvironment
from dusttaichi.grains.grain_ledger import Ledger
from dusttaichi.grains.impacts import softened_remarks
from dusttaichi.grains.kernel_sums import KernelSums
from dusttaichi.grains.ledger_sums import LedgerSums
from dusttaichi.grains.members import Members
from dusttaichi.grains.motion import Motion
from dusttaichi.grains.outside_forces import ActingForces
from dusttaichi.grains.present_contacts import Contacts
from dusttaichi.grains.record import GrainRecorder
from dusttaichi.grains.rigid_sphere import MovingSphere
from dusttaichi.grains.search_schedule import Search
from dusttaichi.grains.start import start
from dusttaichi.grains.state import GrainState
from dusttaichi.grains.stepper import Stepper
from dusttaichi.grains.time_step import short_loads
from dusttaichi.grains.validity import explain_packing, name_invalid, validate
from dusttaichi.method import EngineOfParts, State
from dusttaichi.results.plain import from_plain, plain
from dusttaichi.results.provenance import yaml_text
from dusttaichi.samples.touching import deep_overlaps
from dusttaichi.scene.material import DEFAULT
from dusttaichi.units import GRAINS

SAMPLE = ("positions", "velocities", "spins")
DIFFERING = ("radii", "materials")  # None where all grains are equal
BODIES = ("target", "projectile")
PREFIX = "sample_"  # of the names of these arrays in a State


class GrainEngine(EngineOfParts):
    """The protocol dusttaichi.method.Engine for a scene of grains.

    grain_state: GrainState. bodies: GrainBodies. environment: GrainEnvironment. push: Push.
    outside: ActingForces, or None. motion: Motion. contacts: Contacts. kernel_sums: KernelSums.
    sphere: MovingSphere, or None. search: Search. ledger: Ledger. stepper: Stepper. members:
    Members, or None. recorder: GrainRecorder. numbers: ContactNumbers. No part refers to the
    engine.
    """

    units = GRAINS

    def __init__(self, scene, prepared, compiled, tables, numbers):
        """scene: as it was read. prepared: Prepared. compiled: Compiled.

        tables: fields, scratch and sums of the Compiled as this scene uses them, by name. numbers:
        ContactNumbers.
        """
        self.scene, self.sample = scene, prepared.pushed_sample
        self.kernels, self.layout = compiled.kernels, compiled.layout
        self.contact_table, self.chosen_step = prepared.contact_table, prepared.step
        self.sample_info, self.numbers = prepared.sample.info, numbers
        self.fields, self.scratch, sum_tables = tables

        self.grain_state = GrainState(self.fields, self.layout, prepared.order)
        self.bodies = make_bodies(prepared.properties, prepared.order, prepared.domain.volume)
        self.environment = GrainEnvironment(self.grain_state, prepared.domain)
        self.push = prepared.push
        common = self.grain_state, self.bodies, self.environment
        self.outside = None
        if prepared.forces is not None:
            parts = dict(zip(("state", "bodies", "environment"), common, strict=True))
            self.outside = ActingForces(prepared.forces, self.kernels, sum_tables, **parts)
        self.motion = Motion(*common, self.push, self.outside)
        self.contacts = Contacts(*common)
        self.kernel_sums = KernelSums(self.kernels, sum_tables, *common)
        self.sphere = None
        if prepared.sphere is not None:
            parts = self.grain_state, self.environment, self.kernel_sums, self.outside
            self.sphere = MovingSphere(prepared.sphere, *parts)
        bodies_of_members = self.sample_info["members"] if self.layout.members else None
        self.search = Search(
            *(self.kernels, self.scratch, *common),
            numbers=numbers,
            sphere=self.sphere,
            members=len(bodies_of_members or [0]),
            fixed_skin=prepared.skin,
        )
        self.ledger = Ledger(self.kernel_sums, self.motion, self.sphere, numbers)
        self.stepper = Stepper(
            *(self.kernels, self.motion, self.search, self.kernel_sums, self.ledger),
            sphere=self.sphere,
            threads=prepared.threads,
        )
        self.members = None
        if bodies_of_members is not None:
            parts = self.kernels, self.kernel_sums, self.motion, self.search, self.ledger
            self.members = Members(*parts, bodies=bodies_of_members)
        self.stepper.move(scene.stage_plans[0].drive)
        start(
            *(prepared.sample, self.motion, self.contacts, self.search, self.stepper),
            ledger=self.ledger,
            sphere=self.sphere,
            members=self.members,
            numbers=numbers,
            scaling=prepared.scene.numerics.stiffness_scaling,
        )

        self.workers = WorkerChoice(self.stepper, fixed=scene.numerics.threads != "auto")
        self.variables = choose_variables(scene, self.sample, self.layout, self.domain, self.push)
        parts = self.motion, self.contacts, self.sphere, self.kernel_sums, self.ledger
        self.recorder = GrainRecorder(
            *parts, scene=scene, sample=self.sample, variables=self.variables
        )
        self.size, self.channels = self.bodies.count, self.layout.channels
        self._start_time = self.sample.info.get("start_time", 0.0) / units.TIME

    # -- the run ---------------------------------------------------------------------------------

    @property
    def time(self):
        return self._start_time + self.environment.time

    @property
    def remarks(self):
        """Sentences for the user about the start."""
        step = self.chosen_step
        impact_remarks = [] if step.impact is None else step.impact.remarks()
        softened = softened_remarks(self.scene, step.impact)
        return [*impact_remarks, *softened, *short_loads(self.scene, step.dt)]

    @property
    def suspect(self):
        """Sentence on initial contacts that push grains apart, or ""."""
        return deep_overlaps(self.sample, samples.Materials(self.scene))

    def set_forces(self, forces):
        """Set the forces of a script [N], (N, 3)."""
        script_access.set_forces(self.motion, self.ledger, forces)

    def set_velocities(self, velocities, spins):
        """Set velocities [m/s] and spins [rad/s], (N, 3) each, None to leave them."""
        script_access.set_velocities(self.motion, self.ledger, velocities, spins)

    # -- measuring -------------------------------------------------------------------------------

    def validate(self, measurement):
        validate(measurement, self, self.motion, self.contacts, self.sphere)

    def name_invalid(self):
        return name_invalid(self.motion)

    def explain_state(self, measurement):
        """Cause of an open ledger and advice, if the present state shows them, or ""."""
        return explain_packing(measurement, self.motion)

    def sums(self):
        out = {"lengths": self.environment.lengths()}
        if self.domain.box is not None:
            loads = self.kernel_sums.read_loads()
            out["impulse"] = loads.impulses()
            if self.domain.surfaces is not None:
                out["surface_impulse"] = loads.surface_impulses()
        if self.sphere is not None:
            out["sphere_impulse"] = self.sphere.impulses()
        if self.layout.stress:
            out["flux"] = self.kernel_sums.read_loads().momentum_flux()
        return out

    def series(self, measurement, window):
        return self.recorder.make_series(measurement.parts, window)

    def mean_loads(self, window):
        """Variables of `series` that a stop condition may name, sooner than all of them."""
        if self.recorder.plates is not None:  # whose pressure is over the shadow of the grains
            return self.series(self.measure(), window)
        return self.recorder.average_loads(window)

    def records(self, group):
        if group == "profiles":
            return [(group, self.recorder.make_profile(self.domain.clock(self.step), self.time))]
        return self.recorder.make_snapshot(self.scene.output.contacts, self.time)

    def forces(self):
        """Force [N] and torque [N m] of the contacts on every grain now, (N, 3) each."""
        force, torque = self.stepper.evaluate()
        return force * units.FORCE, torque * units.TORQUE

    # -- checkpoint ------------------------------------------------------------------------------

    def state(self):
        arrays, numbers = self.view_state()
        return State(dict(arrays), numbers)

    def view_state(self):
        names = (*SAMPLE, *DIFFERING)
        arrays = {PREFIX + name: getattr(self.sample, name) for name in names}
        arrays = {name: values for name, values in arrays.items() if values is not None}
        return State(self.grain_state.arrays() | arrays, self._numbers())

    def _numbers(self):
        """The plain numbers of a State."""
        domain, sphere = self.domain, self.sphere
        return {
            "step": self.step,
            "search": self.search.numbers(),
            "sphere": None if sphere is None else plain(sphere.speed),
            "push": self.push.numbers() if self.push.stage_kinds else None,
            "ledger_sums": plain(self.ledger.sums),
            "box": plain(domain.box),
            "cell": plain(domain.cell),
            "servo": plain(domain.servo),
            "surfaces": None if domain.surfaces is None else plain(domain.surfaces.state()),
            "dt": self.dt,
            "sample_info": self.sample.info,
        }

    def restore(self, state):
        arrays, numbers = state
        self.grain_state.restore(arrays)
        self.environment.step = numbers["step"]
        self.search.restore(numbers["search"])
        self.ledger.sums = from_plain(LedgerSums, numbers["ledger_sums"])
        moving = {"box": Box, "cell": Cell, "servo": Servo}
        moving = {
            name: from_plain(value_type, numbers[name]) for name, value_type in moving.items()
        }
        if self.domain.surfaces is not None:
            surface_state = from_plain(SurfaceState, numbers["surfaces"])
            moving["surfaces"] = self.domain.surfaces.with_state(surface_state)
        self.environment.place(replace(self.domain, **moving))
        if self.sphere is not None:
            self.sphere.speed = from_plain(np.ndarray, numbers["sphere"])
        if numbers["push"] is not None:
            self.push.restore(numbers["push"])

    # -- result ----------------------------------------------------------------------------------

    def sizes(self):
        sizes = {"grain": self.size, "channel": self.channels, "body": BODIES}
        sizes["spring"] = self.layout.model.potentials
        if self.domain.surfaces is not None:
            sizes["surface"] = self.domain.surfaces.names
        edges = self.recorder.edges
        return sizes if edges is None else sizes | {"bin": len(edges) - 1}

    def constants(self):
        constants = grain_constants(self.bodies, self.scene.material.radius)
        return constants | profile_constants(self.recorder.edges)

    def attributes(self):
        scene, softening = self.scene, self.contact_table.scene.numerics.stiffness_scaling
        materials = None if self.bodies.are_equal else " ".join([DEFAULT, *scene.materials])
        return {
            "seed": getattr(scene.sample, "seed", None),
            "advice": "\n".join(advice(scene, self.sample, self.chosen_step.impact)) or None,
            "backend": scene.numerics.backend,
            "precision": scene.numerics.precision,
            "threads": self.stepper.threads,
            "periodic_axes": " ".join(scene.boundary.periodic_axes),
            "materials": materials,
            "sample": yaml_text(self.sample_info),
            "grains": self.size,
            "sphere_radius": self.sphere and self.sphere.sphere.radius,
            "stiffness_scaling": None if softening == 1.0 else softening,
            "sphere_mass": self.sphere and self.sphere.sphere.mass,
        }
