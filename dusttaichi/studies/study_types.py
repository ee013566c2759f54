"""Studies: their points, results and stages, as study_engine.run takes them."""

from __future__ import annotations

from collections.abc import Generator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from dusttaichi import analysis
from dusttaichi.studies.jobs import Task
from dusttaichi.studies.result_store import ResultStore
from dusttaichi.studies.workers import Answer


class StudyPoint(Protocol):
    """A point of a study: a run (points.Point) or a request (requests.Request).

    Attributes
    ----------
    label
        Its name, other than that of any other point of the study.
    inputs
        Paths of the files that it reads, relative to the current directory.
    """

    @property
    def label(self) -> str: ...

    @property
    def inputs(self) -> Sequence[str]: ...

    def find_answer(self, store: ResultStore) -> Answer | None:
        """Its Answer where it is finished; raises DustError where that must not be overwritten."""

    def save_answer(self, answer: Answer, store: ResultStore) -> None:
        """Store an Answer that came. Raises DustError."""

    def choose_processes(self, count: int, cores: int, *, remote: bool) -> tuple[int, Any]:
        """(processes for `count` points like this on some cores, threads of each)."""

    def to_task(
        self, threads: Any, store: ResultStore, *, remote: bool, execute_options: dict[str, Any]
    ) -> Task:
        """The task for a worker process."""

    def measure_answer(self, study: Study, answer: Answer) -> tuple[Any, float | None]:
        """(numbers for the study, cost [s] if it is timed) of a finished one."""


@dataclass(frozen=True)
class PointResult:
    """Result of a point.

    Attributes
    ----------
    point
    code
        0, that of a DustError (2: refused, 3: stopped by a guard), or 1: the process was lost.
    text
        Why it failed, or "".
    measured
        Numbers that the study measured of the run, or the answer to a request; None if failed.
    cost
        Processor time of its steps [s], if the study is timed.
    """

    point: StudyPoint
    code: int = 0
    text: str = ""
    measured: Any = None
    cost: float | None = None

    @property
    def ok(self) -> bool:
        """True where the run ended regularly."""
        return self.code == 0


class Study(Protocol):
    """Points of a study, and where their results are stored.

    Attributes
    ----------
    directory
        Directory of the results, None of a study that writes none.
    file
        File of the dataset, or None.
    timed
        True where the study needs the processor time of its runs, by this code.
    """

    @property
    def directory(self) -> Path | None: ...

    @property
    def file(self) -> Path | None: ...

    @property
    def timed(self) -> bool: ...

    def points(self, results: Mapping[str, PointResult]) -> Sequence[StudyPoint]:
        """Points of the study, as far as the results by label determine them.

        The study ends where all of them have a result.
        """


class RunStudy(Study, Protocol):
    """Study whose points are runs (points.Point)."""

    def measure(self, run: analysis.Run) -> Any:
        """Numbers of a finished run, `PointResult.measured`."""


class StagedStudy:
    """Study whose points come in stages, each made from the results of those before.

    `stages` is a generator: it yields the points of a stage, and continues once `results`, label ->
    PointResult, has all of them; a stage without missing points runs nothing.
    """

    results: Mapping[str, PointResult]
    _stages: Generator[Sequence[StudyPoint], None, None] | None = None
    _stage: Sequence[StudyPoint] | None = ()

    def stages(self) -> Generator[Sequence[StudyPoint], None, None]:
        """Generator of the lists of points."""
        raise NotImplementedError

    def points(self, results: Mapping[str, PointResult]) -> Sequence[StudyPoint]:
        """Missing points of the present stage; none after the last one."""
        self.results = results
        self._stages = self._stages or self.stages()
        while self._stage is not None:
            if missing := [point for point in self._stage if point.label not in results]:
                return missing
            self._stage = next(self._stages, None)
        return []
