"""Return pages of memory to the system, which fills them with zeros at their next use.

Fields have a larger capacity than a scene uses, and Taichi writes zeros to all of it.
"""

import ctypes
import os
import sys
from functools import cache

import numpy as np

PAGE = os.sysconf("SC_PAGE_SIZE") if hasattr(os, "sysconf") else 4096
LEAST = 2**20  # bytes of an array below which nothing is gained
_DONTNEED = 4  # MADV_DONTNEED of Linux


@cache
def _madvise():
    """The function of the C library; None on systems where it does not leave zeros."""
    if sys.platform != "linux":
        return None
    try:
        function = ctypes.CDLL(None, use_errno=True).madvise
    except (OSError, AttributeError):
        return None
    function.argtypes = ctypes.c_void_p, ctypes.c_size_t, ctypes.c_int
    return function


def release(array):
    """Set a large array to zeros by giving its pages back; False where that cannot be done.

    The array may have been changed then, and has to be filled.
    """
    if array.nbytes < LEAST or not array.flags.c_contiguous or _madvise() is None:
        return False
    values = array.reshape(-1).view(np.uint8)
    first = -values.ctypes.data % PAGE
    end = first + (len(values) - first) // PAGE * PAGE
    values[:first], values[end:] = 0, 0
    # memory that is shared with a file or a process keeps its content
    values[first], values[end - 1] = 1, 1
    refused = _madvise()(values.ctypes.data + first, end - first, _DONTNEED)
    return not refused and values[first] == 0 and values[end - 1] == 0
