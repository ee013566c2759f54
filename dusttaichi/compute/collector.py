"""Python's collector of reference cycles, as it suits what makes many objects that stay."""

import gc

OBJECTS = 20_000  # made between two looks; Python takes 700


def collect_seldom():
    """Look for cycles seldom: modules, scenes and syntax trees of kernels stay, and going over them
    again and again is a twentieth of the time of a short run."""
    gc.set_threshold(OBJECTS, 10, 10)
