"""Parameters that `dust trade` varies in the scenes of a method."""

from collections.abc import Callable
from dataclasses import dataclass

from dusttaichi.errors import DustError
from dusttaichi.method import attribute, of


@dataclass(frozen=True)
class Knob:
    """Parameter that can be varied. rungs: from the base scene to rows (text, changes), or where it
    has nothing to turn, a text that says why."""

    name: str
    kind: str
    text: str
    rungs: object


@dataclass(frozen=True)
class Knobs:
    """Parameters of a Method for `dust trade`, as its `knobs`.

    knobs: all of them. presets(scene): Points that are tried beside the ladders, the converged
    reference among them. check(scene): the Point that tells the error of the reference itself.
    step(scene): the time step [s] of a scene, by which a stop after steps is a time; None where the
    step is not the scene's to say. kind(scene): the kind of scene that settings were measured for.
    """

    knobs: tuple[Knob, ...]
    presets: Callable
    check: Callable
    step: Callable | None = None
    kind: Callable = lambda scene: None


def knobs_of(scene):
    """The Knobs of the method of a scene. Raises DustError where it has none."""
    found = attribute(of(scene).knobs)
    if found is None:
        raise DustError(f"method: {scene.method} has nothing that dust trade could turn")
    return found
