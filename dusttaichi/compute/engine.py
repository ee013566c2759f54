"""The compiler, in one place: every other module takes `ti` from here, and none imports Taichi."""

import taichi as ti

__all__ = ["program", "settings", "ti"]


def program():
    """The program that Taichi holds now: another one after each start."""
    return ti.lang.impl.get_runtime().prog


def settings():
    """What the running Taichi was started with: arch, cpu_max_num_threads, ...; it may be set."""
    return ti.lang.impl.current_cfg()
