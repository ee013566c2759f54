"""Python's collector of reference cycles, set for programs whose objects mostly stay."""

import gc

OBJECTS = 20_000  # created between two collections; the default of Python is 700


def collect_seldom():
    """Collect garbage rarely.

    Modules, scenes and syntax trees of kernels stay, and scanning them again and again takes 5 % of
    a short run.
    """
    gc.set_threshold(OBJECTS, 10, 10)
