"""Files of single collisions of a study, and arrays of a checkpoint as values of JSON."""

from __future__ import annotations

import base64
import itertools
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from dusttaichi.analysis.ensemble import save_ensemble
from dusttaichi.results.provenance import describe_study

FOLDER = "collisions"
LENGTH = 12  # characters of the key of a collision in the name of its file


def write_collision_files(study: Any, point_results: Mapping[str, Any]) -> list[Path]:
    """Write the file of each collision whose row has a `course`; returns their paths.

    study: Collisions; point_results: label -> PointResult. Raises DustError.
    """
    paths, points = [], itertools.product(*study.axes.values())
    for request, values in zip(study.requests(), points, strict=True):
        row = point_results[request.label].measured or {}
        if "course" in row:
            path = study.directory / FOLDER / f"{request.label[:LENGTH]}.nc"
            attrs = describe_study(study.scene, outcome=row["outcome"])
            attrs |= dict(zip(study.axes, values, strict=True))
            path.parent.mkdir(parents=True, exist_ok=True)
            save_ensemble(build_course_dataset(row["course"]).assign_attrs(attrs), path)
            paths.append(path)
    return paths


def build_course_dataset(course: Mapping[str, Any]) -> xr.Dataset:
    """Dataset (SI) of the course of a collision (collide_course.Collision)."""
    columns, units = course["series"], {"time": "s", "distance": "m"}
    losses = columns["loss"]
    data = xr.Dataset(
        {n: ("time", v) for n, v in columns.items() if n not in ("time", "loss")},
        coords={"time": columns["time"], "channel": list(losses)},
    )
    data["loss"] = (("time", "channel"), np.array(list(losses.values())).T)
    for name, values in course["grains"].items():
        dims = ("moment", "grain", "xyz")[3 - np.ndim(values) :] if np.ndim(values) > 1 else "grain"
        data[name] = (dims, values)
    units |= dict.fromkeys(("radius", "position"), "m")
    for name in data.variables:
        if name not in ("channel", "body", "fragment"):
            data[name].attrs["units"] = units.get(str(name), "J")
    data.attrs = {"moment": "start and end"}
    return data


def encode_arrays(arrays: Mapping[str, NDArray[Any]]) -> dict[str, list[Any]]:
    """Arrays by name as values of JSON, bitwise: type, shape and compressed bytes of each."""
    return {
        name: [
            array.dtype.str,
            list(array.shape),
            base64.b64encode(zlib.compress(np.ascontiguousarray(array).tobytes(), 1)).decode(),
        ]
        for name, array in arrays.items()
    }


def decode_arrays(encoded: Mapping[str, list[Any]]) -> dict[str, NDArray[Any]]:
    """The arrays of `encode_arrays`."""
    return {
        name: np.frombuffer(zlib.decompress(base64.b64decode(text)), dtype).reshape(shape).copy()
        for name, (dtype, shape, text) in encoded.items()
    }
