"""Grains in motion as the run knows them: the Simulation with its sample, records and guards."""

import numpy as np

from dusttaichi import samples, units
from dusttaichi.compute.worker_choice import WorkerChoice
from dusttaichi.grains import measure, record, script, validity
from dusttaichi.grains.advice import advice
from dusttaichi.grains.build import build
from dusttaichi.grains.impacts import softened_remarks
from dusttaichi.grains.load_sums import load_sums
from dusttaichi.grains.time_step import short_loads
from dusttaichi.grains.variables import VARIABLES, variables_of
from dusttaichi.method import SimpleSimulation, State
from dusttaichi.physics.geometry import WALLS
from dusttaichi.results.provenance import yaml_text
from dusttaichi.results.variables import select_variables
from dusttaichi.samples.sample import Sample
from dusttaichi.samples.touching import deep_overlaps
from dusttaichi.scene.material import DEFAULT
from dusttaichi.units import GRAINS

SAMPLE = ("positions", "velocities", "spins")
OWN = ("radii", "materials")  # None where all grains are equal
BODIES = ("target", "projectile")
BEFORE = "sample_"  # of the names of these arrays in a State
TOP = WALLS.index("top")


class MovingGrains(SimpleSimulation):
    """The protocol dusttaichi.method.Simulation, for the Simulation `sim` of a scene."""

    units = GRAINS

    def __init__(self, scene, sample, sim):
        self.scene, self.sample, self.sim = scene, samples.apply_pushes(scene, sample), sim
        self.size, self.channels = sim.grains, sim.layout.channels
        self.began = self.sample.info.get("start_time", 0.0) / units.TIME
        self.plates = record.plates_of(scene.boundary, self.sample, sim.radius)
        self.workers = WorkerChoice(sim, fixed=scene.numerics.threads != "auto")
        features = features_of(scene, self.sample, sim)
        every = (*VARIABLES.values(), *variables_of(sim.layout.model))
        self.variables = select_variables(every, features, *scene.output.variable_selection)
        self.bins = None
        if "profiles" in features:
            self.bins = record.bin_edges(sim.domain.clock(), sim.radius)

    @property
    def remarks(self):
        """Sentences for the user about the start."""
        step = self.sim.chosen
        remarks = [] if step.impact is None else step.impact.remarks()
        softened = softened_remarks(self.scene, step.impact)
        return [*remarks, *softened, *short_loads(self.scene, step.dt)]

    @property
    def suspect(self):
        """Sentence on contacts of the sample that push its grains apart, or ""."""
        return deep_overlaps(self.sample, samples.Materials(self.scene))

    @property
    def step(self):
        return self.sim.step

    @property
    def dt(self):
        return self.sim.dt

    @property
    def time(self):
        return self.began + self.sim.time

    @property
    def domain(self):
        return self.sim.domain

    def advance(self, steps):
        self.workers.advance(steps)

    def drive(self, drive):
        self.sim.drive(drive)

    # -- measuring -------------------------------------------------------------------------------

    def measure(self):
        return measure.measurement(self.sim)

    def validate(self, measurement):
        validity.validate(self.sim, measurement, self)

    def sums(self):
        out = {"lengths": self.sim.lengths()}
        if self.sim.box is not None:
            out["impulse"] = load_sums(self.sim).impulses()
        if self.sim.sphere is not None:
            out["sphere_impulse"] = self.sim.sphere.impulses()
        if self.sim.layout.stress:
            out["flux"] = load_sums(self.sim).momentum_flux()
        return out

    def series(self, measurement, window):
        series_record = record.series(self.sim, measurement.parts, window, self.plates)
        first = first_body(self.scene, self.sample)
        return series_record if first is None else series_record | record.bodies(self.sim, first)

    def mean_loads(self, window):
        """Variables of `series` that a stop condition may name, sooner than all of them."""
        if self.plates is not None:  # whose pressure is that over the shadow of the grains
            return self.series(self.measure(), window)
        return record.mean_loads(self.sim, window)

    def records(self, group):
        if group == "profiles":
            clock = self.domain.clock(self.sim.step)
            return [(group, record.profile(self.sim, clock, self.bins, self.time))]
        return record.snapshot(self.sim, self.scene.output.contacts, self.time)

    def forces(self):
        """Force [N] and torque [N m] of the contacts on every grain now, (N, 3) each."""
        force, torque = self.sim.forces()
        return force * units.FORCE, torque * units.TORQUE

    def set_forces(self, forces):
        """Set the forces of a script [N], (N, 3)."""
        script.set_forces(self.sim, forces)

    def set_velocities(self, velocities, spins):
        """Set velocities [m/s] and spins [rad/s], (N, 3) each, None to leave them."""
        script.set_velocities(self.sim, velocities, spins)

    # -- state -----------------------------------------------------------------------------------

    def state(self):
        arrays = {BEFORE + name: getattr(self.sample, name) for name in (*SAMPLE, *OWN)}
        arrays = self.sim.arrays() | {k: a for k, a in arrays.items() if a is not None}
        numbers = {"dt": self.sim.dt, "sample_info": self.sample.info}
        return State(arrays, self.sim.numbers() | numbers)

    def restore(self, state):
        self.sim.restore(*state)

    # -- result ----------------------------------------------------------------------------------

    def sizes(self):
        out = {"grain": self.sim.grains, "channel": self.channels, "body": BODIES}
        out["spring"] = self.sim.layout.model.potentials
        return out if self.bins is None else out | {"bin": len(self.bins) - 1}

    def constants(self):
        bodies = self.sim.polydisperse
        out = {"snapshots/radius": np.full(self.sim.grains, self.scene.material.radius)}
        if bodies is not None:
            out = {
                "snapshots/radius": bodies.radius,
                "snapshots/mass": bodies.mass,
                "snapshots/material": bodies.material,
            }
        if self.bins is not None:
            edges = self.bins * units.LENGTH
            out |= {
                "profiles/bin_lower": edges[:-1],
                "profiles/bin_upper": edges[1:],
                "profiles/bin_height": 0.5 * (edges[1:] + edges[:-1]),
            }
        return out

    def attributes(self):
        scene, sim = self.scene, self.sim
        polydisperse = sim.polydisperse is not None
        return {
            "seed": getattr(scene.sample, "seed", None),
            "advice": "\n".join(advice(scene, self.sample)) or None,
            "backend": scene.numerics.backend,
            "precision": scene.numerics.precision,
            "threads": sim.threads,
            "periodic_axes": " ".join(scene.boundary.periodic_axes),
            "materials": " ".join([DEFAULT, *scene.materials]) if polydisperse else None,
            "sample": yaml_text(sim.sample_info),
            "grains": sim.grains,
            "sphere_radius": sim.sphere and sim.sphere.own.radius,
            "stiffness_scaling": None if sim.stiffness == 1.0 else sim.stiffness,
            "sphere_mass": sim.sphere and sim.sphere.own.mass,
        }


def make(scene, sample, step=None):
    """MovingGrains of a scene and a Sample, at step 0; step: as for `build`."""
    out = MovingGrains(scene, sample, build(scene, sample, step=step))
    out.domain.check_start()
    return out


def reopen(scene, state):
    """MovingGrains in a State of grains of that scene."""
    values = {name: state.arrays.get(BEFORE + name) for name in OWN}
    arrays = (state.arrays[BEFORE + name] for name in SAMPLE)
    out = make(scene, Sample(*arrays, info=state.numbers["sample_info"], **values))
    out.restore(state)
    return out


def first_body(scene, sample):
    """Number of grains of the first of two bodies that fly at each other in open space, or None."""
    if not scene.sample.flies or scene.boundary.kind != "open":
        return None
    return sample.info.get("target_grains", 1 if len(sample) == 2 else None)


def features_of(scene, sample, sim):
    """Names of the variables in the result of a scene (grains/variables.py)."""
    domain, bounded = sim.domain, sim.domain.bounded
    requested = {
        "snapshots": True,
        "polydisperse": sim.polydisperse is not None,
        "contacts": scene.output.contacts,
        "forces": scene.output.forces,
        "open": not domain.there,
        "walls": sim.box is not None,
        "cell": sim.cell is not None,
        "height": not np.isnan(domain.lengths(sim.step)[2]),
        "plates": scene.boundary.kind == "plates",
        "room": domain.there,
        "filling": bounded or scene.boundary.kind == "plates",
        "stress": sim.layout.stress,
        "push": sim.push.works,
        "gravity": scene.gravity is not None,
        "outside": bool(scene.forces),
        "pair": first_body(scene, sample) is not None,
        "sphere": sim.sphere is not None,
        "stages": bool(scene.stages),
        "shear": any(plan.drive.shears for plan in scene.stage_plans),
        "tilt": sim.layout.tilted,
        "profiles": bounded and any(plan.profiles is not None for plan in scene.stage_plans),
    }
    return {name for name, is_requested in requested.items() if is_requested}
