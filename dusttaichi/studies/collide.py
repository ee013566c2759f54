"""`dust collide`: one collision at many speeds, impact parameters, mass ratios, bodies and seeds.

Collisions are requests of the engine: at a thousand grains a step costs as much for each grain as
in one large scene, and each collision has its own ledger and ends when its fragments no longer
change.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from copy import deepcopy
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from dusttaichi import samples
from dusttaichi.analysis.collisions import build_collisions_dataset
from dusttaichi.analysis.threshold_tables import build_threshold_variables
from dusttaichi.analysis.thresholds import find_growth_bracket, find_thresholds
from dusttaichi.errors import DustError
from dusttaichi.grains.collision_parameters import MOST
from dusttaichi.results.plain import plain
from dusttaichi.results.provenance import describe_study
from dusttaichi.samples.sample import memory
from dusttaichi.scene import Scene, quantities
from dusttaichi.studies.points import read_result_keys
from dusttaichi.studies.requests import Request, count_cores, make_key
from dusttaichi.studies.scene_settings import (
    find_keys,
    make_files_relative,
    make_portable,
    replace_run_directories,
    set_one_thread,
    shift_seeds,
)
from dusttaichi.studies.step_times import estimate_step_terms

if TYPE_CHECKING:
    import xarray as xr

    from dusttaichi.samples import Sample
    from dusttaichi.studies.study_types import PointResult


OTHER = 1_000_000  # added to the seed of a projectile whose block is that of the target
SAMPLE = "sample"  # name of the bodies where the study names none
NARROW = 1.02  # ratio of two speeds below which an interval is not halved any more
# `batch: auto`: share of a step that does not depend on the number of grains (`python -m benchmarks
# collisions`)
FIXED = 0.01
# share of the memory that collisions side by side take at most, and that of a grain [bytes]
MEMORY, GRAIN = 0.25, 2000
LARGEST = 10_000_000  # grains side by side
TASK = "dusttaichi.studies.collide_task:run"


class Collisions:
    """Study of all collisions of a scene, with further speeds where the growth efficiency ends.

    Raises DustError where the scene has no block `collisions`.

    Attributes
    ----------
    scene
        With the block `collisions`; `base` is without it.
    side_by_side
        Result of that function.
    axes
        Name of a dimension -> values, in the order of the indices; speeds [m/s].
    """

    timed = False

    def __init__(self, scene: Scene, directory: Path, batch: int | str = "auto") -> None:
        study_block = getattr(scene, "collisions", None)
        if study_block is None:
            raise DustError(
                f"{scene.name} has no block `collisions`, which says what to vary; for example "
                "collisions: {speed: [10 m/s, 30 m/s], impact_parameter: [0], seeds: 3} "
                "(`dust new collide` writes a file)"
            )
        self.scene, self.directory, self._added = scene, Path(directory), 0
        self._block = study_block
        data = set_one_thread(scene.plain)
        data.pop("collisions")
        data.pop("replicas", None)
        self._templates = _templates(data["sample"], study_block)
        self.axes: dict[str, tuple[Any, ...]] = {
            "body": tuple(self._templates),
            "mass_ratio": study_block.mass_ratio,
            "speed": study_block.speeds,
            "impact_parameter": study_block.impacts,
            "seed": tuple(range(study_block.seeds)),
        }
        bodies = [path for block in self._templates.values() for path in make_files_relative(block)]
        self._inputs = tuple(sorted({*make_portable(data), *replace_run_directories(bodies)}))
        for sample in self._templates.values():  # a filling factor that a body does not allow
            Scene.from_dict(data | {"sample": sample}, title="the scene of the study")
        self.base = Scene.from_dict(data, title="the scene of the study")
        self.side_by_side = side_by_side(self.base, batch)

    @property
    def file(self) -> Path:
        """The dataset of all collisions."""
        return self.directory / "collisions.nc"

    @property
    def rows_file(self) -> Path:
        """File in which each collision is a line of JSON as soon as it is done."""
        return self.directory / "collisions.jsonl"

    def points(self, results_by_label: Mapping[str, PointResult]) -> list[Request]:
        """All collisions, and when they are found those of a further speed."""
        requests = self.requests()
        is_complete = all(request.label in results_by_label for request in requests)
        if is_complete and self._added < self._block.refine:
            speed = next_speed(
                build_collisions_dataset(self._rows(requests, results_by_label), self.axes)
            )
            if speed is not None:
                self._added += 1
                self.axes["speed"] = tuple(sorted({*self.axes["speed"], speed}))
                return self.requests()
        return requests

    def requests(self) -> list[Request]:
        """The collisions, in the order of the axes."""
        scene, phases, files = self.base.to_yaml(), self._block.phases, self._block.files
        core = read_result_keys(self.scene.to_yaml()) | {"collisions": None, "name": ""}
        requests = []
        for values in itertools.product(*self.axes.values()):
            point = dict(zip(self.axes, values, strict=True))
            sample = _sample(self._templates[point["body"]], point)
            requests.append(
                Request(
                    label=make_key(core, sample, phases, *[True] * files),
                    task=TASK,
                    arguments={"scene": scene, "sample": sample, "phases": phases, "files": files},
                    file=self.rows_file,
                    inputs=self._inputs,
                    cores=count_cores(self.base),
                    together=self.side_by_side,
                )
            )
        return requests

    @property
    def refine(self) -> int:
        """Largest number of further speeds."""
        return int(self._block.refine)

    def samples_at(self, speed: float) -> Iterator[tuple[Scene, Sample]]:
        """(scene, Sample) of a collision of each body and mass ratio, at a speed [m/s]."""
        point = {"speed": speed, "impact_parameter": self.axes["impact_parameter"][0], "seed": 0}
        for template in self._templates.values():
            for ratio in self.axes["mass_ratio"]:
                sample = _sample(template, point | {"mass_ratio": ratio})
                scene = self.base.with_value("sample", sample)
                yield scene, samples.make(scene)

    def dataset(self, results: Mapping[str, PointResult]) -> xr.Dataset:
        """Dataset of the collisions with its thresholds; failed ones have no numbers."""
        attrs = describe_study(self.scene, by_area=int(self._block.by_area))
        data = build_collisions_dataset(self._rows(self.requests(), results), self.axes, attrs)
        return data.assign(build_threshold_variables(find_thresholds(data), data))

    def _rows(
        self, requests: Sequence[Request], results: Mapping[str, PointResult]
    ) -> list[dict[str, Any]]:
        ordered = [results[request.label] for request in requests]
        return [result.measured or {"error": result.text} for result in ordered]


def side_by_side(scene: Any, batch: int | str) -> dict[str, int]:
    """Number of collisions side by side: `abreast` at most, with `room` for grains.

    batch: a number, "auto" or "off"; auto: as many grains as make the fixed time of a step
    negligible. The memory limits both. More than contacts, such as walls or gravity, acts on single
    ones only. Raises DustError.
    """
    number = {"off": 1, "auto": MOST}.get(str(batch), 0)
    with suppress(TypeError, ValueError):
        number = number or int(batch)
    if number < 1:
        raise DustError(f"batch = {batch}: allowed: auto, off, or a number of at least 1")
    environment = scene.push, scene.sphere, scene.gravity, scene.forces
    if scene.boundary.kind != "open" or any(environment):
        return {"abreast": 1, "room": 0}
    room = memory() * MEMORY / GRAIN
    if batch == "auto":
        few_grains, per_grain = estimate_step_terms(scene)
        room = min(room, few_grains / per_grain / FIXED)
    return {"abreast": number, "room": round(min(room, LARGEST))}


def next_speed(data: xr.Dataset) -> float | None:
    """Speed [m/s] that halves the widest interval in which a growth efficiency falls below 0.

    It considers all bodies and mass ratios; None where none is left to halve. Three digits.
    """
    brackets = [
        find_growth_bracket(data, body, ratio)
        for body, ratio in np.ndindex(data.sizes["body"], data.sizes["mass_ratio"])
    ]
    wide = [bracket for bracket in brackets if bracket and bracket[1] > NARROW * bracket[0]]
    if not wide:
        return None
    low, high = max(wide, key=lambda bracket: bracket[1] / bracket[0])
    return float(f"{np.sqrt(low * high):.3g}")


def _templates(sample: dict[str, Any], study_block: Any) -> dict[str, dict[str, Any]]:
    """Sample of the two bodies by the names of the dimension `body`."""
    if study_block.filling_factor:
        return {
            f"phi_{phi:g}": _set_filling_factor(deepcopy(sample), phi)
            for phi in study_block.filling_factor
        }
    templates = {}
    for name, body in study_block.bodies.items():
        block = plain(body.model_dump(mode="json"))
        projectile = shift_seeds(deepcopy(block), OTHER)
        templates[name] = deepcopy(sample) | {"target": block, "projectile": projectile}
    return templates or {SAMPLE: deepcopy(sample)}


def _set_filling_factor(sample: dict[str, Any], phi: float) -> dict[str, Any]:
    """The sample with a filling factor in place of those of its bodies; in place."""
    for _, block in find_keys(sample, "filling_factor"):
        block["filling_factor"] = phi
    return sample


def _sample(template: dict[str, Any], point: dict[str, Any]) -> dict[str, Any]:
    """The sample of a point: its bodies, speed, impact parameter and seeds."""
    sample = deepcopy(template)
    if point["mass_ratio"] != 1.0:
        projectile = sample["projectile"]
        projectile["grains"] = round(projectile["grains"] / point["mass_ratio"])
    sample["speed"] = quantities.format(point["speed"], "speed")
    sample["impact_parameter"] = point["impact_parameter"]
    return shift_seeds(sample, point["seed"])
