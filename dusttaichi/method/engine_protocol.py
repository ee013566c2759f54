"""Protocol of an engine, a scene in motion, for the run.

Numbers are in the units of the engine unless said otherwise; the run converts what it records,
by the SI units that its variables declare.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike

if TYPE_CHECKING:
    from dusttaichi.domain.domain import Domain
    from dusttaichi.results.variables import Variable
    from dusttaichi.units import Units


@dataclass(frozen=True)
class Measurement:
    """Energies of one moment, from which the ledger is made.

    Attributes
    ----------
    kinetic
        Current kinetic energy.
    potential
        Current potential energy.
    energy
        Their sum, as the method has added it up.
    kick
        Part of the kinetic energy that the integrator does not conserve.
    losses
        Losses since the start, by channel, (C,).
    lost
        Sum of the losses.
    work
        Work done on the particles since the start.
    bound
        Energy that they bind where they are at rest, no less than 0.
    parts
        Further numbers for the records and guards of the method.
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
    def from_energies(
        cls, kinetic: float, potential: float, losses: ArrayLike, **further_fields: Any
    ) -> Measurement:
        """Measurement whose `energy` and `lost` are the sums of these.

        Parameters
        ----------
        kinetic : float
        potential : float
        losses : array
            (C,).
        **further_fields
            The other fields.

        Returns
        -------
        Measurement
        """
        losses = np.asarray(losses, float)
        return cls(kinetic, potential, kinetic + potential, losses, losses.sum(), **further_fields)


@dataclass(frozen=True)
class Start:
    """Reference of the ledger: the measurement at step 0.

    `exchanged` is the largest difference of the kinetic energy of a record from that at step 0.
    """

    kinetic: float
    potential: float
    energy: float
    kick: float
    exchanged: float = 0.0

    @classmethod
    def from_measurement(cls, m: Measurement) -> Start:
        return cls(float(m.kinetic), float(m.potential), float(m.energy), float(m.kick))

    def exchanged_by(self, m: Measurement) -> float:
        """Energy that kinetic and potential energy have exchanged by the time of m."""
        return max(self.exchanged, abs(float(m.kinetic) - self.kinetic))

    def include_record(self, m: Measurement) -> Start:
        """This reference after a record of m."""
        return replace(self, exchanged=self.exchanged_by(m))


class HasMethod(Protocol):
    """Anything with the name of its method."""

    @property
    def method(self) -> str:
        """Name of the method."""


class Scene(HasMethod, Protocol):
    """All that is known of a scene here."""

    stages: Any

    def with_value(self, path: str, value: Any) -> Scene:
        """A copy with another value of the key at this path."""


class Drive(Protocol):
    """Motion of walls and faces during a stage; the Domain of the engine follows it."""


class Window(NamedTuple):
    """Sums at the ends of a span of time over which something is averaged."""

    before: dict[str, Any]
    after: dict[str, Any]
    span: float

    def mean(self, name: str) -> Any:
        """Average, over the span, of the quantity that the sum of that name adds up."""
        return (self.after[name] - self.before[name]) / self.span


class State(NamedTuple):
    """All that an engine continues from: arrays by name; numbers for JSON, `dt` among them."""

    arrays: Mapping[str, np.ndarray]
    numbers: dict[str, Any]


class ArraysOnRequest(Mapping[str, np.ndarray]):
    """Arrays by name, each made as it is read, so that not all of them take memory.

    functions: name -> function that returns the array.
    """

    def __init__(self, functions: Mapping[str, Callable[[], np.ndarray]]) -> None:
        self._functions = dict(functions)

    def __getitem__(self, name: str) -> np.ndarray:
        return self._functions[name]()

    def __iter__(self) -> Iterator[str]:
        return iter(self._functions)

    def __len__(self) -> int:
        return len(self._functions)

    def __or__(self, arrays: Mapping[str, np.ndarray]) -> ArraysOnRequest:
        """These and further arrays, which exist."""
        functions = {name: partial(_identity, values) for name, values in arrays.items()}
        return ArraysOnRequest(self._functions | functions)


def _identity(values: np.ndarray) -> np.ndarray:
    return values


class Moment(Protocol):
    """Time and step of an Engine, or of the part of it that counts its steps."""

    @property
    def units(self) -> Units: ...

    @property
    def step(self) -> int: ...

    @property
    def time(self) -> float: ...


class Engine(Protocol):
    """A built scene in motion.

    Attributes
    ----------
    units
        Those in which it counts.
    step
        Whole steps done.
    dt
        Time step.
    time
        step x dt, and the time of the run that is continued.
    size
        Number of particles or cells, to which the run time of a step is proportional.
    variables
        Variables of its result, in this scene.
    channels
        Names of the losses.
    step_key
        Key of the YAML that shortens the step.
    suspect
        Sentences on the start that explain why a guard stops the run, without a full stop; or "".
    """

    units: Units
    step: int
    dt: float
    time: float
    size: int
    domain: Domain
    variables: tuple[Variable, ...]
    channels: tuple[str, ...]
    step_key: str
    suspect: str

    def advance(self, steps: int) -> None:
        """Make whole steps.

        Raises
        ------
        GuardStop
            The state is not valid.
        """

    def drive(self, drive: Drive) -> None:
        """Move walls and faces as the drive says from this step on: a new stage."""

    def measure(self) -> Measurement:
        """The current energies."""

    def sums(self) -> dict[str, np.ndarray]:
        """Time integrals since the start; an average is a difference of two over its span."""

    def series(self, measurement: Measurement, window: Window | None) -> dict[str, Any]:
        """Variables that the method adds to a record of the time series, and what else it has.

        Parameters
        ----------
        measurement
        window
            None at step 0.

        Returns
        -------
        dict
            Name -> value.
        """

    def records(self, group: str) -> list[tuple[str, dict[str, Any]]]:
        """Records of "profiles" or "snapshots" now, and of the groups that belong to them."""

    def validate(self, measurement: Measurement) -> None:
        """Check the state with the guards of the method; those of the energy are the run's.

        These read three further attributes of an engine, if it has them: `remedies`, a tuple of
        what to try beside a shorter step where the energy is not a number; `name_invalid()`, which
        names the particles in question in brackets; and `explain_state(measurement)`, which returns
        the cause of an open ledger and advice, or "".

        Raises
        ------
        GuardStop
            The state is not valid.
        """

    def state(self) -> State:
        """State for a checkpoint, sample included."""

    def view_state(self) -> State:
        """The same, whose arrays may be made as they are read, which is before the next step."""

    def restore(self, state: State) -> None:
        """Go back to a state of the same scene, its time step included."""

    def sizes(self) -> dict[str, int | tuple[str, ...]]:
        """Dimensions of its variables: their lengths, or the names of their entries."""

    def constants(self) -> dict[str, np.ndarray]:
        """Values of the variables that do not grow, by key [SI]."""

    def attributes(self) -> dict[str, Any]:
        """Global attributes of the result."""
