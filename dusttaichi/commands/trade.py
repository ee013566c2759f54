"""`dust trade`: what accuracy costs, knob by knob."""

import shlex
import sys
import threading
from typing import Annotated

import typer

from dusttaichi.commands.console import err, plain_table, say, say_written
from dusttaichi.commands.options import Extensions, Output, Quiet, SceneFile, load_scene, writing
from dusttaichi.commands.progress import ProgressBar, shares_text
from dusttaichi.errors import Interrupted


def trade(
    file: SceneFile,
    *,
    knobs: Annotated[
        str | None, typer.Option(help="only these knobs, by commas", metavar="KNOB,KNOB")
    ] = None,
    observable: Annotated[
        str | None, typer.Option(help="the number whose error decides", metavar="NAME")
    ] = None,
    tolerance: Annotated[str, typer.Option(help="largest error", metavar="SHARE")] = "5%",
    seeds: Annotated[
        int | None, typer.Option(min=1, help="seeds for the scatter: 4, with --quick 2")
    ] = None,
    quick: Annotated[bool, typer.Option("--quick", help="three rungs a knob, two seeds")] = False,
    pairs: Annotated[
        bool, typer.Option(help="run the default beside each point, to compare costs")
    ] = True,
    jobs: Annotated[int | None, typer.Option(min=1, help="processes at a time: all cores")] = None,
    grid: Annotated[
        str | None,
        typer.Option(
            help='every combination of these rungs at every seed: "stiffness_scaling 1 0.1; '
            'mass_scaling 1 4"; several by "|"',
            metavar="RUNGS",
        ),
    ] = None,
    suggest: Annotated[
        bool,
        typer.Option("--suggest", help="no runs: the cheapest settings measured for such scenes"),
    ] = False,
    force: Annotated[bool, typer.Option("--force", help="run kept points again")] = False,
    extensions: Extensions = None,
    output: Output = None,
    quiet: Quiet = False,
):
    """Cost and error of every knob of a scene: table, figure, and the cheapest setting."""
    from dusttaichi.studies.trade import measure

    scene = load_scene(file, extensions=extensions)
    runs = scene.output.directory
    folder = output or runs.with_name(f"{runs.name}-trade")
    if suggest:
        _suggest(scene)
        return
    if grid is not None:
        _grid(scene, folder, grid, seeds or measure.SEEDS, force=force, quiet=quiet, file=file)
        return
    wanted = measure.Wanted.of(knobs, quick, seeds=seeds, tolerance=tolerance, name=observable)
    how = {"jobs": jobs, "pairs": pairs, "force": force}
    with writing(force=force, inputs=[file]), _Shown(quiet) as shown:
        try:
            found, paths = measure.measure(scene, folder, wanted, watcher=shown, **how)
        except KeyboardInterrupt:
            onward = shlex.join(["dust", *sys.argv[1:]]).replace(" --force", "")
            raise Interrupted(
                f"interrupted; the points that are finished are in {folder / measure.POINTS}. "
                f"Go on with: {onward}"
            ) from None
    _tell(found, scene)
    say_written(paths)


def _tell(found, scene):
    """Table and advice of a Trade."""
    from dusttaichi.studies.trade import report

    title, headings, rows = report.table(found)
    table = plain_table(*headings, title=title)
    for row in rows:
        table.add_row(*row)
    say(table)
    for line in [*report.refused(found), *report.sentences(found)]:
        say(line)
    for heading, text in report.advice(found, scene):
        say(f"\n{heading}")
        if text:
            say(text)
    say()


def _suggest(scene):
    """Output of `--suggest`."""
    from dusttaichi.studies.trade.suggest import kind_of, suggestions

    found = suggestions(scene)
    say(f"cheapest settings measured for {kind_of(scene)}, costs in steps of accuracy: balanced:")
    for own in found:
        say(f"  {own.settings}: {own.text()}")
    if not found:
        say("  none within 5 % or the scatter of seeds: the scene as it is")


def _grid(scene, folder, text, seeds, *, force, quiet, file):
    """Output and file of `--grid`."""
    from dusttaichi.analysis.grid import outcomes, read, text_of
    from dusttaichi.plots import save
    from dusttaichi.plots.grid import grid as draw
    from dusttaichi.studies.trade.grid import grid
    from dusttaichi.studies.trade.report import percent

    log = (lambda _: None) if quiet else say
    with writing(force=force, inputs=[file]):
        path = grid(scene, folder, text, seeds, force=force, log=log)
    found = outcomes(read(path))
    title = "steps over those of the scene as it is, and error of the mean of the seeds"
    table = plain_table(*GRID, title=title)
    for own in found:
        if own.refused:
            continue
        numbers = f"{own.cost:.3f}", percent(own.error), percent(own.scatter)
        contacts = f"{own.contacts:.2f}"
        table.add_row(own.settings, text_of(own.observable), *numbers, contacts, str(own.seeds))
    say(table)
    for own in found:
        if own.refused:
            say(f"{own.settings}: {own.refused}")
    say_written([path, save(draw(found), path.with_suffix(".png"))])


GRID = ("settings", "observable", "cost", "error", "scatter", "contacts a grain", "seeds")


class _Shown(ProgressBar):
    """Progress of all points together; what is run in between is counted as it comes."""

    def __init__(self, quiet):
        # where there is no terminal, a bar would be shown at its end only: lines take its place
        super().__init__(quiet or not err.is_terminal)
        self._quiet, self._lines = quiet, not (quiet or err.is_terminal)
        self._total, self._finished, self._running = 0, 0, {}
        self._lock = threading.Lock()

    def log(self, text):
        """Print a line, unless asked to be quiet."""
        if not self._quiet:
            super().log(text)

    def begin(self, total):
        """So many points are to be run."""
        self._total = total

    def report(self, label, share):
        """A point has been done to this share; None at its end. From any thread."""
        with self._lock:
            if share is None:
                self._running.pop(label, None)
            else:
                self._running[label] = share
            self._show()

    def done(self, point, result):
        """A point is finished, with this PointResult."""
        with self._lock:
            self._finished += 1
            self._total = max(self._total, self._finished)
            self._show()
        if self._lines:
            ratio = "" if result.ratio is None else f"cost {result.ratio:.2f}, "
            self.log(f"{self._finished} of {self._total}: {point.label}: {ratio}{result.status}")

    def _show(self):
        what = f"{self._finished} of {self._total} points"
        done = self._finished + sum(self._running.values())
        self.show(what, done, self._total, shares_text(self._running))
