"""Trade of a scene from its plan to the dataset and the figure."""

import shutil
from pathlib import Path

from dusttaichi import files
from dusttaichi.analysis.ensemble import save_ensemble
from dusttaichi.plots import save
from dusttaichi.plots import trade as draw_trade
from dusttaichi.processes import usable_cores
from dusttaichi.studies.trade import report, scenes
from dusttaichi.studies.trade.runner import POINTS, Runner
from dusttaichi.studies.trade.trade import trade


class Watcher:
    """Progress of a trade; this one reports nothing."""

    def log(self, text):
        """Show a line of text."""

    def begin(self, total):
        """Set the number of points that will run."""

    def report(self, label, share):
        """Set the share of a point that is done, None at its end. Called from any thread."""

    def done(self, point, result):
        """Take the PointResult of a finished point."""


def measure(scene, directory, wanted, *, jobs=None, force=False, watcher=None):
    """The Trade of a scene, and the paths of its dataset and figure.

    directory: of the results; it stores finished points, which do not run again. jobs: simultaneous
    processes, by default all cores. force: run all points again. Raises DustError,
    KeyboardInterrupt.
    """
    watcher, directory = watcher or Watcher(), Path(directory)
    base = scenes.base(scene)
    if base.numerics.time_step != "auto" and hasattr(base.numerics, "step_fraction"):
        fraction = scenes.own_fraction(base)
        watcher.log(f"the time step of the scene is {fraction:.3g} of its stiffest period")
    jobs = 1 if scene.numerics.backend != "cpu" else jobs or usable_cores()
    with files.RunLock(directory):
        if force:
            shutil.rmtree(directory / POINTS, ignore_errors=True)
        front, behind, _ = wanted.plan(base)
        watcher.begin(1 + len(front) + len(behind) + 1)
        runner = Runner(base, directory, jobs, report=watcher.report)
        found = trade(
            base,
            lambda points: runner.run(points, done=watcher.done),
            wanted,
            log=watcher.log,
        )
        data = report.dataset(found, scene, scene.source or "", {"jobs": jobs})
        file = directory / "trade.nc"
        save_ensemble(data, file)
    return found, (file, save(draw_trade(data), file.with_suffix(".png")))
