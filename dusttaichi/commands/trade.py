"""`dust trade`: run time and error of each numerical parameter."""

import shlex
import sys
import threading
from typing import Annotated

import typer

from dusttaichi.commands import options
from dusttaichi.commands.console import err, say, say_table, say_written
from dusttaichi.commands.progress import ProgressBar, shares_text


def trade(
    file: options.SceneFile,
    *,
    parameters: Annotated[
        str | None,
        typer.Option("--knobs", help="only these parameters, by commas", metavar="NAME,NAME"),
    ] = None,
    observable: Annotated[
        str | None, typer.Option(help="the number with the decisive error", metavar="NAME")
    ] = None,
    tolerance: Annotated[str, typer.Option(help="largest error", metavar="SHARE")] = "5%",
    seeds: Annotated[
        int | None, typer.Option(min=1, help="seeds for the scatter: 4, with --quick 2")
    ] = None,
    quick: options.flag("--quick", "three levels of each parameter, two seeds") = False,
    jobs: options.Jobs = None,
    suggest: options.flag("--suggest", "no runs: cheapest settings for such scenes") = False,
    force: options.flag("--force", "run finished points again") = False,
    extensions: options.Extensions = None,
    output: options.Output = None,
    quiet: options.Quiet = False,
):
    """Measure run time and error of each numerical parameter: table, figure, cheapest setting."""
    from dusttaichi.studies.trade import measure
    from dusttaichi.studies.trade.trade import Wanted

    scene = options.load_scene(file, extensions=extensions)
    runs = scene.output.directory
    folder = output or runs.with_name(f"{runs.name}-trade")
    if suggest:
        _suggest(scene)
        return
    wanted = Wanted.of(parameters, quick, seeds=seeds, tolerance=tolerance, name=observable)
    how = {"jobs": jobs, "force": force}
    done = f"finished points are in {folder / measure.POINTS}"
    onward = shlex.join(["dust", *sys.argv[1:]]).replace(" --force", "")
    with (
        options.writing(force=force, inputs=[file]),
        _Shown(quiet) as shown,
        options.resumable(done, onward),
    ):
        found, paths = measure.measure(scene, folder, wanted, watcher=shown, **how)
    _show(found, scene)
    say_written(paths)


def _show(found, scene):
    """Print table and advice of a Trade."""
    from dusttaichi.studies.trade import report

    title, headings, rows = report.table(found)
    say_table(rows, *headings, title=title)
    for line in [*report.refused(found), *report.sentences(found)]:
        say(line)
    for heading, text in report.advice(found, scene):
        say(f"\n{heading}")
        if text:
            say(text)
    say()


def _suggest(scene):
    """Print the output of `--suggest`."""
    from dusttaichi.studies.trade.suggest import kind_of, suggestions

    found = suggestions(scene)
    say(f"cheapest settings measured for {kind_of(scene)}, costs in steps of accuracy: balanced:")
    for own in found:
        say(f"  {own.settings}: {own.text()}")
    if not found:
        say("  none within 5 % or the scatter of seeds: the unchanged scene")


class _Shown(ProgressBar):
    """Progress of all points together; additional runs are counted as they occur."""

    def __init__(self, quiet):
        # without a terminal a bar would be shown at its end only: lines replace it
        super().__init__(quiet or not err.is_terminal)
        self._quiet, self._lines = quiet, not (quiet or err.is_terminal)
        self._total, self._finished, self._running = 0, 0, {}
        self._lock = threading.Lock()

    def log(self, text):
        """Print a line, unless quiet."""
        if not self._quiet:
            super().log(text)

    def begin(self, total):
        """Set the number of points to run."""
        self._total = total

    def report(self, label, share):
        """Set the share of a point that is done, None at its end. Called from any thread."""
        with self._lock:
            if share is None:
                self._running.pop(label, None)
            else:
                self._running[label] = share
            self._show()

    def done(self, point, result):
        """Count a finished point with its PointResult."""
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
