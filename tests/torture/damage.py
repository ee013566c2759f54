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

import netCDF4
import numpy as np
import toy
from bits import assert_same_bits
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
        for number in tally.left(range(count)):
            rng = random.Random(f"{seed} {number}")
            kind = kinds[number % len(kinds)]
            found, problem = _apart(globals()[f"_{kind}"], folder, made, rng)
            problem = problem and f"{kind}, seed {seed}: {problem}"
            tally.case(f"{kind} {found}", problem, number)


def _apart(case, folder, made, rng):
    """(what happened, what is wrong or None) of a case, in a process that may hang or crash."""
    report = folder / "said"

    def go():
        signal.alarm(PATIENCE)
        report.write_text(json.dumps(case(folder, made, rng) or ("repaired", None)))

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


def _compared(whole, path):
    """None where the file is read as the whole one, ("refused", None), or what is wrong."""
    try:
        with open_tree(path) as tree:
            tree.load()
    except READING:
        return "refused", None
    try:
        assert_same_bits(whole, path)
    except READING:
        return "refused", None
    except AssertionError as error:
        return "accepted", f"other numbers, and not a word: {str(error)[:300]}"
    return None


def _go_on(directory, whole, name):
    """As `_compared`, of a run that is resumed."""
    try:
        toy.go(name, directory, resume=True)
    except DustError:
        return "refused", None
    except Exception as error:  # noqa: BLE001, this is what is looked for
        return "traceback", f"{type(error).__name__}: {error}"
    return _compared(whole, directory / "result.nc")


def _copy(source, folder):
    target = folder / "case" / source.name
    shutil.rmtree(target.parent, ignore_errors=True)
    return Path(shutil.copytree(source, target))


def _checkpoint(folder, made, rng):
    toy.with_parts(False)
    directory = _copy(made["plain"], folder)
    for path in directory.glob("checkpoint.bin*"):
        if path.suffix == ".bin" or rng.random() < 0.5:
            _damage(path, rng)
    return _go_on(directory, made["plain"] / "result.nc", "plain")


def _result(folder, made, rng):
    toy.with_parts(False)
    directory = _copy(made["plain"], folder)
    _damage(directory / "result.nc", rng)
    found = _compared(made["plain"] / "result.nc", directory / "result.nc")
    return found if found and found[1] else _go_on(directory, made["plain"] / "result.nc", "plain")


def _part(folder, made, rng):
    toy.with_parts(True)
    directory = _copy(made["parts"], folder)
    _damage(rng.choice(sorted((directory / "result.parts").iterdir())), rng)
    found = _compared_parts(made["parts"] / "result.nc", directory / "result.nc")
    return found if found and found[1] else _go_on(directory, made["plain"] / "result.nc", "plain")


def _compared_parts(whole, path):
    """As `_compared`, of results in parts, which are put together as they are read."""
    try:
        with open_tree(whole) as one, open_tree(path) as other:
            one, other = one.load(), other.load()
    except READING:
        return "refused", None
    return None if one.equals(other) else ("accepted", "other numbers, and not a word")


def _sample(folder, made, rng):
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
