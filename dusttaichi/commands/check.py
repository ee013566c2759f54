"""`dust check` and `dust schema`: a scene before it is run.

The output of `dust check --json` gets further keys with time; existing ones do not change.
"""

import sys
from pathlib import Path
from typing import Annotated

import typer

from dusttaichi import __version__
from dusttaichi.commands import options
from dusttaichi.commands.console import console, say, say_json
from dusttaichi.errors import DustError
from dusttaichi.names import NEVER

FORMAT = "dusttaichi check 1"  # of the JSON
LABEL = 42  # smallest width of the names of numbers
_NOT_KNOWN = [("not available", "the method of this scene has no forces without a step")]


def check(
    file: options.SceneFile,
    *,
    settings: options.Settings = None,
    extensions: options.Extensions = None,
    time: options.flag("--time", "measure the speed again, about ten seconds") = False,
    resolved: options.flag("--scene", "print the YAML with every default") = False,
    internals: options.flag("--internals", "build it: contacts, compiled parts, fields") = False,
    forces: options.flag("--forces", "build it: forces and energies at the start, no step") = False,
    as_json: options.flag("--json", "print numbers for scripts, and nothing else") = False,
):
    """Check a YAML file and describe its scene: sample, contacts, time step, run time."""
    from dusttaichi import method

    def read():
        scene = options.load_scene(file, settings=settings, extensions=extensions)
        how = method.of(scene)
        # the preview may still refuse the scene
        return scene, how, None if how.preview is None else how.preview(scene)

    if as_json:
        try:
            scene, _, preview = read()
        except DustError as error:
            say_json(_json_of_refusal(error))
            raise
        return say_json(_json_of_scene(scene, preview))
    scene, how, preview = read()
    say(f"{scene.name} is a valid scene of the method {scene.method}.")
    if preview is not None:
        _show([*_sections(scene, preview), ("Cost", _cost(scene, preview, measure_it=time))])
    if resolved:
        console.print("\nThe scene resolved", style="bold")
        console.print(scene.to_yaml().rstrip())
    if internals:
        from dusttaichi.compute import engine, processor

        compiler = [*processor.vector_rows(), *engine.rows(scene.numerics.debug)]
        _show([("Processor and compiler", compiler), *how.internals(scene)])
    if forces:
        _show(how.forces(scene) or [("Forces at the start", _NOT_KNOWN)])
    rest = {"--time": time, "--scene": resolved, "--internals": internals, "--forces": forces}
    say(f"\nmore: {', '.join(option for option, there in rest.items() if not there)}")


def _sections(scene, preview):
    """Sections of a preview, and the errors of a draft."""
    from dusttaichi.scene.numerics import DRAFT

    if getattr(scene.numerics, "accuracy", None) != DRAFT:
        return preview.sections
    from dusttaichi.studies.trade.suggest import draft_rows  # with the analysis of results

    return [*preview.sections, ("Draft, as measured by dust trade", draft_rows(scene))]


def _show(sections):
    for title, rows in sections:
        console.print(f"\n{title}", style="bold")
        width = max([LABEL, *(len(what) for what, _ in rows)])
        for what, value in rows:
            say(f"  {what:<{width}} {value}")


def _cost(scene, preview, *, measure_it):
    """Rows of the number of steps and of the run time on this machine."""
    from dusttaichi.scene import quantities
    from dusttaichi.studies import speeds, starts

    if measure_it:
        known = speeds.as_measured(speeds.measure(scene, preview.plan), preview.size)
    else:
        known = speeds.likely(scene, preview.size)
    rows, total = [], 0
    for name, steps, reason in preview.plan:
        what = f"steps at most, stage {name}" if name else "steps at most"
        if steps == NEVER:
            rows.append((what, "not known beforehand: a measured quantity ends the run"))
            total = NEVER
            break
        total += steps
        time = quantities.format(steps * preview.dt * 1e-6, "time", 5)
        rows.append((what, f"{steps:,} ({time}; {reason})"))
    if known is None:
        unknown = "not known: nothing has run on this machine yet; --time measures it"
        return [*rows, *_slow_rows(scene), ("run time", unknown)]
    speed, (least, seconds, most) = known
    of = "this scene" if speed.name == scene.name else speed.name
    source = f"{of}, {speed.size:,} particles on {_threads(speed.threads)}"
    when = "now" if measure_it else "here before"
    rows.append(
        ("speed", f"{quantities.rate_text(1.0 / seconds)} steps/s, measured {when}: {source}")
    )
    cached, start = starts.likely(scene, preview.size)
    rows += _slow_rows(scene)
    what = "kernels are cached" if cached else "kernels are compiled"
    if start is None:
        rows.append(("start and figures", f"not known: no run has ended here where {what}"))
    else:
        rows.append(("start and figures", f"{_duration(start)}, {what}"))
    if total < NEVER:
        low, high = (_duration(total * each + (start or 0.0)) for each in (least, most))
        text = low if low == high else f"{low} to {high}"
        rows.append(("run time at most", text if start is not None else f"{text}, and the start"))
    return rows


def _slow_rows(scene):
    """A row where the compiler does not use all capabilities of this processor."""
    from dusttaichi.compute import processor

    text = processor.warning() if getattr(scene.numerics, "backend", "cpu") == "cpu" else None
    return [] if text is None else [("slower than it could be", text)]


def _threads(number):
    return f"{number} threads" if number > 1 else "one thread"


def _duration(seconds):
    """Text of a time in s, min, h or days."""
    for size, unit in ((1.0, "s"), (60.0, "min"), (3600.0, "h"), (86400.0, "days")):
        if seconds < 100.0 * size or unit == "days":
            return f"{max(seconds / size, 1.0 if unit == 's' else 0.0):.2g} {unit}"


def _json_of_scene(scene, preview):
    """Size, time step, stages, run time on this machine, and rows of text of a valid scene."""
    found = {"format": FORMAT, "version": __version__, "valid": True, "problems": []}
    found |= {"name": scene.name, "method": scene.method}
    if preview is not None:
        found |= {
            "particles": preview.size,
            "time_step_s": preview.dt * 1e-6,
            "stages": [_stage(*stage, preview.dt) for stage in preview.plan],
            "run_time_s": _run_time(scene, preview),
            "text": {title: dict(rows) for title, rows in _sections(scene, preview)},
        }
    return found


def _json_of_refusal(error):
    """Lines of text, one for each fault of a scene, with its path and line."""
    lines = [line.strip() for line in str(error).split("\n")]
    problems = lines[1:] or lines
    return {"format": FORMAT, "version": __version__, "valid": False, "problems": problems}


def _stage(name, steps, reason, dt):
    known = steps < NEVER
    return {
        "name": name,
        "most_steps": int(steps) if known else None,
        "most_time_s": steps * dt * 1e-6 if known else None,
        "ends": reason if known else None,
    }


def _run_time(scene, preview):
    """Seconds of a run from speeds measured on this machine, {least, likely, most}, or None."""
    from dusttaichi.studies import speeds, starts

    known, steps = speeds.likely(scene, preview.size), sum(plan[1] for plan in preview.plan)
    start = starts.likely(scene, preview.size)[1]
    if known is None or start is None or steps >= NEVER:
        return None
    names = ("least", "likely", "most")
    return {name: steps * each + start for name, each in zip(names, known[1], strict=True)}


def schema(
    file: Annotated[
        Path | None, typer.Argument(help="YAML file with extensions to include", metavar="[FILE]")
    ] = None,
    extensions: options.Extensions = None,
):
    """Print the JSON Schema of the YAML, with which editors complete and check it."""
    from dusttaichi.scene import load_extensions, schema_text

    if file is not None:
        with options.importing(extensions):
            load_extensions(file)
    sys.stdout.write(schema_text())
