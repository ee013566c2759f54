"""What the run knows of a method: how it is built, moved, measured and restored; no more.

A method computes the motion of something: grains, or a continuum. Its scene is a class of its own,
its simulation has the members of `Simulation`, and a `Method` names both. The run loop, the result
file, checkpoints, stages and the error bar know nothing else of it. Numbers are in internal units
(dusttaichi.units) unless said otherwise.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

import numpy as np

from dusttaichi import units

if TYPE_CHECKING:
    from dusttaichi.domain.domain import Domain
    from dusttaichi.results.variables import Variable
    from dusttaichi.scene.drive import Drive

DEFAULT = "grains"
GROUP = "dusttaichi.methods"  # entry points of other packages that bring a method along


@dataclass(frozen=True)
class Measurement:
    """Energies of one moment [fJ], from which the ledger is made.

    kinetic, potential: energies of now; energy: their sum, as the method has added it up.
    kick: part of the kinetic energy that the integrator does not keep (0 where it keeps all).
    losses: what has been lost since the start, by channel (C,); lost: their sum.
    work: what has been done on the particles from outside since the start. bound: energy that they
    bind where they are at rest, no less than 0. parts: what the method's records and guards know.
    """

    kinetic: float
    potential: float
    energy: float
    losses: np.ndarray
    lost: float
    work: float = 0.0
    kick: float = 0.0
    bound: float = 0.0
    parts: dict[str, Any] = field(default_factory=dict)

    @classmethod
    def of(cls, kinetic, potential, losses, **others) -> Measurement:
        """The Measurement whose energy and lost are the sums of these; others: the other fields."""
        losses = np.asarray(losses, float)
        return cls(kinetic, potential, kinetic + potential, losses, losses.sum(), **others)


@dataclass(frozen=True)
class Start:
    """What the ledger keeps of the measurement at step 0 [fJ]."""

    kinetic: float
    potential: float
    energy: float
    kick: float

    @classmethod
    def of(cls, m: Measurement) -> Start:
        return cls(float(m.kinetic), float(m.potential), float(m.energy), float(m.kick))

    def to_numbers(self) -> dict[str, float]:
        return asdict(self)


class Scene(Protocol):
    """All that is known of a scene here."""

    method: str


class Window(NamedTuple):
    """Sums at the ends of a span [us] over which something is averaged."""

    before: dict
    after: dict
    span: float

    def mean(self, name: str) -> Any:
        """The average of what the sum of that name adds up, over the span."""
        return (self.after[name] - self.before[name]) / self.span


class State(NamedTuple):
    """All that a simulation continues from: arrays by name; numbers for JSON, `dt` among them."""

    arrays: dict
    numbers: dict


class Simulation(Protocol):
    """A built scene in motion. `time` is step x dt [us]; size: what a step costs is proportional to
    it, the number of particles or cells. variables: of its result, in this scene. channels: names
    of the losses; step_key: of the YAML, shortens the step. began [us]: of the run continued."""

    step: int
    dt: float
    time: float
    began: float
    size: int
    domain: Domain
    variables: tuple[Variable, ...]
    channels: tuple[str, ...]
    step_key: str

    def advance(self, steps: int) -> None:
        """Make whole steps. Raises GuardStop where it cannot."""

    def drive(self, drive: Drive) -> None:
        """Move walls and faces as the drive says from this step on: a new stage."""

    def measure(self) -> Measurement:
        """The energies of now."""

    def sums(self) -> dict[str, np.ndarray]:
        """Time integrals since the start; an average is a difference of two over its span."""

    def series(self, measurement: Measurement, window: Window | None) -> dict:
        """What it adds to a record of the time series [SI]; window None at step 0."""

    def records(self, group: str) -> list[tuple[str, dict]]:
        """Records [SI] of "profiles" or "snapshots" now, and of the groups that belong to them."""

    def trust(self, measurement: Measurement) -> None:
        """Its own guards. Raises GuardStop; the guard of the ledger is the run's."""

    def state(self) -> State:
        """What a checkpoint keeps, sample included."""

    def restore(self, state: State) -> None:
        """Go back to a state of the same simulation, its time step included."""

    def sizes(self) -> dict[str, int | tuple[str, ...]]:
        """Dimensions of its variables: their lengths, or the names of their entries."""

    def constants(self) -> dict[str, np.ndarray]:
        """Values of the variables that do not grow, by key [SI]."""

    def attributes(self) -> dict:
        """What the result says of it in global attributes."""


class Refinable(Simulation, Protocol):
    """A simulation that can go on at half its step: what the error bar needs."""

    def halve_step(self) -> None:
        """Go on at half the time step from the very same state, steps counted accordingly."""

    def positions(self) -> np.ndarray:
        """Where the particles are [um], (n, 3), in an order that stays."""

    def ends(self) -> dict[str, np.ndarray]:
        """The sums of now, and what else `compared` asks of the ends of a stretch."""

    def compared(self, window: Window, moments: list[Measurement]) -> dict[str, float]:
        """Numbers of a stretch that two steps are compared by [SI], beside the energies.

        window: `ends` at its two ends; moments: measurements evenly spaced over it.
        """


class SimpleSimulation:
    """What most simulations do alike: a method inherits it and says only what is its own.

    A method has to say `dt`, `variables`, `advance` and `measure`, and `kept`: the names of its
    attributes that it goes on from beside `step` and `dt`, arrays or numbers. Nothing surrounds it,
    it has one particle, and loses, averages and refuses nothing, where it says nothing else. With
    `halve_step` and `positions` it is Refinable.
    """

    step: int = 0
    dt: float
    size: int = 1
    variables: tuple[Variable, ...]
    channels: tuple[str, ...] = ()
    step_key: str = "numerics.time_step"
    kept: tuple[str, ...] = ()
    began: float = 0.0

    @property
    def time(self) -> float:
        return self.step * self.dt

    @property
    def domain(self) -> Domain:
        from dusttaichi.domain.domain import Domain  # which knows the scene, as this module may not

        return Domain(self.dt)

    def drive(self, drive: Drive) -> None:
        """There are no walls and faces that could move."""

    def sums(self) -> dict[str, np.ndarray]:
        return {}

    def series(self, measurement: Measurement, window: Window | None) -> dict:
        return {}

    def snapshot(self) -> dict:
        """The variables of "snapshots" now [SI], beside its time and step."""
        return {}

    def records(self, group: str) -> list[tuple[str, dict]]:
        if group != "snapshots":
            return []
        now = {"snapshot_time": (self.began + self.time) * units.TIME, "step": self.step}
        return [(group, now | self.snapshot())]

    def trust(self, measurement: Measurement) -> None:
        """The guard of the ledger, which is the run's, is enough."""

    def state(self) -> State:
        values = {name: getattr(self, name) for name in ("step", "dt", *self.kept)}
        arrays = {n: v.copy() for n, v in values.items() if isinstance(v, np.ndarray)}
        return State(arrays, {n: v for n, v in values.items() if n not in arrays})

    def restore(self, state: State) -> None:
        for name, value in (state.numbers | state.arrays).items():
            setattr(self, name, value.copy() if name in state.arrays else value)

    def sizes(self) -> dict[str, int | tuple[str, ...]]:
        return {"channel": self.channels}

    def constants(self) -> dict[str, np.ndarray]:
        return {}

    def attributes(self) -> dict:
        return {}

    def ends(self) -> dict[str, np.ndarray]:
        return self.sums()

    def compared(self, window: Window, moments: list[Measurement]) -> dict[str, float]:
        return {}


def built_anew(scene: Scene, state: State) -> Simulation:
    """A Simulation in a State of a simulation of that scene: built from the scene's own sample.

    How a Method reopens whose samples take no time to make.
    """
    simulation = of(scene).build(scene, make_sample(scene))
    simulation.restore(state)
    return simulation


@dataclass(frozen=True)
class Preview:
    """What is known of a scene before it is built; `dust check` prints it.

    sections: (title, rows of (what, value)). size: number of particles. dt: time step [us].
    plan: (name of the stage, steps at most, what ends it) of every stage, steps NEVER where only
    what is measured ends it.
    """

    sections: list[tuple[str, list[tuple[str, str]]]]
    size: int
    dt: float
    plan: list[tuple[str, int, str]]


@dataclass(frozen=True, kw_only=True)
class Method:
    """A method: `scene`, the pydantic class of its scene, and how a Simulation is made of one.

    make_sample(scene): what it starts from. build(scene, sample): the Simulation at step 0.
    variables: all that its results may hold. reopen(scene, state): a Simulation in a State of a
    simulation of that scene. code(scene): source files outside of this package that decide the
    numbers of a scene. preview(scene): a Preview, made quickly and without compiling.
    internals(scene), forces(scene): more sections, of the scene built; what acts at its start.
    parts(scene): words for what takes time in a step; scenes of the same words are as fast.
    """

    name: str
    scene: type[Scene]
    make_sample: Callable
    build: Callable
    variables: tuple[Variable, ...]
    reopen: Callable = built_anew
    code: Callable[[Scene], list[Path]] = lambda scene: []
    preview: Callable[[Scene], Preview] | None = None
    internals: Callable[[Scene], list] = lambda scene: []
    forces: Callable[[Scene], list] = lambda scene: []
    parts: Callable[[Scene], tuple[str, ...]] = lambda scene: ()


# name -> "module:attribute" of a Method, imported when a scene asks for it
BUILT_IN = {
    "grains": "dusttaichi.grains.method:METHOD",
    "continuum": "dusttaichi.continuum.method:METHOD",
}
METHODS: dict[str, str | Method] = dict(BUILT_IN)


def register(method: Method) -> None:
    """Make a method known by its name to this process.

    A file that does so becomes known to every process that reads a scene with the file among its
    `extensions`; a package, to all processes, by an entry point of the group "dusttaichi.methods".
    Raises ValueError for the name of a method of this package.
    """
    if method.name in BUILT_IN:
        raise ValueError(f"{method.name} is a method of this package; another name is needed")
    METHODS[method.name] = method


def names() -> list[str]:
    """Names of all methods there are."""
    return [
        *METHODS,
        *(p.name for p in metadata.entry_points(group=GROUP) if p.name not in METHODS),
    ]


def named(name: str) -> Method:
    """The Method of that name. Raises KeyError where there is none."""
    known = METHODS.get(name)
    if known is None:
        brought = {point.name: point for point in metadata.entry_points(group=GROUP)}
        known = brought[name].load()
    elif isinstance(known, str):
        module, attribute = known.split(":")
        known = getattr(importlib.import_module(module), attribute)
    METHODS[name] = known
    return known


def of(scene: Scene) -> Method:
    """The Method of a scene."""
    return named(scene.method)


def moment(simulation: Simulation) -> str:
    """Where a run stands, as the guards say it."""
    return f"At {simulation.time:.6g} us (step {simulation.step})"


def make_sample(scene: Scene) -> Any:
    """What a scene starts from; of grains a Sample, all in SI. Raises DustError."""
    return of(scene).make_sample(scene)
