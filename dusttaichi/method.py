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

if TYPE_CHECKING:
    import numpy as np

    from dusttaichi.domain.domain import Domain
    from dusttaichi.results.variables import Variable
    from dusttaichi.scene.boundary import Drive
    from dusttaichi.scene.scene import Scene

DEFAULT = "grains"
GROUP = "dusttaichi.methods"  # entry points of other packages that bring a method along


@dataclass(frozen=True)
class Measurement:
    """Energies of one moment [fJ], from which the ledger is made.

    kinetic, potential: energies of now; energy: their sum, as the method has added it up.
    kick: part of the kinetic energy that the integrator does not keep (0 where it keeps all).
    losses: what has been lost since the start, by channel (C,); lost: their sum.
    work: what has been done on the particles from outside since the start. bound: energy that they
    bind where they are at rest, no less than 0. parts: further numbers and arrays, which the
    method's own records and guards know.
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


class Window(NamedTuple):
    """Sums at the ends of a span [us] over which something is averaged."""

    before: dict
    after: dict
    span: float


class State(NamedTuple):
    """All that a simulation goes on from: arrays by name, and numbers that JSON can hold.

    The numbers hold `dt`, the time step.
    """

    arrays: dict
    numbers: dict


class Simulation(Protocol):
    """A built scene in motion. `time` is step x dt [us]; size: what a step costs is proportional to
    it, the number of particles or cells.

    variables: those of its result, chosen for this scene. channels: names of the losses.
    """

    step: int
    dt: float
    time: float
    size: int
    domain: Domain
    variables: tuple[Variable, ...]
    channels: tuple[str, ...]

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


@dataclass(frozen=True)
class Method:
    """A method: `scene`, the pydantic class of its scene, and how a Simulation is made of one.

    make_sample(scene): what it starts from. build(scene, sample): the Simulation at step 0.
    reopen(scene, state): a Simulation in a State of a simulation of that scene. variables: all that
    its results may hold. code(scene): source files outside of this package that decide the numbers
    of a scene.
    """

    name: str
    scene: type[Scene]
    make_sample: Callable
    build: Callable
    reopen: Callable
    variables: tuple[Variable, ...]
    code: Callable[[Scene], list[Path]] = lambda scene: []


# name -> "module:attribute" of a Method, imported when a scene asks for it
BUILT_IN = {"grains": "dusttaichi.grains.method:METHOD"}
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
    return [*METHODS, *(p.name for p in _brought_along() if p.name not in METHODS)]


def named(name: str) -> Method:
    """The Method of that name. Raises KeyError where there is none."""
    known = METHODS.get(name)
    if known is None:
        found = [point for point in _brought_along() if point.name == name]
        if not found:
            raise KeyError(name)
        known = found[0].load()
    elif isinstance(known, str):
        module, attribute = known.split(":")
        known = getattr(importlib.import_module(module), attribute)
    METHODS[name] = known
    return known


def of(scene: Scene) -> Method:
    """The Method of a scene."""
    return named(scene.method)


def make_sample(scene: Scene) -> Any:
    """What a scene starts from; of grains a Sample, all in SI. Raises DustError."""
    return of(scene).make_sample(scene)


def _brought_along():
    return metadata.entry_points(group=GROUP)
