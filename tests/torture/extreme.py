"""Scenes with numbers at the ends of what the YAML allows, run for some steps.

Each is refused, stopped by a guard, or comes to its end, with finite numbers in its result; none
ends by a signal, with a traceback, or does not end. Half of them are of each method.
"""

import json
import math
import random
import resource
import signal
import tempfile
from pathlib import Path

import netCDF4
import numpy as np
import yaml
from kills import CONTINUUM
from tally import run_forked

from dusttaichi.errors import DustError
from dusttaichi.running import execute
from dusttaichi.scene import from_yaml, quantities
from dusttaichi.studies.verdicts import REFUSED, STOPPED, WRONG, judge, name_infinite

SECONDS = 1200  # of processor time; few scenes take more than one, the finest of them minutes
BYTES = 12_000_000_000
STEPS = 30
GRAINS = (
    "sample: {kind: pair, gap: 0.1 um, speed: 1 m/s}\nboundary: {kind: open}",
    "sample: {kind: chain, grains: 5}\nboundary: {kind: open}\ngravity: 9.81 m/s^2",
    "sample: {kind: lattice, structure: fcc, cells: [2, 2, 2]}\n"
    "boundary: {kind: periodic, strain_rate: -1e3 s^-1}",
    "sample: {kind: rbd, grains: 30, seed: 1}\nboundary: {kind: box, wall_speed: 1 cm/s}",
    "sample: {kind: lattice, structure: sc, cells: [3, 3, 3]}\n"
    "boundary: {kind: plates, wall_speed: -1 cm/s}",
    "sample: {kind: rbd, grains: 30, seed: 2}\n"
    "boundary: {kind: box, pressure: 1 kPa, wall_speed: 1 cm/s}",
    "sample: {kind: explicit, positions: [[0 um, 0 um, 0 um], [9 um, 0 um, 0 um]], "
    "velocities: [[1 m/s, 0 m/s, 0 m/s], [0 m/s, 0 m/s, 0 m/s]], "
    "spins: [[0 rad/s, 0 rad/s, 1e5 rad/s], [0 rad/s, 0 rad/s, 0 rad/s]]}\n"
    "boundary: {kind: open}",
)
HEAD = """
name: extreme
material: {base: silicate_s12, radius: 0.6 um, surface_energy: 20 mJ/m^2, young_modulus: 54 GPa,
  poisson_ratio: 0.17, density: 2.65 g/cm^3, critical_rolling: 2 nm}
interaction: {rolling: {modifier: 8}, sliding: {modifier: 2.5}, damping: viscoelastic}
numerics: {time_step: auto, threads: 1}
output: {series: {steps: 5}, snapshots: {steps: 15}}
"""
KEPT = ("threads", "cells", "grains", "seed", "steps", "dimension")  # what a run costs


def originals(method):
    """The scenes, as plain data, whose numbers are changed."""
    if method == "grains":
        texts = [f"{HEAD}{remainder}\nstop: {{steps: {STEPS}}}\n" for remainder in GRAINS]
    else:
        slow = CONTINUUM.replace("steps: 1000", f"steps: {STEPS}")
        texts = [slow, slow.replace("0.65 m/s", "20 m/s")]
    return [yaml.safe_load(text) for text in texts]


def change_numbers(data, rng):
    """The data with one to three numbers somewhere within what their kind of quantity may be."""
    locations = [location for location in _numbers(data) if location[1] not in KEPT]
    for block, key in rng.sample(locations, min(len(locations), rng.choice((1, 1, 2, 3)))):
        block[key] = _extreme(block[key], rng)
    return data


def _numbers(data):
    for key in list(data) if isinstance(data, dict) else range(len(data)):
        value = data[key]
        if isinstance(value, (dict, list)):
            if key not in KEPT:
                yield from _numbers(value)
        elif _dimension_of(value) or (isinstance(value, (int, float)) and value is not True):
            yield data, key


def _dimension_of(value):
    """The dimension of a text with a unit, or None."""
    for name in quantities.DIMENSIONS if isinstance(value, str) else ():
        try:
            quantities.parse(value, name)
            return name
        except DustError:
            continue
    return None


def _extreme(value, rng):
    """Another number: of the ends of all there may be, or up to four decades from the given one."""
    name = _dimension_of(value)
    if name is None:
        near = float(value) * 10.0 ** rng.uniform(-4.0, 4.0)
        return rng.choice((0.0, 1e-12, 1.0, 1e6, 1e12, -1.0, near, near, near, near, near, near))
    dimension = quantities.DIMENSIONS[name]
    low, high = math.log10(dimension.least), math.log10(dimension.most)
    power = rng.choice((low, high, rng.uniform(low, high)))
    size = 10.0**power
    if quantity := quantities.parse(value, name):
        near = abs(quantity) * 10.0 ** rng.uniform(-4.0, 4.0)
        size = rng.choice((size, near, near))
    sign = rng.choice(("", "", "-")) if quantity >= 0.0 else "-"
    return f"{sign}{size:.6g} {quantities.DIMENSIONS[name].unit}"


def run(count, seed, tally):
    """So many scenes, the half of each method."""
    with tempfile.TemporaryDirectory() as folder:
        for method in ("grains", "continuum"):
            for number in range(count // 2):
                rng = random.Random(f"{seed} {method} {number}")
                text = yaml.safe_dump(
                    change_numbers(rng.choice(originals(method)), rng), sort_keys=False
                )
                outcome_kind, problem = _case(text, Path(folder) / f"{method}{number}")
                problem = problem and f"{problem}\n{text}"
                tally.case(f"{method} {outcome_kind}", problem, f"{method} {number} of seed {seed}")


def _case(text, directory):
    """(how a scene ended, what went wrong or None)."""
    stored = directory.with_suffix(".verdict")
    status, words = run_forked(
        directory.with_suffix(".told"), _limit, lambda: _write_verdict(stored, text, directory)
    )
    if status < 0:
        signals = {-signal.SIGXCPU: "it does not end"}
        return "signal", signals.get(status, f"ended by signal {-status}")
    if status:
        return "traceback", words[-1500:]
    name, reason = json.loads(stored.read_text())
    if name in (REFUSED, STOPPED) and len(reason) < 30:
        return name, f"a message that says little: {reason!r}"
    return name, reason[-1500:] if name == WRONG else None


def _write_verdict(path, text, directory):
    verdict = judge(lambda: _run(text, directory))
    path.write_text(json.dumps([verdict.name, verdict.details or verdict.reason]))


def _limit():
    resource.setrlimit(resource.RLIMIT_CPU, (SECONDS, SECONDS + 10))
    resource.setrlimit(resource.RLIMIT_AS, (BYTES, BYTES))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    np.seterr(all="ignore")


def _run(text, directory):
    """Run a scene; what in its result is not a number, or ""."""
    execute(from_yaml(text), directory)
    with netCDF4.Dataset(directory / "result.nc") as file:
        file.set_auto_mask(False)
        names = ("kinetic_translation", "potential", "loss", "kinetic", "energy_residual")
        arrays = {name: file[name][:] for name in names if name in file.variables}
        return name_infinite(arrays | {"positions": file["snapshots"]["position"][:]})
