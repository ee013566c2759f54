"""Work of NumPy on large arrays in several threads, which it computes without Python's lock."""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any


def share_out(function: Callable[[Any], object], items: Sequence[Any], threads: int) -> None:
    """Call a function with each of the items, in several threads at once.

    Calls must not depend on one another. Raises what a call raises.
    """
    if threads == 1 or len(items) < 2:
        for item in items:
            function(item)
        return
    with ThreadPoolExecutor(threads) as executor:
        for _ in executor.map(function, items):
            pass


def cut_rows(rows: int, size: int) -> list[slice]:
    """Slices of at most `size` rows one after another, of that many in all."""
    return [slice(first, min(first + size, rows)) for first in range(0, rows, size)]
