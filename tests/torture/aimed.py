"""Kills at the moments that matter: before and after each rename, and while parts are joined.

Every file of a run comes to its place by a rename, so SIGKILL falls once before and once after
each. The joining is a process of its own: it is killed with the run, or the run alone, or it alone.
Then the result is readable, and the run goes on to the same bits.
"""

import os
import random
import shutil
import signal
import subprocess
import tempfile
import time
from pathlib import Path
from types import SimpleNamespace

import bits
import toy
from tally import run_forked

from dusttaichi.analysis import open_run
from dusttaichi.errors import DustError
from dusttaichi.results import pieces

JOINS = ("the run", "the joining", "both")


def run(count, seed, tally):
    """Every rename of a run of one stage and of two; `count` kills at joinings."""
    toy.prepare()
    toy.with_parts(True)
    with tempfile.TemporaryDirectory() as folder:
        for name in toy.SCENES:
            expected = bits.tree(toy.go(name, Path(folder) / f"{name}-whole") / "result.nc")
            for is_after in (False, True):
                number = 0
                while True:
                    number += 1
                    place = Path(folder) / "renames" / "run"
                    killed, problem = _case(name, place, _at_rename(number, is_after), expected)
                    if not killed:
                        break
                    when = "after" if is_after else "before"
                    tally.case("renames", problem, f"{name}, {when} rename {number}")
            for case in range(count // len(toy.SCENES)):
                rng = random.Random(f"{seed} {name} {case}")
                who, delay = JOINS[case % 3], rng.uniform(0.0, 1.5)
                place = Path(folder) / "joins" / "run"
                _, problem = _case(name, place, _at_join(who, delay), expected)
                tally.case("joins", problem, f"{name}, join {case}, {who} after {delay:.2f} s")


def _case(name, directory, aim, expected):
    """(whether a kill fell, what went wrong then or None) of a run that is killed as `aim` says."""
    shutil.rmtree(directory.parent, ignore_errors=True)
    log = directory.parent.with_suffix(".told")
    alone = (lambda: os.setpgid(0, 0), aim, lambda: toy.go(name, directory))
    status, text = run_forked(log, *alone)  # a DustError where the joining alone was killed
    if status == 0:
        return False, bits.difference(expected, directory / "result.nc")
    return True, text if status == 1 else onward(name, directory, expected)


def onward(name, directory, expected):
    """What is wrong with the result of a run that was ended, and that goes on; None."""
    if (directory / "result.nc").exists():
        try:
            open_run(directory).close()
        except DustError as error:
            return f"not readable: {error}"
    until = time.monotonic() + 10.0  # a joining that has outlived its run holds the lock so long
    while True:
        try:
            toy.go(name, directory, resume=True)
            return bits.difference(expected, directory / "result.nc")
        except DustError as error:
            if "Another run is writing" not in str(error) or time.monotonic() > until:
                return f"resumed: {error}"
            time.sleep(0.1)


def _at_rename(number, is_after):
    """What makes a process kill itself at its so many-th rename."""

    def aim():
        replace, calls = os.replace, 0

        def replaced(*paths):
            nonlocal calls
            calls += 1
            if calls < number:
                return replace(*paths)
            if is_after:
                replace(*paths)
            os.kill(os.getpid(), signal.SIGKILL)

        os.replace = replaced

    return aim


def _at_join(who, delay):
    """What kills a run, the process that joins its parts, or both, while it joins them."""

    def aim():
        def joined(command, *, capture_output, **options):
            pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
            with subprocess.Popen(command, **pipes, **options) as process:
                time.sleep(delay)
                if who != "the run":
                    process.kill()
                if who != "the joining":
                    os.kill(os.getpid(), signal.SIGKILL)
                out, err = process.communicate()
            return subprocess.CompletedProcess(command, process.returncode, out, err)

        pieces.subprocess = SimpleNamespace(run=joined)

    return aim
