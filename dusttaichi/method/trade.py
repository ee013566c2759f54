"""Changes of the scenes of a method whose cost and error `dust trade` measures."""

from collections.abc import Callable
from dataclasses import dataclass, field

NUMERICAL, PHYSICAL, SAMPLE = "numerical", "physical", "sample"
KINDS = (NUMERICAL, PHYSICAL, SAMPLE)
"""Kinds of change: numerical solution or averages; equations or driving; the sample."""


@dataclass(frozen=True)
class Point:
    """One scene to run. changes: of the base scene, see `changed`.

    again: run it although an equal scene has run.
    """

    label: str
    parameter: str
    text: str = ""
    value: float = float("nan")
    kind: str = NUMERICAL
    changes: dict = field(default_factory=dict)
    again: bool = False


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
    number of steps; None where no scene sets it. fraction(scene): that over the stiffest period,
    None where it is chosen so. kind(scene): kind of scene for `--suggest`.
    """

    parameters: tuple[Parameter, ...]
    presets: Callable
    check: Callable
    step: Callable | None = None
    fraction: Callable = lambda scene: None
    kind: Callable = lambda scene: None


def changed(scene, changes):
    """The scene with changes, made in their order. Raises DustError."""
    for path, value in changes.items():
        scene = scene.with_value(path, value)
    return scene


def stage_paths(scene):
    """Prefix of the path of each stage's stop: "" or "stages.0." ..."""
    return [f"stages.{n}." for n in range(len(scene.stages))] or [""]
