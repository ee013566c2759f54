"""How many grains a sample may have: what the memory of this machine holds."""

import os

from dusttaichi.errors import DustError

BYTES = 1000  # that a grain takes at least, in the sample and in the simulation


def memory() -> float:
    """Bytes of memory of this machine; infinite where it does not tell."""
    try:
        return float(os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE"))
    except (AttributeError, OSError, ValueError):
        return float("inf")


def check_grains(grains: float, where: str, advice: str = "Take fewer grains.") -> None:
    """DustError, naming where they come from, for more grains than the memory holds."""
    most = memory() / BYTES
    if grains > most:
        raise DustError(
            f"{where}: {grains:.3g} grains need {grains * BYTES / 1e9:.3g} GB of memory at least, "
            f"and this machine has {memory() / 1e9:.3g}; allowed: at most {most:.2g}. {advice}"
        )
