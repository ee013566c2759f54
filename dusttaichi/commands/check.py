"""`dust check` and `dust schema`: what a scene says, before it is run."""

import sys
from pathlib import Path
from typing import Annotated

import typer

from dusttaichi.commands.console import console, say
from dusttaichi.commands.options import Extensions, SceneFile, Settings, importing, load_scene
from dusttaichi.errors import DustError
from dusttaichi.names import NEVER

LABEL = 42  # columns that the names of numbers take at least
_NOT_KNOWN = [("not available", "the method of this scene has no forces without a step")]


def check(
    file: SceneFile,
    *,
    settings: Settings = None,
    extensions: Extensions = None,
    time: Annotated[
        bool, typer.Option("--time", help="measure the speed anew, some ten seconds")
    ] = False,
    resolved: Annotated[
        bool, typer.Option("--scene", help="the YAML with every default written out")
    ] = False,
    internals: Annotated[
        bool, typer.Option("--internals", help="build it: contacts, what is compiled in, fields")
    ] = False,
    forces: Annotated[
        bool, typer.Option("--forces", help="build it: forces and energies of its start, no step")
    ] = False,
    as_json: Annotated[
        bool, typer.Option("--json", help="numbers for scripts, and nothing else")
    ] = False,
):
    """Check a YAML file and say what it is: sample, contacts, time step, cost."""
    from dusttaichi import method
    from dusttaichi.compute import processor

    def read():
        scene = load_scene(file, settings=settings, extensions=extensions)
        how = method.of(scene)
        # which may still refuse it
        return scene, how, None if how.preview is None else how.preview(scene)

    if as_json:
        return _check_as_json(read)
    scene, how, preview = read()
    say(f"{scene.name} is a valid scene of the method {scene.method}.")
    if preview is not None:
        _show([*preview.sections, ("Cost", _cost(scene, preview, measure_it=time))])
    if resolved:
        console.print("\nThe scene resolved", style="bold")
        console.print(scene.to_yaml().rstrip())
    if internals:
        from dusttaichi.compute import engine

        compiler = [*processor.vector_rows(), *engine.rows(scene.numerics.debug)]
        _show([("Processor and compiler", compiler), *how.internals(scene)])
    if forces:
        _show(how.forces(scene) or [("Forces at the start", _NOT_KNOWN)])
    rest = {"--time": time, "--scene": resolved, "--internals": internals, "--forces": forces}
    say(f"\nmore: {', '.join(option for option, there in rest.items() if not there)}")


def _check_as_json(read):
    """Print what `read` returns, or that it refuses the scene. Raises what it raises."""
    from dusttaichi.commands import check_json

    try:
        scene, _, preview = read()
    except DustError as error:
        check_json.print_refusal(error)
        raise
    check_json.print_scene(scene, preview)


def _show(sections):
    for title, rows in sections:
        console.print(f"\n{title}", style="bold")
        width = max([LABEL, *(len(what) for what, _ in rows)])
        for what, value in rows:
            say(f"  {what:<{width}} {value}")


def _cost(scene, preview, *, measure_it):
    """Rows of the steps, and of the time that they and all else take on this machine."""
    from dusttaichi.analysis.texts import rate_text
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
            rows.append((what, "not known beforehand: what is measured ends the run"))
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
    rows.append(("speed", f"{rate_text(1.0 / seconds)} steps/s, measured {when}: {source}"))
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
    """A row where the compiler makes less of this processor than it could."""
    from dusttaichi.compute import processor

    text = processor.warning() if getattr(scene.numerics, "backend", "cpu") == "cpu" else None
    return [] if text is None else [("slower than it could be", text)]


def _threads(number):
    return f"{number} threads" if number > 1 else "one thread"


def _duration(seconds):
    """A time as people say it."""
    for size, unit in ((1.0, "s"), (60.0, "min"), (3600.0, "h"), (86400.0, "days")):
        if seconds < 100.0 * size or unit == "days":
            return f"{max(seconds / size, 1.0 if unit == 's' else 0.0):.2g} {unit}"


def schema(
    file: Annotated[
        Path | None, typer.Argument(help="YAML file whose extensions count", metavar="[FILE]")
    ] = None,
    extensions: Extensions = None,
):
    """Print the JSON Schema of the YAML, for editors that complete and check it."""
    from dusttaichi.scene import load_extensions, schema_text

    if file is not None:
        with importing(extensions):
            load_extensions(file)
    sys.stdout.write(schema_text())
