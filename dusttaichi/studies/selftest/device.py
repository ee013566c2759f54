"""Device of a backend: its name and memory."""

import ctypes
import os

from dusttaichi.compute import processor
from dusttaichi.errors import DustError

NAME = 256  # bytes of the name of a device
GIB = 2.0**30


def describe(backend):
    """(name, memory [bytes] or None) of the device of a backend.

    Raises DustError without such a device.
    """
    return _cuda() if backend == "cuda" else (processor.model(), _memory())


def _memory():
    try:
        return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, ValueError, OSError):  # Windows
        return None


def _cuda():
    """(name, memory) of the first device of the driver."""
    driver = _driver()
    count, device = ctypes.c_int(), ctypes.c_int()
    name, size = ctypes.create_string_buffer(NAME), ctypes.c_size_t()
    found = driver.cuInit(0) or driver.cuDeviceGetCount(ctypes.byref(count))
    if found or count.value == 0:
        raise DustError(f"the CUDA driver finds no device (error {found}); try --backend cpu")
    driver.cuDeviceGet(ctypes.byref(device), 0)
    driver.cuDeviceGetName(name, NAME, device)
    driver.cuDeviceTotalMem_v2(ctypes.byref(size), device)
    return name.value.decode(errors="replace"), size.value


def _driver():
    for library in ("libcuda.so.1", "libcuda.so", "nvcuda.dll"):
        try:
            return ctypes.CDLL(library)
        except OSError:
            continue
    raise DustError("there is no CUDA driver on this machine (libcuda); try --backend cpu")
