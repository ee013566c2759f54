"""Two runs on one directory, also with the lock file deleted by hand: the second is refused."""

import os
import tempfile
import time
from pathlib import Path

import kills
import toy

from dusttaichi.errors import DustError

HOW = ({}, {"force": True}, {"resume": True})


def run(count, seed, tally):
    """All ways to begin a second run."""
    toy.prepare()
    for delete in (False, True):
        for how in HOW:
            with tempfile.TemporaryDirectory() as folder:
                problem = _second(Path(folder), how, delete)
            name = f"{how}, lock file {'deleted' if delete else 'left'}"
            tally.case("refused", problem, name)


def _second(folder, how, delete):
    """What went wrong with a second run while the first one goes on."""
    directory, lock = folder / "run", folder / "run" / ".lock"
    first = os.fork()
    if not first:
        kills._go("plain", directory, {})
        os._exit(0)
    while not (directory / "result.nc").exists():
        time.sleep(0.01)
    if delete:
        lock.unlink()
    try:
        kills._go("plain", directory, how)
        found = "it was let in"
    except DustError as error:
        found = None if "Another run is writing" in str(error) else str(error)
    status = os.waitstatus_to_exitcode(os.waitpid(first, 0)[1])
    return found or (f"the first one ended with {status}" if status else None)
