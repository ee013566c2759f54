"""Points of a trade: parameters that it varies, the changed scenes, and results of their runs."""

from collections.abc import Callable
from dataclasses import dataclass, field

from dusttaichi.analysis.observables import Measured
from dusttaichi.errors import DustError
from dusttaichi.method import attribute, of

NUMERICAL, PHYSICAL, SAMPLE = "numerical", "physical", "sample"
KINDS = (NUMERICAL, PHYSICAL, SAMPLE)
"""Kinds of change: numerical solution or averages; equations or driving; the sample."""


@dataclass(frozen=True)
class Point:
    """One scene to run. changes: of the base scene, see `scenes.changed`.

    again: run it although an equal scene has run.
    """

    label: str
    parameter: str
    text: str
    value: float
    kind: str
    changes: dict = field(default_factory=dict)
    again: bool = False


@dataclass(frozen=True)
class PointResult:
    """Result of the run of a point.

    code: 0, that of a DustError (2: refused, 3: stopped by a guard), or 1: the process was lost.
    status: end of the run, or the reason of the failure. cost [s]: core-seconds of the time steps,
    or None. ratio: of the cost to that of the default, or None.
    """

    code: int
    status: str
    cost: float | None = None
    ratio: float | None = None
    steps: int | None = None
    time_step: float | None = None
    ledger: float | None = None
    measured: Measured = field(default_factory=lambda: Measured({}))

    @property
    def ok(self):
        """True where the run ended regularly."""
        return self.code == 0


@dataclass(frozen=True)
class Parameter:
    """Parameter that can be varied.

    levels: from the base scene to rows (text, changes), or to the reason why there are none.
    """

    name: str
    kind: str
    text: str
    levels: Callable


def levels_of(path, values):
    """Levels of a Parameter that is a key of the YAML: these values, whatever the scene is."""
    rows = [(f"{v:g}" if isinstance(v, float) else str(v), {path: v}) for v in values]
    return lambda scene: rows


@dataclass(frozen=True)
class Parameters:
    """Parameters of a Method for `dust trade`, as its `trade_parameters`.

    presets(scene): further Points, with the converged reference. check(scene): the Point that gives
    the error of the reference. step(scene): time step [s] of a scene, which makes a time of a
    number of steps; None where no scene sets it. kind(scene): kind of scene for `--suggest`.
    """

    parameters: tuple[Parameter, ...]
    presets: Callable
    check: Callable
    step: Callable | None = None
    kind: Callable = lambda scene: None


def parameters_of(scene):
    """The Parameters of the method of a scene. Raises DustError where it has none."""
    found = attribute(of(scene).trade_parameters)
    if found is None:
        raise DustError(f"method: {scene.method} has no parameters for dust trade")
    return found
