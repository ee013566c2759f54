"""Cost and progress of the sample of a scene, for those who wait for it."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass

Listener = Callable[[float, float | None], None]
_listener: ContextVar[Listener | None] = ContextVar("listener", default=None)


@dataclass(frozen=True)
class Cost:
    """Cost of a sample that grows faster than N log N with the number N of its particles.

    growth: of its time, such as "N^2". seconds: an order of magnitude on one core.
    """

    growth: str
    seconds: float


@contextmanager
def listening(listener: Listener) -> Iterator[None]:
    """Context in which `listener` is called with the progress of samples: done, total.

    total: None where it is not known.
    """
    token = _listener.set(listener)
    try:
        yield
    finally:
        _listener.reset(token)


def report_progress(finished: float, total: float | None = None) -> None:
    """Report to the listener, if any, that `finished` of `total` of a sample is made."""
    if (listener := _listener.get()) is not None:
        listener(finished, total)
