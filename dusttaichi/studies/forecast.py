"""Forecast of a scene before it is run: its preview, its study, its steps and their time."""

from __future__ import annotations

from math import inf
from typing import Any

from dusttaichi import method
from dusttaichi.scene import Scene
from dusttaichi.scene.numerics import DRAFT
from dusttaichi.studies import step_times


class Forecast:
    """Forecast of a scene, of several replicas of the first.

    scene: the scene. method: its Method. preview: its Preview; None where the method has none.
    plan: of the study of a scene with a block `collisions`, or None. Both are there after `make`.
    """

    def __init__(self, scene: Scene) -> None:
        if scene.replicas is not None:
            from dusttaichi.studies.sweep_study import list_source_runs

            scene = scene.with_values(list_source_runs(scene, 0))
        self.scene, self.method = scene, method.find_method(scene)
        self.preview: Any = None
        self.plan: Any = None

    def make(self) -> None:
        """Make the sample and its preview, and the plan. Raises DustError where one is refused."""
        if self.method.preview is not None:
            self.preview = self.method.preview(self.scene)
        if getattr(self.scene, "collisions", None) is not None:
            from dusttaichi.studies.collide_plan import plan_of

            self.plan = plan_of(self.scene)

    def sections(self) -> list[tuple[str, Any]]:
        """Sections of the preview, and the errors of a draft."""
        if getattr(self.scene.numerics, "accuracy", None) != DRAFT:
            return list(self.preview.sections)
        from dusttaichi.studies.suggest import list_draft_errors  # with the analysis of results

        errors = list_draft_errors(self.scene)
        return [*self.preview.sections, ("Draft, as measured by dust trade", errors)]

    def step_time(self, *, measure_it: bool) -> tuple[float, float, float]:
        """(least, likely, most) seconds of a step, measured or an order of magnitude."""
        if measure_it:
            return step_times.measure_step_time(self.scene, self.preview.plan)
        size = self.preview.size * self.preview.cost
        return step_times.estimate_step_time(self.scene, size)

    def run_time(self, *, measure_it: bool) -> tuple[float, ...] | None:
        """(least, likely, most) seconds of the steps of the run, or None where it has no end."""
        steps = sum(stage_steps for _, stage_steps, _ in self.preview.plan)
        if steps == inf:
            return None
        return tuple(steps * seconds for seconds in self.step_time(measure_it=measure_it))
