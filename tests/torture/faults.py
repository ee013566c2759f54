"""Every call of a short run that writes fails, below Python: with ENOSPC, with EIO.

The calls are counted and made to fail by a small library (shim.c) that a C compiler makes and that
is loaded before the C library. ENOSPC lasts, as on a full disk; EIO comes once. Afterwards the
result is readable, the process has ended with a message and no signal (that which joins the parts
may end by one), and the run goes on to the same bits. The runs are of one stage and of two, in one
file and in parts, which are joined. With a count only every so many-th call is tried.
"""

import ctypes
import errno
import json
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

SHIM = Path(__file__).with_name("shim.c")
FOREVER = 2**40


def run(count, seed, tally):
    """All calls of all runs; with a count only every so many-th of them."""
    memory = Path("/dev/shm")  # where it is enough that the system takes the calls
    with tempfile.TemporaryDirectory(dir=memory if memory.is_dir() else None) as folder:
        library = Path(folder) / "shim.so"
        compiler = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
        subprocess.run(
            [compiler, "-shared", "-fPIC", "-O1", "-w", "-o", library, SHIM, "-ldl"], check=True
        )
        command = [sys.executable, __file__, folder, str(library), str(count), str(seed)]
        path = os.pathsep.join([*sys.path, os.environ.get("PYTHONPATH", "")])
        environment = {**os.environ, "LD_PRELOAD": str(library), "PYTHONPATH": path}
        with subprocess.Popen(
            command, env=environment, stdout=subprocess.PIPE, text=True
        ) as process:
            for line in process.stdout:
                if not line.startswith("["):
                    print(f"  said below Python: {line}", end="")
                    continue
                name, outcome_kind, problem = json.loads(line)
                tally.case(outcome_kind, problem, name)
    if process.returncode != 0:
        tally.case("torture itself", f"it ended with status {process.returncode}")


def _inside(folder, library, count, seed):
    """What the process with the library does: forks for each case."""
    import bits
    import toy

    toy.prepare()
    toy.join_here()
    # a run looks at the clock every twenty steps
    options = {"series": 20, "snapshots": 20, "checkpoint": "1 us"}
    toy.SCENES["plain"] = toy.plain(40, **options)
    toy.SCENES["staged"] = toy.make_staged(until="0.2 us", on=20, every="0.1 us", **options)
    folder, shim = Path(folder), ctypes.CDLL(library)
    for name in toy.SCENES:
        expected = bits.tree(toy.go(name, folder / f"{name}-whole") / "result.nc")
        for in_parts in (False, True):
            toy.with_parts(in_parts)
            case = folder / "case" / name
            _run(shim, name, case, (0, 0, 0))
            total = shim.fault_calls()
            step = max(1, total * 4 // count) if count else 1
            for number in range(1 + seed % step, total + 1, step):
                for code, last in ((errno.ENOSPC, FOREVER), (errno.EIO, number)):
                    label = f"{name}{' in in_parts' if in_parts else ''}, call {number} of {total}"
                    label += f", {errno.errorcode[code]}"
                    problem = _case(shim, name, case, (number, last, code), expected) or ""
                    print(json.dumps([label, errno.errorcode[code], problem]), flush=True)


def _run(shim, name, case, fault):
    """The run, from the beginning and with a fault: (exit status, what it said)."""
    import toy
    from tally import run_forked

    shutil.rmtree(case.parent, ignore_errors=True)
    case.parent.mkdir(parents=True)
    shim.fault_set(os.fsencode(case.parent), *map(ctypes.c_long, fault[:2]), fault[2])
    return run_forked(case.parent.parent / "told", lambda: toy.go(name, case))


def _case(shim, name, case, fault, expected):
    """What went wrong with a fault, or None."""
    from aimed import onward

    status, text = _run(shim, name, case, fault)
    shim.fault_set(b"", *map(ctypes.c_long, (0, 0)), 0)
    if status < 0:
        return f"ended by signal {-status}"
    if status == 1:
        return text
    if status > 1 and len(text) < 30:
        return f"a message that says little: {text!r}"
    return onward(name, case, expected)


if __name__ == "__main__":
    _inside(*sys.argv[1:3], *map(int, sys.argv[3:]))
