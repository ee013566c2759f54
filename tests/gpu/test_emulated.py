"""Taichi's kernels for CUDA on an emulated device: results of the CPU, no race, few launches and
synchronisations, few registers.

One scene always runs; all others are very long, since each compiles its kernels to C.
"""

import json
import os
import re
import shutil
import subprocess
import sys
from collections import Counter
from functools import cache
from pathlib import Path

import cases
import emulated
import numpy as np
import pytest

pytestmark = pytest.mark.skipif(bool(emulated.missing()), reason=str(emulated.missing()))
QUICK = "box_mixed"
EVERY = [
    pytest.param(n, marks=pytest.mark.long if n == QUICK else pytest.mark.very_long)
    for n in cases.NAMES
]
SEARCH = ("find_bounds", "wrap", "list_neighbours")
SEARCH += ("sort", "reorder", "write_ghosts", "visit", "sum_up", "place_ghosts")
LOOK = 16  # steps between two readings of the progress by the host


@pytest.fixture(scope="module")
def device(tmp_path_factory):
    """A function that runs a case on the emulated device and returns (numbers, report, standard
    error, folder of its modules); each run is made once."""

    @cache
    def run(name, order="random", races=1):
        out = tmp_path_factory.mktemp(f"{name}_{order}")
        path = out / "found.npz"
        arguments = [cases.__file__, path, name]
        _, errors = emulated.start(arguments, out, order=order, races=races)
        with np.load(path) as arrays:
            numbers = {key: arrays[key] for key in arrays.files}
        report = json.loads(str(numbers.pop("report")))
        return numbers, report, errors, out

    return run


@pytest.mark.parametrize("name", EVERY)
def test_a_device_gives_the_results_of_the_cpu(name, device):
    expected, allowed, searches = cases.compute_expected(name)
    results, report, _, _ = device(name)
    assert report["searches"] == searches > 0
    if name.startswith("sphere"):
        assert expected["state sum sphere_contacts"] > 0
    if "state impulse" in expected:  # each surface has pressed grains
        assert (expected["state impulse"][:, 3] > 0.0).all()
    for key, a in expected.items():
        np.testing.assert_allclose(results[key], a, rtol=0, atol=allowed[key] + 1e-300, err_msg=key)


@pytest.mark.parametrize("name", EVERY)
def test_threads_do_not_race(name, device):
    """Two threads may write only the same value: the 1 that says that a search is due. No two of
    them add to the same floating-point number."""
    _, _, errors, _ = device(name)
    wrong = [
        line for line in errors.splitlines() if line.startswith("RACE") and "same value" not in line
    ]
    assert not wrong


ERRORS = r"""
#include "threads.h"

#define LARGEST(name, call, exact, error) { \
    double largest = 0; \
    for (float a = 0.1f; a < 30.0f; a *= 1.0001f) { \
      double d = exact, off = fabs((call) - d) / (error); \
      largest = off > largest ? off : largest; \
    } \
    printf("%s %.3f\n", name, largest); \
  }

int main(void) {
  LARGEST("rcp", rcp_approx_f32(a), 1.0 / a, ulp(d))
  LARGEST("div", div_approx_f32(0.7f, a), (double)0.7f / a, 2 * ulp(d))
  LARGEST("rsqrt", rsqrt_approx_f32(a), 1.0 / sqrt(a), d * exp2(-22.9))
  LARGEST("sqrt", sqrt_approx_f32(a), sqrt(a), d * exp2(-23))
  LARGEST("sin", sin_approx_f32(a), sin(a), exp2(a <= 2 * M_PI ? -20.5 : -14.7))
  float zero = rcp_approx_f32(INFINITY), infinite = rsqrt_approx_f32(0);
  printf("exact %g %g %g\n", zero, infinite, div_approx_f32(2, 0x1.8p126f));
  return 0;
}
"""


@pytest.mark.parametrize("direction", ["1", "up", "down"])
def test_approximate_functions_are_off_by_what_ptx_allows(direction, tmp_path, monkeypatch):
    """No more, but almost as much; infinite and zero results are right."""
    source, program = tmp_path / "errors.c", tmp_path / "errors"
    source.write_text(ERRORS)
    include = ["-I", emulated.HERE / "emulator"]
    subprocess.run(["gcc", "-w", *include, "-o", program, source, "-lm"], check=True)
    monkeypatch.setenv("EMULATOR_APPROXIMATE", direction)
    out = subprocess.run([program], capture_output=True, text=True, check=True).stdout.splitlines()
    assert out.pop() == "exact 0 inf 0"
    largest = {name: float(error) for name, error in map(str.split, out)}
    assert len(largest) == 5 and all(0.9 < error <= 1.0 for error in largest.values()), largest


RACING = """
from dusttaichi.compute.engine import ti

ti.init(arch=ti.cuda, log_level=ti.ERROR)
sums, last = ti.field(ti.f32, shape=2), ti.field(ti.i32, shape=2)

@ti.kernel
def add(n: ti.i32):
    for i in range(n):
        sums[i % 2] += 1.0 / (i + 1.0)

@ti.kernel
def write(n: ti.i32):
    for i in range(n):
        last[i % 2] = i

add(64)
write(64)
"""


@pytest.mark.very_long
def test_races_are_found(tmp_path):
    path = tmp_path / "racing.py"
    path.write_text(RACING)
    lines = emulated.start([path], tmp_path, races=1)[1].splitlines()
    race_lines = {line.split(" (")[0] for line in lines if line.startswith("RACE")}
    assert {re.sub(r"_c\d\w*", "", line) for line in race_lines} == {
        "RACE add: sum after an atomic",
        "RACE write: write after a write",
    }


@pytest.mark.very_long
@pytest.mark.parametrize("name", cases.NAMES)
def test_the_order_of_threads_changes_no_bit(name, device):
    first, second = device(name)[0], device(name, order="forward", races=0)[0]
    assert first.keys() == second.keys()
    for key, a in first.items():
        assert np.array_equal(a, second[key], equal_nan=True), key


@pytest.mark.parametrize("name", EVERY)
def test_launches_and_synchronisations_of_a_step(name, device):
    """Two launches a step of grains, and one every 16 steps where the cell moves; a synchronisation
    every 16 steps. To begin takes two launches more; to change the speeds of a controlled load a
    few of both, and no more bytes with more grains. Lists of a search are made by the device: the
    host reads bounds of the grains, and whether the lists fit. A record of a continuum reads as
    much whatever the number of particles."""
    took = device(name)[1]["counted"]
    search = took["search"]
    if name in cases.CONTINUUM:
        # bodies, particles; response; forces, loads of bodies; the end of the step. To begin and
        # to look; launches that find nothing to do
        calls = 1 + took["searches"]
        most_launches = 6 * (took["steps"] + LOOK) + 64 * calls
        assert took["launches"] <= most_launches and took["steps"] > 0
        assert took["syncs"] <= took["steps"] // LOOK + 4 * calls
        assert search["launches"] <= 72 and search["syncs"] <= 8 and search["bytes_from"] <= 1024
        # sums of particles are formed by the device: the host reads them and rows of bodies
        record = took["record"]
        assert record["launches"] <= 64 and record["syncs"] <= 24
        assert record["bytes_from"] <= 16_384
        return
    assert took["searches"] == 0 and took["steps"] == 32
    controlled = name.startswith(("pressed", "sheared", "many_sheared"))
    assert (took["changes"] > 0) == controlled
    looks = took["steps"] // LOOK + took["changes"]
    assert took["launches"] <= 2 * took["steps"] + 2 * looks + 2 + 8 * took["changes"]
    assert took["syncs"] <= looks + 4 * took["changes"]
    assert took["bytes_from"] <= 512 * (1 + took["changes"])
    assert search["launches"] <= 60 and search["syncs"] <= 8 and search["bytes_from"] <= 1024


@pytest.mark.parametrize("name", EVERY)
def test_kernels_need_neither_atomic_floats_nor_lengths_of_the_device(name, device):
    """Only counters of integers are atomic, and what they number is sorted afterwards; in a
    continuum also sums of a single thread (test_threads_do_not_race would find a second one). In a
    search no task reads the length of a loop before it; single threads read the numbers of the grid
    and check that lists are not too long."""
    out, atomic, serial = device(name)[3], set(), Counter()
    for module in sorted(out.glob("*.ptx")):
        text = module.read_text()
        tasks = re.findall(r"\.entry (\w+?)_c\d+_\d+_kernel_\d+_(\w+)\(", text)
        if tasks:  # else the module is Taichi's own
            atomic.update(re.findall(r"\b(?:atom|red)\.[\w.]+", text))
            serial.update(kernel for kernel, task in tasks if task == "serial")
    own_sums = {"atom.add.f64"} if name in cases.CONTINUUM else set()
    assert atomic - own_sums == {"atom.add.u32"}
    search = {kernel: n for kernel, n in serial.items() if kernel in SEARCH}
    assert search.keys() <= {"list_neighbours", "find_bounds", "sort", "reorder", "visit", "sum_up"}
    assert sum(search.values()) <= (8 if name in cases.CONTINUUM else 3)


# Kernels of a step, and the most registers of a thread by precision of the contacts: with these
# three blocks of 128 threads, in double precision two, share the 65536 registers of a
# multiprocessor. `touch` in double precision has blocks of 192 threads, so 168 registers: where a
# scene needs some more, it stores that many bytes.
STEP = ("touch", "kick_and_drift", "respond", "push", "end_step")
MOST = {"f64": 255, "mixed": 168, "f32": 168}
SPILLED = {"forces_unequal_f64": 12, "sphere_f64": 80, "tube_f64": 184, "surfaces_f64": 20}


def registers(folder):
    """Kernel -> (registers, bytes spilled) by ptxas, of the modules of a folder."""
    tool = _ptxas()
    if tool is None:
        pytest.skip("no ptxas: pip install nvidia-cuda-nvcc-cu12")
    out = {}
    for module in sorted(folder.glob("*.ptx")):
        if not re.search(rf"\.entry ({'|'.join(STEP)})_c", module.read_text()):
            continue
        report = subprocess.run(
            [tool, "-v", "-arch=sm_90", module, "-o", os.devnull],
            capture_output=True, text=True, check=True,
        ).stderr  # fmt: skip
        form = r"Compiling entry function '(\w+)'.*?(\d+) bytes spill stores.*?Used (\d+) registers"
        for kernel, spilled, used in re.findall(form, report, flags=re.S):
            out[kernel] = int(used), int(spilled)
    return out


def _ptxas():
    """The assembler of PTX: that of the package nvidia-cuda-nvcc-cu12, or of the machine."""
    for folder in sys.path:
        tool = Path(folder) / "nvidia/cuda_nvcc/bin/ptxas"
        if tool.exists():
            return tool
    return shutil.which("ptxas")


@pytest.mark.parametrize("name", EVERY)
def test_no_register_is_spilled(name, device):
    found = registers(device(name)[3])
    assert any(kernel.startswith(("touch", "push")) for kernel in found)
    assert {k: n for k, (_, n) in found.items() if n > SPILLED.get(name, 0)} == {}
    # surfaces are evaluated in double precision whatever that of the contacts
    has_surfaces = name.startswith(("tube", "surfaces"))
    limit = MOST["f64" if has_surfaces else cases.precision(name)]
    assert {k: n for k, (n, _) in found.items() if n > limit} == {}
