"""Runs where the system is not as it should be.

A disk and a cache of one megabyte, of the system (Linux, as root); a read-only one; files that may
not grow; clocks of the day that jump; a processor that is taken away again and again; another user
without a home; several processes that compile the same kernels at once, into a new cache. Each run
ends with the right bits, or with a message and exit code 2, and then goes on elsewhere.
"""

import ctypes
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

import bits
import killed
from tally import ROOT

SCENE = killed.GRAINS.replace("40000", "4000")
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
        whole = bits.tree(folder / "whole" / "result.nc")
        for case in CASES:
            what = case.__name__.replace("_", " ")
            if what not in tally.known:
                try:
                    problem = case(folder, whole)
                except _Impossible as error:
                    tally.case("not possible here", None, what)
                    print(f"  {what}: {error}", flush=True)
                    continue
                tally.case("places", problem, what)


class _Impossible(Exception):
    """This machine does not allow the case."""


def _dust(folder, directory, *words, prefix=(), environment=None, **how):
    """(exit code, what was said) of a run of the scene."""
    command = [*prefix, sys.executable, "-m", "dusttaichi", "run", str(folder / "scene.yaml")]
    command += ["-o", str(directory), "-q", *words]
    environment = ENVIRONMENT if environment is None else environment
    done = subprocess.run(command, capture_output=True, text=True, env=environment, **how)
    return done.returncode, done.stdout + done.stderr


def _judged(answer, whole, directory, folder):
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
    return bits.difference(whole, directory / "result.nc")


class _Disk:
    """A file system of so many bytes in memory at a folder."""

    def __init__(self, place, size):
        self.place, self.libc = place, ctypes.CDLL(None, use_errno=True)
        place.mkdir(exist_ok=True)
        self._mount(0, f"size={size},mode=777")

    def _mount(self, flags, options):
        where = os.fsencode(self.place)
        if self.libc.mount(TMPFS, where, TMPFS, flags, options.encode()):
            raise _Impossible(os.strerror(ctypes.get_errno()))

    def protect(self):
        self._mount(READ_ONLY | REMOUNT, "")

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.libc.umount2(os.fsencode(self.place), 2)


def a_small_disk(folder, whole):
    """Full from the start, or at some time on the way."""
    for size in (20_000, 100_000, 200_000, 400_000, 1_000_000):
        with _Disk(folder / "disk", size) as disk:
            answer = _dust(folder, disk.place / "run")
            if problem := _judged(answer, whole, disk.place / "run", folder):
                return f"{size} bytes: {problem}"
    return None


def a_cache_on_a_full_disk(folder, whole):
    for size in (4096, 100_000):
        with _Disk(folder / "cache", size) as disk:
            environment = ENVIRONMENT | {"XDG_CACHE_HOME": str(disk.place)}
            directory = folder / f"cached{size}"
            answer = _dust(folder, directory, environment=environment)
            if answer[0] or (problem := _judged(answer, whole, directory, folder)):
                return f"{size} bytes: {answer[1][-600:] if answer[0] else problem}"
    return None


def a_read_only_disk(folder, whole):
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
        return _judged(answer, whole, disk.place / "run", folder)


def files_that_may_not_grow(folder, whole):
    for blocks in (0, 1, 20, 100):
        directory = folder / f"limited{blocks}"
        prefix = ("sh", "-c", f'ulimit -f {blocks}; exec "$@"', "sh")
        answer = _dust(folder, directory, prefix=prefix)
        if problem := _judged(answer, whole, directory, folder):
            return f"{blocks} blocks: {problem}"
    return None


JUMPS = r"""
#define _GNU_SOURCE
#include <dlfcn.h>
#include <time.h>
#include <sys/time.h>
static long jump(void) { static long n; return (++n % 7 - 3) * 40000000L; }
int clock_gettime(clockid_t c, struct timespec *t) {
    static int (*real)(clockid_t, struct timespec *);
    if (!real) real = dlsym(RTLD_NEXT, "clock_gettime");
    int found = real(c, t);
    if (c == CLOCK_REALTIME) t->tv_sec += jump();
    return found;
}
"""


def a_clock_that_jumps(folder, whole):
    """The time of the day goes forth and back by years at every look."""
    compiler = shutil.which("cc") or shutil.which("gcc")
    if compiler is None:
        raise _Impossible("there is no compiler")
    (folder / "jumps.c").write_text(JUMPS)
    library = folder / "jumps.so"
    command = [compiler, "-shared", "-fPIC", "-o", library, folder / "jumps.c", "-ldl"]
    subprocess.run(command, check=True)
    environment = ENVIRONMENT | {"LD_PRELOAD": str(library)}
    answer = _dust(folder, folder / "jumps", environment=environment)
    return answer[1][-600:] if answer[0] else _judged(answer, whole, folder / "jumps", folder)


def a_processor_that_is_taken_away(folder, whole):
    """As under a quota: stopped for most of each tenth of a second."""
    command = [sys.executable, "-m", "dusttaichi", "run", "scene.yaml", "-o", "quota", "-q"]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True}
    with subprocess.Popen(command, cwd=folder, env=ENVIRONMENT, **pipes) as process:
        while process.poll() is None:
            process.send_signal(signal.SIGSTOP)
            time.sleep(0.04)
            process.send_signal(signal.SIGCONT)
            time.sleep(0.06)
        text = process.stdout.read()
    answer = process.returncode, text
    return text[-600:] if answer[0] else _judged(answer, whole, folder / "quota", folder)


def another_user_without_a_home(folder, whole):
    """As in a container: a number without a name, no HOME, and a directory of somebody else's."""
    if os.name != "posix" or os.getuid() != 0:
        raise _Impossible("only root can be somebody else")
    kept = {k: v for k, v in ENVIRONMENT.items() if k not in ("HOME", "XDG_CACHE_HOME")}
    who = {"user": 54321, "group": 54321, "extra_groups": [], "cwd": "/", "environment": kept}
    own = folder / "own"
    own.mkdir()
    os.chown(own, 54321, 54321)
    try:
        answer = _dust(folder, own / "run", **who)
    except PermissionError:
        raise _Impossible("another user may not run this Python") from None
    if answer[0] or (problem := _judged(answer, whole, own / "run", folder)):
        return answer[1][-600:] if answer[0] else problem
    foreign = folder / "foreign"
    foreign.mkdir(mode=0o755)
    answer = _dust(folder, foreign / "run", **who)
    return None if answer[0] == 2 and "permission" in answer[1] else f"{answer}"


def several_that_compile_at_once(folder, whole):
    cache = ENVIRONMENT | {"XDG_CACHE_HOME": str(folder / "new cache")}
    found = {}

    def one(number):
        found[number] = _dust(folder, folder / f"at once {number}", environment=cache)

    threads = [threading.Thread(target=one, args=(number,)) for number in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for number, answer in found.items():
        if answer[0] or (problem := _judged(answer, whole, folder / f"at once {number}", folder)):
            return answer[1][-600:] if answer[0] else problem
    return None


CASES = (
    a_small_disk,
    a_cache_on_a_full_disk,
    a_read_only_disk,
    files_that_may_not_grow,
    a_clock_that_jumps,
    a_processor_that_is_taken_away,
    another_user_without_a_home,
    several_that_compile_at_once,
)
