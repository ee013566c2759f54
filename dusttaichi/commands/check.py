"""`dust check` and `dust schema`: a scene before it is run.

The output of `dust check --json` gets further keys with time; existing ones do not change.
"""

import sys
from math import inf
from pathlib import Path
from typing import Annotated

import typer

from dusttaichi.commands import options
from dusttaichi.commands.console import console, remark, say, say_json
from dusttaichi.commands.progress import progress_bar, show_sample
from dusttaichi.compute.version import __version__
from dusttaichi.errors import DustError

FORMAT = "dusttaichi check 1"  # of the JSON
STUDY = "dust collide"  # command of a scene with a block `collisions`
ORDER = ("least", "likely", "most")  # of a run time
SLOW = 5.0  # s of a sample, from which on its cost is stated before it is made
LABEL = 42  # smallest width of the names of numbers
_NOT_KNOWN = [("not available", "the method of this scene has no forces without a step")]


def check(
    file: options.SceneFile,
    *,
    settings: options.Settings = None,
    extensions: options.Extensions = None,
    time: options.flag("--time", "measure the speed, about ten seconds") = False,
    resolved: options.flag("--scene", "print the YAML with every default") = False,
    internals: options.flag("--internals", "build it: contacts, compiled parts, fields") = False,
    forces: options.flag("--forces", "build it: forces and energies at the start, no step") = False,
    as_json: options.flag("--json", "print numbers for scripts, and nothing else") = False,
):
    """Check a YAML file and describe its scene.

    Sample, contacts, time step, and an order of magnitude of the run time.
    """
    from dusttaichi.studies.forecast import Forecast

    def read():
        scene = options.load_scene(file, settings=settings, extensions=extensions)
        forecast = Forecast(scene)
        _remark_on_costs(forecast.scene)
        with progress_bar(as_json) as bar, show_sample(bar):
            forecast.make()
        return forecast

    if as_json:
        try:
            forecast = read()
        except DustError as error:
            say_json(_json_of_refusal(error))
            raise
        return say_json(_json_of_scene(forecast, measure_it=time))
    forecast = read()
    scene, plan = forecast.scene, forecast.plan
    say(f"{scene.name} is a valid scene (method: {scene.method}).")
    if plan is not None:
        say(f"{STUDY} runs the {plan.count:,} collisions of the last section; the other sections")
        say("describe the single collision of `sample`, which dust run simulates.")
    if forecast.preview is not None:
        _show([*forecast.sections(), ("Cost", _cost(forecast, measure_it=time))])
    if plan is not None:
        _show([(f"Study, by {STUDY}", [*plan.rows(), *_study_time(plan)])])
    if resolved:
        console.print("\nThe scene resolved", style="bold")
        console.print(scene.to_yaml().rstrip())
    if internals:
        from dusttaichi.compute import processor
        from dusttaichi.compute.taichi_internals import source_reading

        compiler = [("processor", processor.model()), *source_reading.rows(scene.numerics.debug)]
        _show([("Processor and compiler", compiler), *forecast.method.internals(scene)])
    if forces:
        _show(forecast.method.forces(scene) or [("Forces at the start", _NOT_KNOWN)])
    sections_by_option = {
        "--time": time,
        "--scene": resolved,
        "--internals": internals,
        "--forces": forces,
    }
    further = (option for option, is_shown in sections_by_option.items() if not is_shown)
    say(f"\nmore: {', '.join(further)}")


def _remark_on_costs(scene):
    """Remark before a slow sample is made how long it takes, and how its time grows."""
    costs = getattr(getattr(scene, "sample", None), "costs", None)
    for name, cost in ({} if costs is None else costs(scene)).items():
        if cost.seconds > SLOW:
            remark(
                f"{name}: making this sample takes about {_duration(cost.seconds)}; the time "
                f"grows as {cost.growth}, N the number of particles."
            )


def _study_time(plan):
    """Rows of the run time of a study on this machine."""
    low, _, high = (_duration(seconds) for seconds in plan.wall_time)
    jobs = f"in {plan.processes} processes" if plan.processes > 1 else "in a process"
    text = "a collision ends as soon as its fragments no longer change"
    return [("run time at most", f"{low} to {high}, {jobs}; {text}")]


def _json_of_plan(plan):
    return {
        "command": STUDY,
        "runs": plan.count,
        "most_steps": plan.steps,
        "run_time_s": dict(zip(ORDER, plan.wall_time, strict=True)),
        "text": dict(plan.rows()),
    }


def _show(sections):
    for title, rows in sections:
        console.print(f"\n{title}", style="bold")
        width = max([LABEL, *(len(label) for label, _ in rows)])
        for label, value in rows:
            say(f"  {label:<{width}} {value}")


def _cost(forecast, *, measure_it):
    """Rows of the number of steps and of the run time on this machine."""
    from dusttaichi.scene import quantities

    preview, rows, total = forecast.preview, [], 0
    for name, steps, reason in preview.plan:
        label = f"steps at most, stage {name}" if name else "steps at most"
        if steps == inf:
            rows.append((label, "not known in advance: a measured quantity ends the run"))
            total = inf
            break
        total += steps
        time = quantities.format(steps * preview.dt, "time", 5)
        text = f"{steps:,} = {time}, until {reason}"
        rows.append((label, text if steps else f"0: {reason} is reached at the start"))
    shortest, seconds, longest = forecast.step_time(measure_it=measure_it)
    rate = 1.0 / seconds if measure_it else float(f"{1.0 / seconds:.1g}")
    speed = f"{quantities.format_rate(rate)} steps/s"
    source = "measured now" if measure_it else "within an order of magnitude; --time measures it"
    rows += [("speed", f"{speed}, {source}")]
    if total < inf:
        low, high = _duration(total * shortest), _duration(total * longest)
        text = low if low == high else f"{low} to {high}"
        rows.append(("run time at most", f"{text}, plus start-up"))
    return rows


def _duration(seconds):
    """Text of a time in s, min, h or days."""
    for size, unit in ((1.0, "s"), (60.0, "min"), (3600.0, "h"), (86400.0, "days")):
        if seconds < 100.0 * size or unit == "days":
            return f"{max(seconds / size, 1.0 if unit == 's' else 0.0):.2g} {unit}"


def _json_of_scene(forecast, *, measure_it):
    """Size, time step, stages, run time on this machine, and rows of text of a valid scene."""
    scene, preview = forecast.scene, forecast.preview
    numbers = {"format": FORMAT, "version": __version__, "valid": True, "problems": []}
    numbers |= {"name": scene.name, "method": scene.method}
    if preview is not None:
        run_time = forecast.run_time(measure_it=measure_it)
        numbers |= {
            "particles": preview.size,
            "time_step_s": preview.dt,
            "stages": [_stage(*stage, preview.dt) for stage in preview.plan],
            "run_time_s": run_time and dict(zip(ORDER, run_time, strict=True)),
            "text": {title: dict(rows) for title, rows in forecast.sections()},
        }
    if forecast.plan is not None:
        numbers["study"] = _json_of_plan(forecast.plan)
    return numbers


def _json_of_refusal(error):
    """Lines of text, one for each fault of a scene, with its path and line."""
    lines = [line.strip() for line in str(error).split("\n")]
    problems = lines[1:] or lines
    return {"format": FORMAT, "version": __version__, "valid": False, "problems": problems}


def _stage(name, steps, reason, dt):
    is_limited = steps < inf
    return {
        "name": name,
        "most_steps": int(steps) if is_limited else None,
        "most_time_s": steps * dt if is_limited else None,
        "ends": reason if is_limited else None,
    }


def schema(
    file: Annotated[
        Path | None, typer.Argument(help="YAML file with extensions to include", metavar="[FILE]")
    ] = None,
    extensions: options.Extensions = None,
):
    """Print the JSON Schema of the YAML, for editors.

    Editors complete and check a scene with it.
    """
    from dusttaichi.scene import load_extensions, schema_text

    if file is not None:
        with options.importing(extensions):
            load_extensions(file)
    sys.stdout.write(schema_text())
