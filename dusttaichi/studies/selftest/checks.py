"""Checks of `dust selftest`: states, ledger, equal bits of two runs, time of a step, the device."""

import ctypes
import time
from dataclasses import dataclass
from math import inf

import numpy as np

from dusttaichi import method
from dusttaichi.compute import processor
from dusttaichi.errors import DustError
from dusttaichi.run.ledger import turnover
from dusttaichi.samples.sample import memory
from dusttaichi.scene import Scene
from dusttaichi.studies.selftest import scenes

OPEN = 0.01  # largest residual of the ledger, as in a run (numerics.ledger_tolerance)
SHORTEST = 0.5  # s, shortest of the three measurements
NAME = 256  # bytes of the name of a device
GIB = 2.0**30


@dataclass(frozen=True)
class Outcome:
    """Result of a scene.

    The largest difference from the stored state with its tolerance, residual of the ledger over the
    turnover, number of searches, and a flag for a second run with equal bits.
    """

    name: str
    difference: float
    tolerance: float
    residual: float
    searches: int
    same_bits: bool

    @property
    def passed(self):
        """True for a result without faults."""
        close = self.difference <= self.tolerance and abs(self.residual) <= OPEN
        return bool(close and self.same_bits and self.searches > 1)


@dataclass(frozen=True)
class Speed:
    """Time of a step at one size [ns]: by grain, and by contact between grains that touch."""

    backend: str
    grains: int
    contacts: int
    step: float

    @property
    def of_contact(self):
        return self.step / self.contacts

    @property
    def of_grain(self):
        return self.step / self.grains


def check(name, backend):
    """The Outcome of a scene of `scenes.CHANGES`."""
    scene, expected = scenes.scene(name, backend), scenes.stored()[name]
    motion, start = scenes.moved(scene)
    found, searches = scenes.state(motion), motion.sim.search.count
    residual, through = turnover(motion.measure(), method.Start.of(start))
    again = scenes.state(scenes.moved(scene)[0])
    return Outcome(
        name,
        scenes.difference(found, expected),
        scenes.tolerance(name),
        float(residual / through),
        searches,
        bool(np.array_equal(found, again)),
    )


def crystal(grains, backend):
    """Scene of a simple cubic lattice: three contacts for each grain."""
    return Scene.from_dict(
        {
            "name": "crystal",
            "material": "silicate_s12",
            "interaction": {"damping": "viscoelastic"},
            "sample": {"kind": "lattice", "structure": "sc", "grains": grains},
            "boundary": {"kind": "open"},
            "numerics": {"backend": backend},
            "stop": {"steps": 1},
        }
    )


def measure_speed(grains, backend):
    """The Speed of a crystal with a number of grains: the fastest of three measurements."""
    scene = crystal(grains, backend)
    motion = method.of(scene).build(scene, method.make_sample(scene))
    motion.advance(2)
    steps = 16
    while (took := _timed(motion, steps)) < SHORTEST:
        steps = max(2 * steps, int(1.2 * steps * SHORTEST / took))
    took = min(took, _timed(motion, steps), _timed(motion, steps))
    contacts = int(motion.sim.measure()["contacts"])
    return Speed(backend, motion.sim.grains, contacts, took / steps * 1e9)


def _timed(motion, steps):
    """Seconds of `steps` steps; a device has finished them once a number is read."""
    began = time.perf_counter()
    motion.advance(steps)
    motion.sim.state["counts"]
    return time.perf_counter() - began


def slower_sizes(speeds, others):
    """Sizes at which the first backend is slower than the other, from Speeds of the same sizes."""
    pairs = zip(speeds, others, strict=True)
    return [ours.grains for ours, theirs in pairs if ours.step > theirs.step]


def describe(backend):
    """(name, memory [bytes] or None) of the device of a backend.

    Raises DustError without such a device.
    """
    if backend == "cuda":
        return _cuda()
    size = memory()
    return processor.model(), size if size < inf else None


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
