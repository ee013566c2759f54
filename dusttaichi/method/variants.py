"""Changes of the scenes of a method whose cost and error `dust trade` measures."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable

    from dusttaichi.method.engine_protocol import Scene

NUMERICAL, PHYSICAL, SAMPLE = "numerical", "physical", "sample"
KINDS = (NUMERICAL, PHYSICAL, SAMPLE)
"""Kinds of change: numerical solution or averages; equations or driving; the sample."""


@dataclass(frozen=True)
class Variant:
    """A changed scene. changes: of the base scene, see `change_scene`.

    repeats: run it although an equal scene has run.
    """

    label: str
    parameter: str
    text: str = ""
    value: float = float("nan")
    kind: str = NUMERICAL
    changes: dict[str, Any] = field(default_factory=dict)
    repeats: bool = False


@dataclass(frozen=True)
class Parameter:
    """Parameter that can be varied: its levels are `values`.

    changes: path of the key that has the value, or a function (scene, value) -> changes, which are
    {} for a level that the scene does not have. obstacle: scene -> reason why the parameter cannot
    be varied, or "".
    """

    name: str
    kind: str
    changes: str | Callable[[Scene, Any], dict[str, Any]]
    values: tuple[Any, ...]
    obstacle: Callable[[Scene], str] = lambda scene: ""

    def list_levels(self, scene: Scene) -> list[tuple[str, dict[str, Any]]]:
        """(text, changes) of each level."""
        levels = [
            (
                f"{value:g}" if isinstance(value, float) else str(value),
                self._list_changes(scene, value),
            )
            for value in self.values
        ]
        return [(text, changes) for text, changes in levels if changes]

    def _list_changes(self, scene: Scene, value: Any) -> dict[str, Any]:
        if isinstance(self.changes, str):
            return {self.changes: value}
        return self.changes(scene, value)


@dataclass(frozen=True)
class Parameters:
    """Parameters of a Method for `dust trade`, as its `trade_parameters`.

    presets(scene): further Variants, with the converged reference. check(scene): the Variant that
    gives the error of the reference. step(scene): time step [s] of a scene, which makes a time of a
    number of steps; None where no scene sets it. fraction(scene): that over the stiffest period,
    None where it is chosen so. kind(scene): kind of scene for `--suggest`.
    """

    parameters: tuple[Parameter, ...]
    presets: Callable[[Scene], list[Variant]]
    check: Callable[[Scene], Variant]
    step: Callable[[Scene], float] | None = None
    fraction: Callable[[Scene], float | None] = lambda scene: None
    kind: Callable[[Scene], str | None] = lambda scene: None


def change_scene(scene: Scene, changes: dict[str, Any]) -> Scene:
    """The scene with changes, made in their order. Raises DustError."""
    for path, value in changes.items():
        scene = scene.with_value(path, value)
    return scene


def list_stage_paths(scene: Scene) -> list[str]:
    """Prefix of the path of each stage's stop: "" or "stages.0." ..."""
    return [f"stages.{n}." for n in range(len(scene.stages))] or [""]
