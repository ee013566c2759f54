"""Output of `dust check --json`: a scene in numbers, for scripts. Keys are added, not changed."""

import json
import sys

from dusttaichi import __version__
from dusttaichi.errors import DustError
from dusttaichi.names import NEVER

FORMAT = "dusttaichi check 1"


def print_scene(scene, preview):
    """A valid scene: its size, its step, its stages, its run time on this machine, and the rows of
    text of `dust check`."""
    found = {"format": FORMAT, "version": __version__, "valid": True, "problems": []}
    found |= {"name": scene.name, "method": scene.method}
    if preview is not None:
        found |= {
            "particles": preview.size,
            "time_step_s": preview.dt * 1e-6,
            "stages": [_stage(*stage, preview.dt) for stage in preview.plan],
            "run_time_s": _run_time(scene, preview),
            "text": {title: dict(rows) for title, rows in preview.sections},
        }
    _print(found)


def print_refusal(error: DustError):
    """A scene that cannot be used: a line of text for each problem, with its path and line."""
    lines = [line.strip() for line in str(error).split("\n")]
    problems = lines[1:] or lines
    _print({"format": FORMAT, "version": __version__, "valid": False, "problems": problems})


def _stage(name, steps, reason, dt):
    known = steps < NEVER
    return {
        "name": name,
        "most_steps": int(steps) if known else None,
        "most_time_s": steps * dt * 1e-6 if known else None,
        "ends": reason if known else None,
    }


def _run_time(scene, preview):
    """Seconds of a run by what this machine has measured, {least, likely, most}; None where that is
    not known."""
    from dusttaichi.studies import speeds, starts

    known, steps = speeds.likely(scene, preview.size), sum(plan[1] for plan in preview.plan)
    start = starts.likely(scene, preview.size)[1]
    if known is None or start is None or steps >= NEVER:
        return None
    names = ("least", "likely", "most")
    return {name: steps * each + start for name, each in zip(names, known[1], strict=True)}


def _print(found):
    json.dump(found, sys.stdout, ensure_ascii=False, indent=2, allow_nan=False)
    sys.stdout.write("\n")
