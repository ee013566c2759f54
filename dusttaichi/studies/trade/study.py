"""The trade of a scene as a study of the engine: its points one after the other."""

import re
from dataclasses import replace
from pathlib import Path

from dusttaichi import analysis
from dusttaichi.analysis import observables
from dusttaichi.errors import DustError
from dusttaichi.studies import points
from dusttaichi.studies.trade import report, scenes
from dusttaichi.studies.trade.point import PointResult
from dusttaichi.studies.trade.trade import DEFAULT, trade

LONGEST = 120  # characters of a directory's name


class Missing(Exception):
    """Points (engine) that have not been found yet."""


class TradeStudy:
    """Study of the points of a trade.

    The trade is computed from the results that are there, until one is missing: what it asks for
    depends on the errors and costs of all points before. found: the Trade, once all are there.
    """

    timed = True  # costs are those of this code

    def __init__(self, scene, directory, wanted, *, threads=1, jobs=None, log=lambda text: None):
        self.given, self.scene, self.wanted = scene, scenes.base(scene, threads), wanted
        self.directory, self.jobs, self.log = Path(directory), jobs, log
        self.found, self._labels, self._said = None, {}, set()

    @property
    def file(self):
        """File of the dataset."""
        return self.directory / "trade.nc"

    def points(self, found):
        """The points whose results are missing."""
        try:
            self.found = trade(
                self.scene,
                lambda some: self._results(some, found),
                self.wanted,
                log=self._say,
            )
        except Missing as missing:
            return missing.args[0]
        return []

    def measure(self, run):
        """The PointResult of a run, without its cost."""
        return PointResult(
            0,
            run.status,
            steps=int(run.series.step[-1]),
            time_step=float(run.attrs["time_step"]),
            ledger=analysis.ledger(run).worst,
            measured=observables.measured(run),
        )

    def dataset(self, found):
        """The dataset of the trade."""
        numbers = {} if self.jobs is None else {"jobs": self.jobs}
        return report.dataset(self.found, self.given, numbers)

    def _results(self, some, found):
        """label -> PointResult of points; equal scenes run once. Raises Missing."""
        results, missing = {}, {}
        for point in some:
            try:
                scene = scenes.changed(self.scene, point.changes)
            except DustError as error:
                results[point.label] = PointResult(2, _one_line(error))
                continue
            label = self._first_of(point, scene)
            if label in found:
                results[point.label] = self._result(found[label], found)
            elif label not in missing:
                missing[label] = points.Point.of(scene, self.directory, label, snapshots=True)
        if missing:
            raise Missing(list(missing.values()))
        return results

    def _first_of(self, point, scene):
        """Label of the run of a point: that of the first one with the same scene."""
        own = re.sub(r"[^\w.+,=-]+", "_", point.label)[:LONGEST]
        return own if point.again else self._labels.setdefault(scene.to_yaml(), own)

    def _result(self, one, found):
        """The PointResult of a Found, with its cost over that of the default."""
        if not one.ok:
            return PointResult(one.code, _one_line(one.text))
        default = found[DEFAULT.label].cost
        ratio = one.cost / default if default else None
        return replace(one.measured, cost=one.cost, ratio=ratio)

    def _say(self, text):
        """Log a line once, as the trade is computed several times."""
        if text not in self._said:
            self._said.add(text)
            self.log(text)


def _one_line(text):
    return " ".join(str(text).split())
