"""Kind of a run: whether it compresses, stretches, shears or collides, from its records; drafts."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dusttaichi.analysis.records import Records
from dusttaichi.analysis.tension import find_start_of_tension, is_tensile_test, read_tension
from dusttaichi.physics.geometry import LYING
from dusttaichi.results.datasets import read_at
from dusttaichi.scene.numerics import DRAFT

LEAST_CHANGE = 1e-3
"""Relative change of the filling factor from which a run counts as compressed or stretched."""


class RunKind(Records):
    """Properties of a Run that name its kind; a base class of Run alone."""

    @property
    @abstractmethod
    def parts(self) -> Sequence[RunKind]:
        """The stages that have begun, or the run itself without stages."""

    @property
    def pushes(self) -> list[dict[str, Any]]:
        """Pushes of the scene as dicts: `kind` (as "force"), `grains`, `face`, `size` [m]."""
        pushes: list[dict[str, Any]] = self.sample.get("push", [])
        return pushes

    @property
    def lies(self) -> bool:
        """True for a lying cylinder, between two plates."""
        return bool(self.sample.get("shape") == LYING)

    @property
    def compresses(self) -> bool:
        """True where the filling factor grows (in a stage) under the pressure of a top wall.

        Not of a lying cylinder, whose load is no pressure (configs/diametral).
        """
        return not self.lies and self._does(
            lambda stage: stage.growth > LEAST_CHANGE and stage.has_top_pressure
        )

    @property
    def shrinks(self) -> bool:
        """True where a periodic cell shrinks equally along all axes (in a stage)."""
        return self._does(lambda stage: stage.growth > LEAST_CHANGE and stage._evenly)

    @property
    def stretches(self) -> bool:
        """True where the filling factor falls (in a stage) until there is tension.

        By LEAST_CHANGE, unless the stage ends past the largest tension.
        """
        return self._does(lambda stage: stage._pulls)

    @property
    def unloads(self) -> bool:
        """True where a pressed sample is unloaded (in a stage): it expands under pressure."""
        return self._does(
            lambda stage: stage._record_before is not None and stage._expands_under_pressure
        )

    @property
    def sheared(self) -> bool:
        """True where a stage shears."""
        return bool(np.ptp(np.asarray(self.series.get("shear_strain", [0.0]))) > 0.0)

    @property
    def has_forces(self) -> bool:
        """True where the last snapshot has contacts with their forces."""
        contacts = None if self.tree is None else self.tree.children.get("contacts")
        if contacts is None or "normal_force" not in contacts:
            return False
        frames = self.snapshots
        return frames is not None and int(frames.contact_count.values[-1]) > 0

    @property
    def collides(self) -> bool:
        """True where two bodies collide, with the contacts of at least two snapshots."""
        sample_kind = self.scene.get("sample", {}).get("kind")
        if sample_kind not in ("pair", "collision") or self.boundary != "open":
            return False
        if not self.sample.get("speed") or "contacts" not in getattr(self.tree, "children", ()):
            return False
        return self.snapshot_count > 1

    @property
    def has_sphere(self) -> bool:
        """True where a rigid sphere is among the grains, with more than one record."""
        return "sphere_position" in self.series and len(self.series.time) > 1

    @property
    def intrudes(self) -> bool:
        """True where a rigid body falls on dust (continuum, sample.kind impact)."""
        return "body_position" in self.series and "density" in self.sample.get("projectile", {})

    def bodies(self) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Grains of the two bodies of a run that `collides`: two arrays of numbers."""
        first = self.sample.get("target_grains", 1)
        return np.arange(first), np.arange(first, self.grains)

    def _does(self, condition: Callable[[RunKind], bool]) -> bool:
        return any(map(condition, self.parts))

    @property
    def has_tension(self) -> bool:
        """True where a stress, or the pressure on a top wall, is recorded."""
        return self.has_top_pressure or "stress" in self.series

    @property
    def _pulls(self) -> bool:
        least = 0.0 if is_tensile_test(self) else LEAST_CHANGE
        if not (self.growth < -least and self.has_tension):
            return False
        return find_start_of_tension(read_tension(self)) is not None

    @property
    def _expands_under_pressure(self) -> bool:
        opens = self.growth < 0.0 and self.has_tension
        return opens and not self._pulls and bool(np.nanmean(read_tension(self)) <= 0.0)

    @property
    def growth(self) -> float:
        """Relative growth of the filling factor from the start to the end."""
        if "filling_factor" not in self.series or not len(self.series.time):
            return 0.0
        phi = self.series.filling_factor.values
        first = phi[0] if self._record_before is None else self.start.filling_factor.values
        growth = float(phi[-1] / first) - 1.0
        return growth if np.isfinite(growth) else 0.0

    @property
    def has_top_pressure(self) -> bool:
        """True where the pressure on a top wall is recorded."""
        is_recorded = "pressure" in self.series
        return is_recorded and bool(np.isfinite(read_at(self.series.pressure, wall="top")).any())

    @property
    def _evenly(self) -> bool:
        if not {"box_length", "stress"} <= set(self.series):
            return False
        ratio = self.series.box_length.values[-1] / self.start.box_length.values
        return bool(np.all(np.abs(ratio / ratio[0] - 1.0) < 0.01))  # not for nan either


SLOWEST = 1.0  #: Wall speed [m/s] from which S12 (section 5.2.2) calls a compression dynamic.
STEADY = 0.01  #: Share by which the speed of a steady wall may vary.


def measure_wall_speed(run: Records) -> float:
    """Downward speed [m/s] of the top wall; nan where it changes or is unknown."""
    if "height" not in run.series or run.series.sizes["time"] < 3:
        return np.nan
    height, time = run.series.height.values, run.series.time.values
    if not np.all(np.isfinite(height)) or time[-1] <= time[0]:
        return np.nan
    speed = (height[0] - height[-1]) / (time[-1] - time[0])
    straight = height[0] - speed * (time - time[0])
    travelled = abs(height[0] - height[-1])
    return float(speed) if np.all(np.abs(height - straight) <= STEADY * travelled) else np.nan


def is_dynamic(run: Records) -> bool:
    """True for a cake in a closed box pressed at a constant speed of SLOWEST or more."""
    return (
        run.compresses
        and run.boundary == "box"
        and measure_wall_speed(run) > (1.0 - STEADY) * SLOWEST
    )


def explain_draft(scene: Mapping[str, Any]) -> str:
    """Reason why a run of a resolved scene (plain dicts) is a draft; "" for others."""
    numerics = scene.get("numerics") or {}
    scale = numerics.get("stiffness_scaling", 1.0)
    if numerics.get("accuracy") == DRAFT:
        return DRAFT
    return f"softened, {scale:g}" if isinstance(scale, (int, float)) and scale < 1.0 else ""


def add_draft_reason(name: str, scene: Mapping[str, Any]) -> str:
    """The name of a run, of a draft with the reason in parentheses."""
    text = explain_draft(scene)
    return f"{name} ({text})" if text else name


def warn_of_mixed_drafts(runs: Sequence[Records]) -> str:
    """A sentence where some of several Runs are drafts and others are not; else ""."""
    texts = {run.name: explain_draft(run.scene) for run in runs}
    if len(set(texts.values())) < 2:
        return ""
    drafts = ", ".join(name for name, text in texts.items() if text)
    return (
        f"drafts beside others: {drafts}. Grains of a draft are heavier and softer: differences "
        "within its error, which dust check prints, say nothing about the samples"
    )
