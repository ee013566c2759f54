"""`dust run`: one scene, or its replicas."""

from time import monotonic

from dusttaichi.commands import options
from dusttaichi.commands.console import (
    remark,
    say,
    say_json,
    say_not_drawn,
    say_table,
    say_written,
)
from dusttaichi.commands.ensembles import run_sweep
from dusttaichi.commands.progress import Phases, progress_bar, show_sample
from dusttaichi.commands.report import serve_report
from dusttaichi.commands.study_command import study_command
from dusttaichi.errors import DustError


@study_command(
    omit="part",
    force=(options.flag("--force", "overwrite an existing result"), False),
    resume=(options.flag("--resume", "continue an interrupted run"), False),
)
def run(
    file: options.SceneFile,
    *,
    settings: options.Settings = None,
    watch: options.flag("--watch", "show the run in a browser, as dust watch does") = False,
    verbose: options.Verbose = False,
    run,
):
    """Run a scene: result, figures and a short table."""
    from dusttaichi.running import run_directory
    from dusttaichi.running.interrupts import all_computed

    phases = Phases(verbose)
    scene = run.load_scene(file, settings)
    directory = run_directory(scene, run.output)
    if getattr(scene, "collisions", None) is not None and not run.quiet:
        remark(f"one collision, that of `sample`; all of `collisions`: dust collide {file}")
    if scene.replicas is not None:
        from dusttaichi.studies.sweep_study import replicas

        with run.writing(file):
            run_sweep(replicas(scene, directory), run, verbose=verbose)
        return
    for option, value in (("--scheduler", run.scheduler), ("--jobs", run.jobs)):
        if value is not None:
            raise DustError(f"{option} is for many runs: a scene with replicas, or dust sweep")
    engine_options = {"force": run.force, "resume": run.resume}
    phases.end("imports and scene")
    with serve_report(directory, watch):
        _run_one(scene, directory, quiet=run.quiet, phases=phases, **engine_options)
    with run.writing(file), all_computed(f"Figures: dust plot {directory}"):
        frames = _show_result(directory, run.figures, run.as_json, phases)
    if not (run.quiet or run.as_json):
        _say_next(directory, frames)
    phases.total()


def _run_one(scene, directory, *, quiet, phases, **run_options):
    """Run a scene. run_options: arguments of `execute`."""
    from dusttaichi.running import execute
    from dusttaichi.running.interrupts import resumable
    from dusttaichi.running.progress import show_run

    segments = _Segments(scene, phases)
    hooks = {"sampled": lambda sample: phases.end("sample"), "ready": segments.ready}
    hooks["advancing"] = segments
    with progress_bar(quiet, "building") as bar, show_sample(bar):
        with resumable(options.resume_command("--resume")):
            execute(scene, directory, report=show_run(bar), log=bar.log, **hooks, **run_options)
        phases.end("steps", segments.seconds)
        phases.end("output")


class _Segments:
    """Context around each segment of steps. The first, a single step, compiles the kernels.

    seconds: time of the other segments.
    """

    def __init__(self, scene, phases):
        self._scene, self._phases, self._sim, self.seconds = scene, phases, None, 0.0

    def ready(self, sim):
        self._sim = sim

    def __enter__(self):
        self._began = monotonic()

    def __exit__(self, *error):
        if self._sim is None:
            self.seconds += monotonic() - self._began
        else:
            self._phases.end(_describe_build(self._scene, self._sim))
            self._sim = None


def _describe_build(scene, sim):
    """Output of --verbose about a simulation after its first step."""
    from dusttaichi.scene import quantities

    step = quantities.format(sim.dt * sim.units("s"), "time", digits=4)
    return f"{scene.method}: {sim.size:,} particles, time step {step}, kernels"


def _show_result(directory, draw, as_json, phases):
    """Print the table of a finished run, or its numbers as JSON, and `draw` its figures.

    Returns the number of snapshots.
    """
    from dusttaichi import analysis
    from dusttaichi.analysis.plain import convert_runs

    failed = []
    with analysis.open_run(directory) as result:
        numbers = convert_runs([result]) if as_json else analysis.summarise(result)
        rows = [] if as_json else analysis.tabulate(numbers)
        phases.end("numbers")
        figures = []
        if draw:
            from dusttaichi import plots  # with matplotlib, which other runs do not wait for

            figures = plots.save_figures(result, directory, failed=failed)
            phases.end(f"{len(figures)} figures")
        frame_count = result.snapshot_count
    if as_json:
        say_json(numbers)
    else:
        _say_table(numbers["name"], rows)
    say_written([directory / "result.nc", *figures], remark if as_json else say)
    say_not_drawn(failed)
    return frame_count


def _say_table(name, rows):
    headings = [
        {"header": heading, "no_wrap": heading == " "}  # no label is cut
        for heading in (" ", "run", "literature")
    ]
    shown = 3 if any(literature for _, _, literature in rows) else 2
    say_table((row[:shown] for row in rows), *headings[:shown], title=name, wrap=True)


def _say_next(directory, frames):
    """Print commands for the next steps."""
    film = " --animate" if frames > 2 else ""
    commands = {
        f"dust report {directory}": "interactive report with the particles in 3-D",
        f"dust render {directory}{film}": "a film" if film else "a picture",
        f"dust compare {directory} OTHER": "comparison with other runs",
    }
    width = max(map(len, commands))
    for number, (command, description) in enumerate(commands.items()):
        say(f"{'next:' if number == 0 else '':<6}{command:<{width}}  # {description}")
