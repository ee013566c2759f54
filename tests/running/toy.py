"""Runs that cost nothing: those of the spring (spring.py), with and without stages."""

import os
import subprocess
import traceback
from types import SimpleNamespace

import spring

from dusttaichi import method
from dusttaichi.results import pieces, writer
from dusttaichi.running import execute, loop
from dusttaichi.scene import from_yaml

_HEAD = """
name: spring
method: spring
boundary: {{kind: open}}
{rest}
numerics: {{time_step: 10 ns}}
output: {{series: {{steps: {series}}}, snapshots: {{steps: {snapshots}}}, checkpoint: {checkpoint}}}
"""


def plain(steps=2000, series=100, snapshots=250, checkpoint="1000 s"):
    """A scene of one stage."""
    options = {"series": series, "snapshots": snapshots, "checkpoint": checkpoint}
    return _HEAD.format(rest=f"stop: {{steps: {steps}}}\nstiffness: 4.0", **options)


def make_staged(
    *, until="7 us", on=1000, every="1 us", series=90, snapshots=100, checkpoint="1000 s"
):
    """A scene of two stages: until a time, and of so many steps with a series of its own."""
    stages = (
        "stages:",
        f"  - {{name: swing, stop: {{time: {until}}}}}",
        f"  - {{name: on, stop: {{steps: {on}}}, output: {{series: {{time: {every}}}}}}}",
    )
    options = {"series": series, "snapshots": snapshots, "checkpoint": checkpoint}
    return _HEAD.format(rest="\n".join(stages), **options)


SCENES = {
    "plain": plain(steps=200, series=5, snapshots=20, checkpoint="1 us"),
    "staged": make_staged(
        until="1 us", on=100, every="0.1 us", series=10, snapshots=20, checkpoint="1 us"
    ),
}


def prepare():
    """The method is known, and the run looks at the clock every twenty steps."""
    method.register(spring.METHOD)
    loop.BURST_SECONDS = 0.0


def with_parts(small):
    """Whether a result has many parts, or is one file throughout."""
    writer.PIECE = 30_000 if small else 10**9


def join_here():
    """Parts are joined in a process that forks from this one: a second less each time."""
    pieces.subprocess = SimpleNamespace(run=_run_forked)


def _run_forked(command, **_):
    """What subprocess.run says of a process that joins parts."""
    source, target = os.pipe()
    if not (child := os.fork()):
        text, code = "", 1
        try:
            pieces.main(command[-2:])
            code = 0
        except SystemExit as stop:
            text = str(stop)
        except BaseException:
            text = traceback.format_exc()
        os.write(target, text.encode())
        os._exit(code)
    os.close(target)
    with open(source, encoding="utf-8") as pipe:
        text = pipe.read()
    status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    return subprocess.CompletedProcess(command, status, "", text)


def go(name, directory, **options):
    """Run one of the scenes into a directory."""
    return execute(from_yaml(SCENES[name]), directory, **options)
