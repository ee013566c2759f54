"""Files of a run that are damaged: bytes that change, blocks of zeros, ends that are cut off.

A damaged checkpoint, result or part is refused when it is read or resumed, or what is
computed has the same bits all the same. What is never accepted: other numbers without a word.
HDF5 has no checksum of its texts, and may hang or crash at zeros among them: that is counted.
"""

import json
import random
import shutil
import signal
import tempfile
from contextlib import suppress
from pathlib import Path

import bits
import netCDF4
import numpy as np
import toy
from tally import run_forked

from dusttaichi.errors import DustError, Interrupted
from dusttaichi.results.reading import open_tree
from dusttaichi.samples import files, make
from dusttaichi.samples.formats.text import Source
from dusttaichi.scene import from_yaml

READING = (DustError, OSError, RuntimeError, ValueError, KeyError, AttributeError, IndexError)
PATIENCE = 20  # s, a hundred times what a case takes
SAMPLE = """
name: sample
material: silicate_s12
sample: {kind: explicit, file: FILE, touch_within: 0}
boundary: {kind: open}
stop: {steps: 1}
"""


def run(count, seed, tally):
    """So many damaged files."""
    toy.prepare()
    toy.join_here()
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        originals = _originals(folder)
        sources = ("checkpoint", "result", "part", "sample")
        for number in range(count):
            rng = random.Random(f"{seed} {number}")
            source_kind = sources[number % len(sources)]
            outcome, problem = _apart(
                _sample if source_kind == "sample" else _run, source_kind, folder, originals, rng
            )
            problem = problem and f"{source_kind}, seed {seed}: {problem}"
            tally.case(f"{source_kind} {outcome}", problem, number)


def _apart(case, *options):
    """(what happened, what is wrong or None) of a case, in a process that may hang or crash."""
    report = options[1] / "said"

    def go():
        signal.alarm(PATIENCE)
        report.write_text(json.dumps(case(*options) or ("repaired", None)))

    status, output = run_forked(report, go)
    if status < 0:
        return f"ends HDF5 by {signal.Signals(-status).name}", None
    return json.loads(output) if status == 0 else ("traceback", output)


def _originals(folder):
    """The files that copies are damaged of."""
    toy.with_parts(False)
    plain = toy.go("plain", folder / "plain")
    toy.with_parts(True)
    parts_folder, log = folder / "parts", []

    def stop(report):
        log.append(report)
        if len(log) == 8:
            raise Interrupted("on its way, with its result in parts")

    with suppress(Interrupted):
        toy.go("plain", parts_folder, report=stop)
    return {"plain": plain, "parts": parts_folder, "sample": _grains(folder / "a.nc")}


def _grains(path):
    """A file of grains as another program may write it, with a sum for each chunk."""
    with netCDF4.Dataset(path, "w") as data:
        data.createDimension("grain", 500)
        data.createDimension("xyz", 3)
        x = data.createVariable("position", "f8", ("grain", "xyz"), fletcher32=True)
        x[:] = np.arange(500)[:, None] * [1.2e-6, 0.0, 0.0]
    return path


def _damage(path, rng):
    """Change the bytes of a file."""
    raw = bytearray(path.read_bytes())
    at, number = rng.randrange(len(raw)), rng.randrange(4)
    if number == 0:
        raw = raw[:at]
    elif number == 1:
        raw[at : at + 512] = bytes(len(raw[at : at + 512]))
    else:
        for _ in range(1 if number == 2 else 20):
            raw[rng.randrange(len(raw))] ^= 1 << rng.randrange(8)
    path.write_bytes(raw)


def _numbers(path):
    """All numbers of a result, in parts or not, by name."""
    with open_tree(path) as tree:
        return bits.numbers(tree)


def _compare(expected, path):
    """None where the file is read as the whole one, ("refused", None), or what is wrong."""
    try:
        problem = bits.difference(_numbers(expected), _numbers(path))
    except READING:
        return "refused", None
    return problem and ("accepted", f"other numbers, and not a word: {problem[:300]}")


def _run(source_kind, folder, originals, rng):
    """The checkpoint, result or a part of a run, which is read and then resumed."""
    source, plain = (
        originals["parts" if source_kind == "part" else "plain"],
        originals["plain"] / "result.nc",
    )
    directory, outcome = folder / "case" / source.name, None
    shutil.rmtree(directory.parent, ignore_errors=True)
    shutil.copytree(source, directory)
    toy.with_parts(source_kind == "part")
    if source_kind == "checkpoint":
        for path in directory.glob("checkpoint.bin*"):
            if path.suffix == ".bin" or rng.random() < 0.5:
                _damage(path, rng)
    else:
        part_files = sorted((directory / "result.parts").iterdir()) if source_kind == "part" else []
        _damage(rng.choice(part_files) if part_files else directory / "result.nc", rng)
        outcome = _compare(source / "result.nc", directory / "result.nc")
    if outcome and outcome[1]:
        return outcome
    try:
        toy.go("plain", directory, resume=True)
    except DustError:
        return "refused", None
    except Exception as error:  # noqa: BLE001, this is what is looked for
        return "traceback", f"{type(error).__name__}: {error}"
    return _compare(plain, directory / "result.nc")


def _sample(source_kind, folder, originals, rng):
    path = folder / "case.nc"
    shutil.copy(originals["sample"], path)
    _damage(path, rng)
    scene = from_yaml(SAMPLE.replace("FILE", str(path)))
    try:
        positions = make(scene).positions
    except DustError:
        return "refused", None
    except Exception as error:  # noqa: BLE001, this is what is looked for
        return "traceback", f"{type(error).__name__}: {error}"
    whole = files.read(originals["sample"], Source("the sample", []))["position"]
    same = np.array_equal(positions, whole)
    return None if same else ("accepted", "other positions, and not a word")
