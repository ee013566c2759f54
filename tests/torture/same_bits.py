"""The same bits whatever surrounds a run: threads, terminal, locale, home, width, `TI_*` variables.

Every way is `dust run` of a small scene in a process of its own, compared with the first.
"""

import os
import pty
import subprocess
import sys
import tempfile
from pathlib import Path

from bits import difference
from tally import ROOT

SCENE = """
name: bits
material: silicate_s12
interaction: {rolling: on}
sample: {kind: bcca, grains: 256, seed: 2}
boundary: {kind: box, size: fit, wall_speed: 1 m/s}
stop: {steps: 60}
output: {series: {steps: 10}, snapshots: {steps: 20}}
"""


def run(count, seed, tally):
    """All ways."""
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        (folder / "scene.yaml").write_text(SCENE)
        home = folder / "home"
        home.mkdir()
        home.chmod(0o500)
        ways = {
            "1 thread": {},
            "2 threads": {"threads": 2},
            "4 threads": {"threads": 4},
            "a terminal": {"terminal": True},
            "LANG=C": {"LANG": "C", "LC_ALL": "C"},
            "a read-only home": {"HOME": str(home), "XDG_CACHE_HOME": str(home / "cache")},
            "a narrow window": {"terminal": True, "COLUMNS": "20", "LINES": "5"},
            "foreign TI_*": {"TI_ARCH": "vulkan", "TI_DEBUG": "1", "TI_DEFAULT_FP": "f32"},
        }
        # the first is what the others are compared with
        for name, way in ways.items():
            if name != "1 thread" and name in tally.known:
                continue
            problem = _go(folder, name.replace(" ", "_"), dict(way))
            if problem is None and name != "1 thread":
                problem = difference(folder / "1_thread/result.nc", _result(folder, name))
            if name not in tally.known:
                tally.case(name, problem, name)


def _result(folder, name):
    return folder / name.replace(" ", "_") / "result.nc"


def _go(folder, name, way):
    """Run the scene in this way; what went wrong, or None."""
    threads, terminal = str(way.pop("threads", 1)), way.pop("terminal", False)
    command = [sys.executable, "-m", "dusttaichi", "run", "scene.yaml", "-o", name]
    environment = {**os.environ, "PYTHONPATH": str(ROOT), **way}
    how = {"cwd": folder, "env": environment}
    if not terminal:
        done = subprocess.run([*command, "--threads", threads], capture_output=True, **how)
        said = done.stdout + done.stderr
    else:
        ours, theirs = pty.openpty()
        with subprocess.Popen(
            [*command, "--threads", threads], stdout=theirs, stderr=theirs, stdin=theirs, **how
        ) as done:
            os.close(theirs)
            said = _all_of(ours)
    if done.returncode or b"Traceback" in said:
        return said.decode(errors="replace")[-500:]
    return None


def _all_of(terminal):
    said = b""
    while True:
        try:
            chunk = os.read(terminal, 4096)
        except OSError:  # the other side is closed
            return said
        if not chunk:
            return said
        said += chunk
