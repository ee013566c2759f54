"""Protocol of a method for the run: how it is built, moved, measured and restored; no more.

A method computes the motion of something: grains, or a continuum. Its scene is a class of its own,
its engine has the members of `Engine`, and a `Method` names both. The run loop, the result
file, checkpoints and stages know nothing else of it.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dusttaichi.method.engine_of_parts import EngineOfParts
from dusttaichi.method.engine_protocol import (
    ArraysOnRequest,
    Engine,
    HasMethod,
    Measurement,
    Moment,
    Scene,
    Start,
    State,
    Window,
)
from dusttaichi.method.simple import SimpleEngine
from dusttaichi.physics.registry import Registry

if TYPE_CHECKING:
    from dusttaichi.results.variables import Variable

__all__ = [
    "ArraysOnRequest",
    "Engine",
    "EngineOfParts",
    "Measurement",
    "Method",
    "Preview",
    "SimpleEngine",
    "Start",
    "State",
    "Window",
    "built_anew",
    "make_sample",
    "moment",
    "load_method",
    "find_method",
    "register",
]

DEFAULT = "grains"


def built_anew(scene: Scene, state: State) -> Engine:
    """Engine in a State of an engine of that scene, built from the scene's own sample.

    It is the `reopen` of a Method whose samples take no time to make.

    Parameters
    ----------
    scene
    state

    Returns
    -------
    Engine
    """
    engine = find_method(scene).build(scene, make_sample(scene))
    engine.restore(state)
    return engine


@dataclass(frozen=True)
class Preview:
    """Numbers of a scene that are known before it is built; `dust check` prints them.

    Attributes
    ----------
    sections
        (title, rows of (name, value)) of each.
    size
        Number of particles.
    dt
        Time step [s].
    plan
        (name of the stage, steps at most, condition that ends it) of every stage, steps infinite
        where only a measured condition ends it.
    cost
        Time of a step of a particle over that of `Method.seconds`, about.
    """

    sections: list[tuple[str, list[tuple[str, str]]]]
    size: int
    dt: float
    plan: list[tuple[str, float, str]]
    cost: float = 1.0


@dataclass(frozen=True, kw_only=True)
class Method:
    """A method: the class of its scene, and functions that make an Engine of one.

    Attributes
    ----------
    name
        Value of the key `method`.
    scene
        Pydantic class of its scene.
    make_sample
        make_sample(scene): the initial state.
    build
        build(scene, sample): the Engine at step 0.
    variables
        All variables that its results may contain.
    reopen
        reopen(scene, state): an Engine in a State of an engine of that scene.
    code
        code(scene): source files outside of this package that decide the numbers of a scene.
    preview
        preview(scene): a Preview, made quickly and without compiling.
    internals
        internals(scene): more sections of `dust check --internals`, of the scene built.
    forces
        forces(scene): sections with the forces at its start.
    seconds
        Order of magnitude of the time of a step per particle on a CPU [s], for `dust check`.
    device_seconds
        The same on a GPU: (of a step of few particles, of a step per particle).
    observables
        Families of numbers (analysis.numbers.Family) beside those of any method.
    figures
        Figures (plots.figure) beside those of any method.
    read_snapshot
        read_snapshot(run, number): one snapshot of a Run.
    picture
        Draws snapshots (plots.figure_registry.Picture).
    exports
        Format -> write(run, frames, folder), which returns the paths of the files.
    trade_parameters
        method.variants.Parameters that `dust trade` varies.

    Notes
    -----
    Attributes from `observables` on may be "module:attribute", imported when it is needed.
    """

    name: str
    scene: type[Scene]
    make_sample: Callable[..., Any]
    build: Callable[..., Engine]
    variables: tuple[Variable, ...]
    reopen: Callable[..., Engine] = built_anew
    code: Callable[[Scene], list[Path]] = lambda scene: []
    preview: Callable[[Scene], Preview] | None = None
    internals: Callable[[Scene], list[Any]] = lambda scene: []
    forces: Callable[[Scene], list[Any]] = lambda scene: []
    seconds: float = 1e-6
    device_seconds: tuple[float, float] = (1e-4, 1e-8)
    observables: tuple[Any, ...] = ()
    figures: tuple[Any, ...] = ()
    read_snapshot: Any = None
    picture: Any = None
    exports: Mapping[str, Any] = field(default_factory=dict)
    trade_parameters: Any = None

    @property
    def read(self) -> Callable[..., Any]:
        """The function `read_snapshot`."""
        function: Callable[..., Any] = attribute(self.read_snapshot)
        return function

    def writer(self, to: str) -> Callable[..., Any]:
        """The writer of a format of `exports`.

        Raises
        ------
        ModuleNotFoundError
            Its library is not installed.
        """
        function: Callable[..., Any] = attribute(self.exports[to])
        return function


def _methods_of_package() -> dict[str, str]:
    """Name -> "module:METHOD" of the subpackages with a module `method`, the default first."""
    names = [path.parent.name for path in Path(__file__).parents[1].glob("*/method.py")]
    ordered = sorted(names, key=lambda name: (name != DEFAULT, name))
    return {name: f"dusttaichi.{name}.method:METHOD" for name in ordered}


def register(method: Method) -> None:
    """Make a method known by its name to this process.

    A file that does so, also with the Method of an installed package, becomes known to every
    process that reads a scene with the file among its `extensions`.

    Raises
    ------
    ValueError
        The name is that of a method of this package.
    """
    METHODS.replace(method.name, method)


def load_method(name: str) -> Method:
    """The method of that name.

    Raises
    ------
    KeyError
        There is none.
    """
    return METHODS[name]


def attribute(reference: Any) -> Any:
    """Object that "module:attribute" names; anything else is returned as it is."""
    if not isinstance(reference, str):
        return reference
    module, name = reference.split(":")
    return getattr(importlib.import_module(module), name)


METHODS: Registry[str, Method] = Registry("method", _methods_of_package(), attribute)


def defer_import(reference: str) -> Callable[..., Any]:
    """Function that imports "module:attribute" when it is called, and calls that."""
    return lambda *arguments: attribute(reference)(*arguments)


def list_rows(name: str, of_method: Method | None = None) -> list[Any]:
    """List the `observables` or `figures` (name) of a method (default: of all), imported."""
    methods = list(METHODS.values()) if of_method is None else [of_method]
    objects = [attribute(entry) for method in methods for entry in getattr(method, name)]
    return [row for entry in objects for row in (entry if isinstance(entry, tuple) else (entry,))]


def find_method(scene: HasMethod) -> Method:
    """The Method of a scene."""
    return load_method(scene.method)


def of_result(scene: Mapping[str, Any]) -> Method:
    """The Method of a scene as plain data; one that knows its name only where it is not here."""
    name = str(scene.get("method", DEFAULT))
    try:
        return load_method(name)
    except KeyError:
        nothing: dict[str, Any] = dict.fromkeys(("scene", "make_sample", "build"))
        return Method(name=name, variables=(), **nothing)


def moment(at: Moment) -> str:
    """Time and step of a run, as the guards state them."""
    time = at.time * at.units("s") * 1e6
    return f"At {time:.6g} µs (step {at.step})"


def make_sample(scene: Scene) -> Any:
    """Initial sample of a scene; of grains a Sample, all in SI.

    Raises
    ------
    DustError
        The sample cannot be made.
    """
    return find_method(scene).make_sample(scene)
