"""Pictures of the snapshots of a run, by its Method."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

from dusttaichi.errors import DustError
from dusttaichi.method import attribute


@dataclass(frozen=True)
class Picture:
    """Pictures of the snapshots of a method.

    name: of its files. draw(run, snapshot, color, view, dpi=...): the Figure of one snapshot.
    film(run, color, view, cell=..., dpi=...): the Figures of all, with the same colours and frame.
    color None: the default.
    """

    name: str
    draw: Callable[..., Any]
    film: Callable[..., Iterator[Any]]


def picture_of(run) -> Picture:
    """The Picture of the method of a Run. Raises DustError where it has none."""
    found = attribute(run.method.picture)
    if found is None:
        raise DustError(f"{run.path}: there are no pictures of method: {run.method.name}.")
    return found
