"""Taichi's internals that this program uses beyond its interface; everything works without them.

`DUST_TAICHI_INTERNALS=off` switches all of them off; so does a version that was not tested, but for
the addresses of fields. Modules, and the time that each saves:

- source_reading: sources of kernels are read once; 0.9 s of the first step
- import_search: Taichi's import does not search all modules for its callers; 0.5 s of a start
- programs: several programs in a process; 1.3 s whenever a process returns to a scene
- launching: repeated launches of a kernel; 30 to 100 us of each
- addresses: arrays that share the memory of fields; a kernel for each field that is read
"""

import os

VARIABLE = "DUST_TAICHI_INTERNALS"


def are_allowed():
    """False where the environment variable switches the use of Taichi's internals off."""
    return os.environ.get(VARIABLE, "").strip().lower() != "off"
