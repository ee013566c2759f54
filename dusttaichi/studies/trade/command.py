"""What `dust trade` does: runs, dataset, figure, table, advice."""

import re
import shutil
import threading
from pathlib import Path

from dusttaichi import files
from dusttaichi.analysis.ensemble import save_ensemble
from dusttaichi.commands.progress import progress_bar
from dusttaichi.errors import DustError
from dusttaichi.plots.trade import save_trade
from dusttaichi.studies.ensemble.pool import usable_cores
from dusttaichi.studies.trade import knobs, report, scenes
from dusttaichi.studies.trade.runner import POINTS, Runner
from dusttaichi.studies.trade.trade import plan, trade

QUICK_SEEDS, SEEDS = 2, 4
SHOWN = 3  # running points that the progress bar tells of


def share_of(text):
    """A share from "5%", "5 %" or "0.05". Raises DustError."""
    match = re.fullmatch(r"\s*([\d.eE+-]+)\s*(%?)\s*", text)
    try:
        value = float(match[1]) / (100.0 if match[2] else 1.0)
    except (TypeError, ValueError):
        value = 0.0
    if not 0.0 < value <= 1.0:
        raise DustError(f"--tolerance {text}: a share above 0 and up to 1 is needed, such as 5%")
    return value


def command(
    scene,
    directory,
    *,
    names,
    quick,
    seeds,
    tolerance,
    observable,
    jobs,
    pairs,
    force,
    quiet,
    again,
    console,
    err,
):
    """Measure the trade of a scene into `directory`; prints table and advice.

    again: the command that goes on after an interruption. Raises DustError.
    """
    names, tolerance = knobs.chosen(names), share_of(tolerance)
    seeds = (QUICK_SEEDS if quick else SEEDS) if seeds is None else seeds
    directory = Path(directory)
    base = scenes.base(scene)
    if base.numerics.time_step != "auto":
        fraction = scenes.own_fraction(base)
        console.print(
            f"the time step of the scene is {fraction:.3g} of its stiffest period", soft_wrap=True
        )
    jobs = 1 if scene.numerics.backend != "cpu" else jobs or usable_cores()
    with files.RunLock(directory):
        if force:
            shutil.rmtree(directory / POINTS, ignore_errors=True)
        front, behind, _ = plan(base, names, quick, seeds)
        with _Bar(err, quiet, 1 + len(front) + len(behind)) as bar:
            runner = Runner(base, directory, jobs, pairs, watch=bar.watch)
            try:
                found = trade(
                    base,
                    lambda points: runner.run(points, done=bar.done),
                    names=names,
                    quick=quick,
                    seeds=seeds,
                    tolerance=tolerance,
                    observable=observable,
                    say=bar.say,
                )
            except KeyboardInterrupt:
                raise DustError(
                    f"interrupted; the points that are finished are in {directory / POINTS}. "
                    f"Go on with: {again}"
                ) from None
        pairing = "side by side" if jobs > 1 else "one after the other"
        data = report.dataset(
            found,
            scene,
            scene.source or "",
            {
                "jobs": jobs,
                "pairs": pairing if pairs else "none",
            },
        )
        file = directory / "trade.nc"
        save_ensemble(data, file)
    rows, refused = report.table(found)
    console.print(rows, soft_wrap=True)
    for label, reason in refused:
        console.print(f"{label}: {reason}", markup=False, soft_wrap=True)
    for line in report.sentences(found):
        console.print(line, markup=False, soft_wrap=True)
    for heading, text in report.advice(found, scene):
        console.print(f"\n{heading}", markup=False, soft_wrap=True)
        if text:
            console.print(text, markup=False, soft_wrap=True)
    figure = save_trade(data, file.with_suffix(".png"))
    console.print()
    for path in (file, figure):
        console.print(f"wrote {path}", soft_wrap=True)


class _Bar:
    """Progress of all points together; what is run in between is counted as it comes."""

    def __init__(self, console, quiet, total):
        self.console, self.quiet, self.total = console, quiet, total
        self.bar = progress_bar(console, quiet or not console.is_terminal)
        self.finished, self.running, self.lock = 0, {}, threading.Lock()

    def __enter__(self):
        self.bar.start()
        self.task = self.bar.add_task("", total=self.total, state="")
        return self

    def __exit__(self, *_):
        self.bar.stop()

    def say(self, text):
        if not self.quiet:
            self.console.print(text, markup=False, soft_wrap=True)

    def watch(self, label, share):
        """share: of the point that is done, None at its end."""
        with self.lock:
            if share is None:
                self.running.pop(label, None)
            else:
                self.running[label] = share
            self._show()

    def done(self, point, outcome):
        with self.lock:
            self.finished += 1
            self.total = max(self.total, self.finished)
            self._show()
        if not (self.quiet or self.console.is_terminal):  # a bar would be shown at its end only
            ratio = "" if outcome.ratio is None else f"cost {outcome.ratio:.2f}, "
            self.say(f"{self.finished} of {self.total}: {point.label}: {ratio}{outcome.status}")

    def _show(self):
        shown = [f"{label} {share:.0%}" for label, share in list(self.running.items())[:SHOWN]]
        self.bar.update(
            self.task,
            description=f"{self.finished} of {self.total} points",
            total=self.total,
            completed=self.finished + sum(self.running.values()),
            state="  ".join(shown),
        )
