"""Disks that fail: a disk and a cache of a megabyte, a read-only one (Linux, as root), and files
that may not grow. Each run ends with the right bits, or with a message and exit code 2, and then
continues elsewhere.
"""

import ctypes
import os
import shutil
import subprocess
import sys
import tempfile
import threading
from pathlib import Path

import bits
import kills
from tally import ROOT

SCENE = kills.GRAINS.replace("40000", "4000")
ENVIRONMENT = {**os.environ, "PYTHONPATH": str(ROOT)}
TMPFS, READ_ONLY, REMOUNT = b"tmpfs", 1, 32


def run(count, seed, tally):
    """All of them once."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        os.chmod(folder, 0o777)
        (folder / "scene.yaml").write_text(SCENE)
        code, text = _dust(folder, folder / "whole")
        if code:
            raise RuntimeError(text)
        expected = bits.tree(folder / "whole" / "result.nc")
        for case in CASES:
            label = case.__name__.replace("_", " ")
            try:
                tally.case("places", case(folder, expected), label)
            except _Impossible as error:
                tally.case("not possible here", None, label)
                print(f"  {label}: {error}", flush=True)


class _Impossible(Exception):
    """This machine does not allow the case."""


def _dust(folder, directory, *words, prefix=(), environment=None, **options):
    """(exit code, what was said) of a run of the scene."""
    command = [*prefix, sys.executable, "-m", "dusttaichi", "run", str(folder / "scene.yaml")]
    command += ["-o", str(directory), "-q", *words]
    environment = ENVIRONMENT if environment is None else environment
    process = subprocess.run(command, capture_output=True, text=True, env=environment, **options)
    return process.returncode, process.stdout + process.stderr


def _judge(answer, expected, directory, folder):
    """What went wrong with a run that may have been refused, and goes on from a copy."""
    code, text = answer
    if "Traceback" in text or code not in (0, 2):
        return f"exit code {code}: {text[-600:]}"
    if code == 2:
        if "dust: " not in text:
            return f"no message: {text[-300:]}"
        if not (directory / "result.nc").exists():
            return None
        elsewhere = folder / "elsewhere"
        shutil.rmtree(elsewhere, ignore_errors=True)
        shutil.copytree(directory, elsewhere)
        code, text = _dust(folder, elsewhere, "--resume")
        if code:
            return f"resumed elsewhere: {text[-600:]}"
        directory = elsewhere
    return bits.difference(expected, directory / "result.nc")


class _Disk:
    """A file system of so many bytes in memory at a folder."""

    def __init__(self, folder, size):
        self.place, self.libc = folder, ctypes.CDLL(None, use_errno=True)
        folder.mkdir(exist_ok=True)
        self._mount(0, f"size={size},mode=777")

    def _mount(self, flags, options):
        path = os.fsencode(self.place)
        if self.libc.mount(TMPFS, path, TMPFS, flags, options.encode()):
            raise _Impossible(os.strerror(ctypes.get_errno()))

    def protect(self):
        self._mount(READ_ONLY | REMOUNT, "")

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.libc.umount2(os.fsencode(self.place), 2)


def a_small_disk(folder, expected):
    """Full from the start, or at some time on the way."""
    for size in (20_000, 100_000, 200_000, 400_000, 1_000_000):
        with _Disk(folder / "disk", size) as disk:
            answer = _dust(folder, disk.place / "run")
            if problem := _judge(answer, expected, disk.place / "run", folder):
                return f"{size} bytes: {problem}"
    return None


def a_cache_on_a_full_disk(folder, expected):
    for size in (4096, 100_000):
        with _Disk(folder / "cache", size) as disk:
            environment = ENVIRONMENT | {"XDG_CACHE_HOME": str(disk.place)}
            directory = folder / f"cached{size}"
            answer = _dust(folder, directory, environment=environment)
            if answer[0] or (problem := _judge(answer, expected, directory, folder)):
                return f"{size} bytes: {answer[1][-600:] if answer[0] else problem}"
    return None


def a_read_only_disk(folder, expected):
    """From the start, and from the middle of the run on."""
    with _Disk(folder / "disk", 10_000_000) as disk:
        disk.protect()
        answer = _dust(folder, disk.place / "run")
        if answer[0] != 2 or "read-only" not in answer[1]:
            return f"{answer}"
    with _Disk(folder / "disk", 10_000_000) as disk:
        timer = threading.Timer(2.0, disk.protect)
        timer.start()
        answer = _dust(folder, disk.place / "run")
        timer.join()
        return _judge(answer, expected, disk.place / "run", folder)


def files_that_may_not_grow(folder, expected):
    for blocks in (0, 1, 20, 100):
        directory = folder / f"limited{blocks}"
        prefix = ("sh", "-c", f'ulimit -f {blocks}; exec "$@"', "sh")
        answer = _dust(folder, directory, prefix=prefix)
        if problem := _judge(answer, expected, directory, folder):
            return f"{blocks} blocks: {problem}"
    return None


CASES = (
    a_small_disk,
    a_cache_on_a_full_disk,
    a_read_only_disk,
    files_that_may_not_grow,
)
