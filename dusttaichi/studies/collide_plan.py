"""Plan of a study of collisions: number, time steps, run time, and the limit of the contacts."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import ceil
from typing import TYPE_CHECKING, Any

import numpy as np

from dusttaichi.compute.processor import usable_cores
from dusttaichi.errors import DustError
from dusttaichi.grains.contact_table import ContactTable
from dusttaichi.grains.impacts import Impact, beyond_model, hardest_impact
from dusttaichi.grains.time_step import chosen_step
from dusttaichi.scene import quantities
from dusttaichi.studies.collide import Collisions
from dusttaichi.studies.requests import count_cores
from dusttaichi.studies.step_times import estimate_step_time

if TYPE_CHECKING:
    from dusttaichi.scene import Scene


@dataclass(frozen=True)
class Plan:
    """Size, cost and limits of a study of collisions, before anything is computed.

    sizes: number along each axis. speeds [m/s]. grains: of both bodies, least and most. steps: of
    all collisions at most. seconds: (least, likely, most) processor time of these [s]. processes:
    of the study on this machine. abreast: collisions at most in the simulation of a process, with
    `--batch auto`. impact: the hardest Impact, that of the highest speed. refused: speeds [m/s] at
    which no collision starts, as grains would swallow each other.
    """

    sizes: dict[str, int]
    refine: int
    speeds: tuple[float, ...]
    impacts: tuple[float, ...]
    grains: tuple[int, int]
    steps: int
    seconds: tuple[float, float, float]
    processes: int
    abreast: int
    impact: Impact | None
    refused: tuple[float, ...]

    @property
    def count(self) -> int:
        """Number of collisions, with those of further speeds."""
        sizes = self.sizes | {"speed": self.sizes["speed"] + self.refine}
        return int(np.prod(list(sizes.values())))

    @property
    def wall_time(self) -> tuple[float, ...]:
        """(least, likely, most) time [s] of the collisions on this machine."""
        return tuple(seconds / self.processes for seconds in self.seconds)

    @property
    def beyond(self) -> str:
        """Sentence about speeds beyond the contact model, or ""."""
        return str(beyond_model(self.speeds, self.impact))

    def rows(self) -> list[tuple[str, str]]:
        """Rows (name, value) of text."""
        names = {"body": "bodies", "mass_ratio": "mass ratios", "speed": "speeds"}
        names |= {"impact_parameter": "impact parameters", "seed": "pairs of seeds"}
        factors = [f"{n} {names[name]}" for name, n in self.sizes.items() if n > 1]
        text = f"{self.count:,}" + (f": {' x '.join(factors)}" if factors else "")
        if self.refine:
            text += f", and up to {self.refine} further speeds"
        speeds = [quantities.format(v, "speed", 3) for v in (self.speeds[0], self.speeds[-1])]
        shown = ", ".join(f"{b:.3g}" for b in self.impacts)
        ends = dict.fromkeys(f"{n:,}" for n in self.grains)
        rows = [
            ("collisions", text),
            ("speeds", " to ".join(dict.fromkeys(speeds))),
            ("impact parameters over R1 + R2", shown),
            ("grains of both bodies", " to ".join(ends)),
        ]
        if self.impact is not None:
            rows.append(("two grains may meet", self.impact.text()))
        if self.beyond:
            rows.append(("remark", self.beyond))
        if self.refused:
            slowest = quantities.format(self.refused[0], "speed", 3)
            rows.append(
                ("remark", f"none starts from {slowest} on: grains would swallow each other")
            )
        abreast = f"at most {self.abreast:,} in a process (`dust collide --batch`)"
        rows.append(("side by side", abreast))
        return [*rows, ("steps at most", f"{self.steps:,} of all collisions")]


def plan_of(scene: Scene) -> Plan:
    """The Plan of a scene with a block `collisions`. Makes a sample of each body and mass ratio."""
    study = Collisions(scene, scene.output.directory)
    speeds = tuple(sorted(study.axes["speed"]))
    pairs = len(study.axes["impact_parameter"]) * len(study.axes["seed"])
    grains, impacts, refused = [], [], set()
    steps, seconds = 0, np.zeros(3)
    for sample_scene, sample in study.samples_at(speeds[-1]):
        table, steps_each = ContactTable.for_sample(sample_scene, sample), 0
        impacts.append(hardest_impact(table.extreme_pairs, speeds[-1]))
        grains.append(len(sample))
        for speed in speeds:
            slower = replace(sample, velocities=sample.velocities * (speed / speeds[-1]))
            try:
                dt = chosen_step(table, slower).dt
            except DustError:
                if speed <= impacts[-1].model_end:  # not for its speed
                    raise
                refused.add(speed)
                continue
            stop: Any = sample_scene.stop  # which the checks of the block ask for
            steps_each += ceil((sample.info["gap"] / speed + stop.time) / dt)
        # further speeds are between those of the study
        steps_each = round(steps_each * (1.0 + study.refine / len(speeds)))
        steps += steps_each * pairs
        seconds += np.multiply(estimate_step_time(sample_scene, len(sample)), steps_each * pairs)
    count, cores, batch = len(study.requests()), count_cores(study.base), study.side_by_side
    least, likely, most = seconds.tolist()
    return Plan(
        {name: len(values) for name, values in study.axes.items()},
        study.refine,
        speeds,
        tuple(study.axes["impact_parameter"]),
        (min(grains), max(grains)),
        steps,
        (least, likely, most),
        min(count, max(1, usable_cores() // (cores or usable_cores()))),
        min(count, batch["abreast"], max(1, batch["room"] // min(grains))),
        max(impacts, key=lambda impact: impact.overlap),
        tuple(sorted(refused)),
    )
