"""Every call of a short run that writes fails once, below Python: with ENOSPC, with EIO.

The calls are counted and made to fail by a small library (shim.c) that a C compiler makes and that
is loaded before the C library. ENOSPC lasts, as on a full disk; EIO comes once. Afterwards the
result is readable, the process has ended with a message and no signal, and the run goes on to the
same bits. The joining of the parts, a process of its own, is a run of its own here.
"""

import ctypes
import errno
import os
import shutil
import subprocess
import sys
import tempfile
import traceback
from pathlib import Path

SHIM = Path(__file__).with_name("shim.c")
FOREVER = 2**40
STOPPED, UNTOLD = 42, 43  # exit codes: a DustError, any other exception


def run(count, seed, tally):
    """All calls of all runs; with a count only every so many-th of them."""
    with tempfile.TemporaryDirectory() as folder:
        library = Path(folder) / "shim.so"
        compiler = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
        subprocess.run(
            [compiler, "-shared", "-fPIC", "-O1", "-w", "-o", library, SHIM, "-ldl"], check=True
        )
        known = Path(folder) / "known"
        known.write_text("\n".join(tally.known))
        command = [sys.executable, __file__, folder, str(library), str(count), str(seed)]
        path = os.pathsep.join([*sys.path, os.environ.get("PYTHONPATH", "")])
        environment = {**os.environ, "LD_PRELOAD": str(library), "PYTHONPATH": path}
        with subprocess.Popen(
            command, env=environment, stdout=subprocess.PIPE, text=True
        ) as process:
            for line in process.stdout:
                name, kind, problem = line.rstrip("\n").split("\t")
                tally.case(kind, f"{name}: {problem}" if problem else None, name)
    if process.returncode != 0:
        tally.case("torture itself", f"it ended with status {process.returncode}")


def _inside(folder, library, count, seed):
    """What the process with the library does: forks for each case."""
    import bits
    import toy

    toy.prepare()
    for old, new in (("steps: 200}", "steps: 60}"), ("time: 1 us}", "time: 0.4 us}")):
        toy.SCENES = {n: text.replace(old, new) for n, text in toy.SCENES.items()}
    toy.SCENES["staged"] = toy.SCENES["staged"].replace("steps: 100}", "steps: 40}")
    known = set((Path(folder) / "known").read_text().split("\n"))
    shim = ctypes.CDLL(library)
    folder = Path(folder)
    for name in toy.SCENES:
        whole = toy.go(name, folder / f"{name}-whole", fresh=True) / "result.nc"
        for joins in (False, True):
            toy.with_parts(joins)
            case = folder / "case" / name
            total = _count(shim, name, case, joins)
            step = max(1, total * 4 // count) if count else 1
            for number in range(1 + seed % step, total + 1, step):
                for code, last in ((errno.ENOSPC, FOREVER), (errno.EIO, number)):
                    what = f"{name}{' (join)' if joins else ''}, call {number} of {total}"
                    what += f", {errno.errorcode[code]}"
                    if what in known:
                        continue
                    fault = (number, last, code)
                    problem = _case(shim, name, case, fault, joins, whole, bits) or ""
                    problem = problem.replace("\n", " | ").replace("\t", " ")
                    print(what, errno.errorcode[code], problem, sep="\t", flush=True)


def _set(shim, case, fault, joins):
    """The faults of this process, or of that which joins the parts."""
    first, last, code = fault
    if joins:
        numbers = {"DIR": case.parent, "AT": first, "LAST": last, "ERRNO": code}
        os.environ |= {f"FAULT_{name}": str(value) for name, value in numbers.items()}
    else:
        shim.fault_set(os.fsencode(case.parent), first, last, code)


def _count(shim, name, case, joins):
    """How many calls there are."""
    if joins:
        return 60  # the process has no more, and some of the last come to nothing
    shutil.rmtree(case.parent, ignore_errors=True)
    case.parent.mkdir(parents=True)
    source, target = os.pipe()
    if not (child := os.fork()):
        import toy

        _set(shim, case, (0, 0, 0), joins)
        toy.go(name, case)
        os.write(target, str(shim.fault_calls()).encode())
        os._exit(0)
    os.waitpid(child, 0)
    return int(os.read(source, 100))


def _case(shim, name, case, fault, joins, whole, bits):
    """What went wrong with a fault, or None."""
    import toy

    from dusttaichi.analysis import open_run
    from dusttaichi.errors import DustError

    shutil.rmtree(case.parent, ignore_errors=True)
    case.parent.mkdir(parents=True)
    told = case.parent.parent / "told"
    if not (child := os.fork()):
        code = _child(shim, name, case, fault, joins, told)
        os._exit(code)
    status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    if status < 0:
        return f"ended by signal {-status}"
    text = told.read_text() if status else ""
    if status == UNTOLD:
        return text
    if status == STOPPED and len(text) < 30:
        return f"a message that says little: {text!r}"
    if (case / "result.nc").exists():
        try:
            open_run(case).close()
        except DustError as error:
            return f"not readable: {error}"
    toy.join_here()
    try:
        toy.go(name, case, resume=True)
        bits.assert_same_bits(whole, case / "result.nc")
    except (DustError, AssertionError) as error:
        return f"resumed: {error}"
    finally:
        toy.join_here(False)
    return None


def _child(shim, name, case, fault, joins, told):
    import toy

    from dusttaichi.errors import DustError

    _set(shim, case, fault, joins)
    try:
        toy.go(name, case)
    except DustError as error:
        told.write_text(str(error))
        return STOPPED
    except BaseException:
        told.write_text(traceback.format_exc())
        return UNTOLD
    return 0


if __name__ == "__main__":
    _inside(*sys.argv[1:3], *map(int, sys.argv[3:]))
