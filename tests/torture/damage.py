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
from tally import forked

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
        made = _originals(folder)
        kinds = ("checkpoint", "result", "part", "sample")
        for number in range(count):
            rng = random.Random(f"{seed} {number}")
            kind = kinds[number % len(kinds)]
            found, problem = _apart(_sample if kind == "sample" else _run, kind, folder, made, rng)
            problem = problem and f"{kind}, seed {seed}: {problem}"
            tally.case(f"{kind} {found}", problem, number)


def _apart(case, *how):
    """(what happened, what is wrong or None) of a case, in a process that may hang or crash."""
    report = how[1] / "said"

    def go():
        signal.alarm(PATIENCE)
        report.write_text(json.dumps(case(*how) or ("repaired", None)))

    status, said = forked(report, go)
    if status < 0:
        return f"ends HDF5 by {signal.Signals(-status).name}", None
    return json.loads(said) if status == 0 else ("traceback", said)


def _originals(folder):
    """The files that copies are damaged of."""
    toy.with_parts(False)
    plain = toy.go("plain", folder / "plain")
    toy.with_parts(True)
    parts, told = folder / "parts", []

    def stop(report):
        told.append(report)
        if len(told) == 8:
            raise Interrupted("on its way, with its result in parts")

    with suppress(Interrupted):
        toy.go("plain", parts, report=stop)
    return {"plain": plain, "parts": parts, "sample": _grains(folder / "a.nc")}


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
    at, kind = rng.randrange(len(raw)), rng.randrange(4)
    if kind == 0:
        raw = raw[:at]
    elif kind == 1:
        raw[at : at + 512] = bytes(len(raw[at : at + 512]))
    else:
        for _ in range(1 if kind == 2 else 20):
            raw[rng.randrange(len(raw))] ^= 1 << rng.randrange(8)
    path.write_bytes(raw)


def _numbers(path):
    """All numbers of a result, in parts or not, by name."""
    with open_tree(path) as tree:
        return bits.numbers(tree)


def _compared(whole, path):
    """None where the file is read as the whole one, ("refused", None), or what is wrong."""
    try:
        problem = bits.difference(_numbers(whole), _numbers(path))
    except READING:
        return "refused", None
    return problem and ("accepted", f"other numbers, and not a word: {problem[:300]}")


def _run(kind, folder, made, rng):
    """The checkpoint, result or a part of a run, which is read and then resumed."""
    source, plain = made["parts" if kind == "part" else "plain"], made["plain"] / "result.nc"
    directory, found = folder / "case" / source.name, None
    shutil.rmtree(directory.parent, ignore_errors=True)
    shutil.copytree(source, directory)
    toy.with_parts(kind == "part")
    if kind == "checkpoint":
        for path in directory.glob("checkpoint.bin*"):
            if path.suffix == ".bin" or rng.random() < 0.5:
                _damage(path, rng)
    else:
        parts = sorted((directory / "result.parts").iterdir()) if kind == "part" else []
        _damage(rng.choice(parts) if parts else directory / "result.nc", rng)
        found = _compared(source / "result.nc", directory / "result.nc")
    if found and found[1]:
        return found
    try:
        toy.go("plain", directory, resume=True)
    except DustError:
        return "refused", None
    except Exception as error:  # noqa: BLE001, this is what is looked for
        return "traceback", f"{type(error).__name__}: {error}"
    return _compared(plain, directory / "result.nc")


def _sample(kind, folder, made, rng):
    path = folder / "case.nc"
    shutil.copy(made["sample"], path)
    _damage(path, rng)
    scene = from_yaml(SAMPLE.replace("FILE", str(path)))
    try:
        positions = make(scene).positions
    except DustError:
        return "refused", None
    except Exception as error:  # noqa: BLE001, this is what is looked for
        return "traceback", f"{type(error).__name__}: {error}"
    whole = files.read(made["sample"], Source("the sample", []))["position"]
    same = np.array_equal(positions, whole)
    return None if same else ("accepted", "other positions, and not a word")
