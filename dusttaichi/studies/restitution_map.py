"""Coefficient of restitution of a collision over its speed and other keys of the scene."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import cast

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from dusttaichi.errors import DustError
from dusttaichi.grains.grain_scene import GrainsScene
from dusttaichi.results.provenance import describe_study
from dusttaichi.scene import quantities
from dusttaichi.studies.requests import Request
from dusttaichi.studies.scene_settings import make_grid
from dusttaichi.studies.sticking_search import Collision
from dusttaichi.studies.study_types import PointResult

# name -> (of the outcome, unit, long_name)
NUMBERS = {
    "restitution": ("restitution", "1", "coefficient of restitution"),
    "bound": ("bound", "1", "1 where the bodies are bound at the end"),
    "fragments": ("fragments", "1", "sets of grains connected by contacts"),
    "largest_fragment": ("largest", "1", "grains of the largest fragment"),
    "contacts": ("contacts", "1", "contacts between grains"),
    "kinetic": ("kinetic", "J", "kinetic energy at the end"),
}


class RestitutionMap:
    """Study of the outcomes of the collision of a scene over its speed and other keys.

    speeds: text "LOW,HIGH,COUNT". settings: texts "key=value,value" of the YAML; each is a
    dimension before the speed. Raises DustError, see `search.Search`.
    """

    timed = False

    def __init__(
        self,
        scene: GrainsScene,
        directory: str | Path,
        speeds: str,
        tolerance: float = 1e-3,
        settings: Sequence[str] = (),
    ) -> None:
        self.scene, self.directory, self.speeds = scene, Path(directory), _parse_speeds(speeds)
        self.axes, scenes = make_grid(scene, list(settings))
        rows = self.file.with_suffix(".jsonl")
        self.collisions = [
            Collision(cast(GrainsScene, changed_scene), tolerance, rows) for changed_scene in scenes
        ]

    @property
    def file(self) -> Path:
        """File of the map."""
        return self.directory / "restitution.nc"

    @property
    def beyond(self) -> str:
        """Sentence about speeds beyond the contact model, of the first scene with some, or ""."""
        return next(
            filter(None, (collision.describe_excess(self.speeds) for collision in self.collisions)),
            "",
        )

    def points(self, results: Mapping[str, PointResult]) -> list[Request]:
        """All of them, the speeds fastest."""
        return [
            collision.make_request(speed) for collision in self.collisions for speed in self.speeds
        ]

    def dataset(self, results: Mapping[str, PointResult]) -> xr.Dataset:
        """xr.Dataset in SI of NUMBERS over (..., speed).

        The attribute sticking_speed is the closed form of the first point, closed_form whether it
        is valid there (two single grains, or one and a wall, without damping, head-on). Raises
        DustError where a collision failed.
        """
        for failed in (outcome for outcome in results.values() if not outcome.ok):
            raise DustError(failed.text)
        outcomes = [results[point.label].measured for point in self.points(results)]
        axes, first = self.axes, self.collisions[0]
        dims = (*(axis.key for axis in axes), "speed")
        shape = (*(len(axis.texts) for axis in axes), len(self.speeds))
        attributes = {"units": "m/s", "long_name": "speed of approach"}
        data = xr.Dataset(coords={"speed": ("speed", self.speeds, attributes)})
        for axis in axes:
            data.coords[axis.key] = (
                axis.key,
                axis.coordinate,
                {"units": axis.unit} if axis.unit else {},
            )
        for name, (key, unit, text) in NUMBERS.items():
            values = np.array([outcome[key] for outcome in outcomes])
            values = (values.astype(int) if key == "bound" else values).reshape(shape)
            data[name] = dims, values, {"units": unit, "long_name": text}
        data.attrs = describe_study(
            self.scene,
            first.scene,
            time_step=min(outcome["time_step"] for outcome in outcomes),
            sticking_speed=first.closed,
            closed_form=int(first.is_closed),
        )
        return data


def list_map_rows(data: xr.Dataset) -> list[tuple[str, str]]:
    """Rows (name, value) of text of a restitution map."""
    closed = data.attrs["sticking_speed"]
    speeds = np.broadcast_to(data.speed.values, data.bound.shape)
    apart = np.sort(speeds[data.bound.values == 0])
    return [
        ("speeds", str(data.sizes["speed"])),
        ("slowest without sticking", f"{apart[0]:.6g} m/s" if len(apart) else "none"),
        ("sticking speed without damping", f"{closed:.6g} m/s"),
    ]


def _parse_speeds(text: str) -> NDArray[np.float64]:
    texts = [entry.strip() for entry in text.split(",")]
    if len(texts) != 3 or not texts[2].isdigit() or int(texts[2]) < 2:
        raise DustError(
            f"--map {text}: must be two speeds and a number of at least 2, such as "
            '--map "0.01 m/s,5 m/s,40"'
        )
    low, high = (quantities.parse(entry, "speed", "--map") for entry in texts[:2])
    if not 0.0 < low < high:
        raise DustError(f"--map {text}: the speeds must be above 0, and the second above the first")
    return np.geomspace(low, high, int(texts[2]))
