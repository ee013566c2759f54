"""Verdict on a computation with extreme numbers, for the map of extremes and the tortures."""

import traceback
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from dusttaichi.errors import DustError, GuardStop

VERDICTS = STABLE, REFUSED, STOPPED, WRONG = "stable", "refused", "stopped", "WRONG"


@dataclass(frozen=True)
class Verdict:
    """End of a computation, with its reason. details: traceback of an unexpected error, or ""."""

    name: str
    reason: str = ""
    details: str = ""


def judge(compute: Callable[[], str]) -> Verdict:
    """Verdict on compute(), which returns what is wrong with its numbers, or "".

    It is refused by a DustError and stopped by a guard; any other error is WRONG, as numbers are.
    """
    try:
        problem = compute()
    except GuardStop as stop:
        return Verdict(STOPPED, str(stop))
    except DustError as error:
        return Verdict(REFUSED, str(error))
    except Exception as error:
        last = traceback.extract_tb(error.__traceback__)[-1]
        location = f"{last.filename.split('/')[-1]}:{last.lineno}"
        text = f"{type(error).__name__}: {error} ({location})"
        return Verdict(WRONG, text, traceback.format_exc())
    return Verdict(WRONG, problem) if problem else Verdict(STABLE)


def name_infinite(arrays: Mapping[str, ArrayLike]) -> str:
    """Sentence that names the arrays (name -> values) with numbers that are not finite, or ""."""
    names = [name for name, values in arrays.items() if not np.isfinite(values).all()]
    return f"not a number in {', '.join(names)}" if names else ""
