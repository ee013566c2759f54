"""Coefficient of restitution of a collision over its speed and other keys of the scene."""

import itertools
from pathlib import Path

import numpy as np
import xarray as xr

from dusttaichi.errors import DustError
from dusttaichi.results import provenance
from dusttaichi.results.outputs import NETCDF, check
from dusttaichi.studies.settings import grid
from dusttaichi.studies.sticking.collision import Collision
from dusttaichi.studies.sticking.search import speed_of


def restitution_map(scene, speeds, tolerance=1e-3, settings=()):
    """Outcomes of the scene's collision at these speeds [m/s], as an xr.Dataset in SI.

    settings: texts "key=value,value" of the YAML; each is a dimension before the speed.
    restitution, bound, fragments, largest_fragment, contacts, kinetic: (..., speed). The attribute
    sticking_speed is the closed form of the first point, closed_form whether it is valid there (two
    single grains, or one and a wall, without damping, head-on). Points that differ only in their
    samples run as one batch. Raises DustError, see `sticking`.
    """
    axes, scenes = grid(scene, list(settings))
    collisions = [Collision(point, tolerance) for point in scenes]
    speeds = np.asarray(speeds, float)
    found = _all_outcomes(collisions, speeds)
    collision = collisions[0]
    dims = (*(axis.key for axis in axes), "speed")
    shape = (*(len(axis.texts) for axis in axes), len(speeds))
    columns = {
        "restitution": ([o.coefficient for o in found], "1", "coefficient of restitution"),
        "bound": ([int(o.bound) for o in found], "1", "1 where the bodies are bound at the end"),
        "fragments": ([o.fragments for o in found], "1", "sets of grains connected by contacts"),
        "largest_fragment": ([o.largest for o in found], "1", "grains of the largest fragment"),
        "contacts": ([o.contacts for o in found], "1", "contacts between grains"),
        "kinetic": ([o.kinetic for o in found], "J", "kinetic energy at the end"),
    }
    data = xr.Dataset(
        {
            name: (dims, np.array(values).reshape(shape), {"units": unit, "long_name": text})
            for name, (values, unit, text) in columns.items()
        },
        {"speed": ("speed", speeds, {"units": "m/s", "long_name": "speed of approach"})}
        | {
            axis.key: (axis.key, axis.coordinate, {"units": axis.unit} if axis.unit else {})
            for axis in axes
        },
    )
    attrs = provenance(
        scene.source,
        collision.scene.to_yaml(),
        title=scene.name,
        time_step=collision.time_step,
        sticking_speed=collision.closed,
        closed_form=int(collision.is_closed),
    )
    data.attrs = {name: value for name, value in attrs.items() if value is not None}
    return data


def _all_outcomes(collisions, speeds):
    """The batch.Outcome of every collision at every speed, the speeds fastest: a list."""
    together = {}
    for n, collision in enumerate(collisions):
        # a batch shares the whole scene but its sample
        rest = collision.scene.model_copy(update={"sample": None, "numerics": None, "name": ""})
        together.setdefault(repr(rest), []).append(n)
    found = [None] * len(collisions)
    for members in together.values():
        least = min((collisions[n] for n in members), key=lambda c: c.time_step)
        outcomes = least.outcomes(speeds, [collisions[n] for n in members])
        for k, n in enumerate(members):
            found[n] = outcomes[k * len(speeds) : (k + 1) * len(speeds)]
    return [outcome for part in found for outcome in part]


def save_map(scene, text, directory, tolerance=1e-3, settings=()):
    """Write restitution.nc and restitution.png of the speeds "LOW,HIGH,COUNT" to a directory.

    settings: see `restitution_map`. Returns the dataset and the paths. Raises DustError.
    """
    from dusttaichi import plots

    data = restitution_map(scene, _speeds(text), tolerance, settings)
    closed = data.attrs["sticking_speed"]
    table = data.restitution.values.reshape(-1, data.sizes["speed"])
    names = data.restitution.dims[:-1]
    points = itertools.product(*(data[name].values for name in names))
    labels = [", ".join(map(_said, names, point, itertools.repeat(data))) for point in points]
    closed = closed if data.attrs["closed_form"] else None
    figure = plots.restitution(data.speed, table, closed, labels if names else "simulated")
    paths = [Path(directory) / f"restitution{suffix}" for suffix in (".nc", ".png")]
    try:
        Path(directory).mkdir(parents=True, exist_ok=True)
        data.to_netcdf(check(paths[0], NETCDF))
        plots.save(figure, paths[1])
    except OSError as error:
        raise DustError(f"The map cannot be written to {directory}: {error}.") from error
    return data, paths


def _said(name, value, data):
    """Key and value of the map for a legend: the last word of the key, angles in degrees."""
    word, unit = name.split(".")[-1].replace("_", " "), data[name].attrs.get("units", "")
    if isinstance(value, str):
        return f"{word} = {value}"
    if unit == "rad":
        return f"{word} = {np.degrees(value):.3g}°"
    return f"{word} = {value:.4g} {unit}".removesuffix(" 1").rstrip()


def map_rows(data):
    """Rows (name, value) of text of a restitution map."""
    closed = data.attrs["sticking_speed"]
    speeds = np.broadcast_to(data.speed.values, data.bound.shape)
    apart = np.sort(speeds[data.bound.values == 0])
    return [
        ("speeds", str(data.sizes["speed"])),
        ("slowest without sticking", f"{apart[0]:.6g} m/s" if len(apart) else "none"),
        ("two grains (or grain and wall), no damping", f"{closed:.6g} m/s"),
    ]


def _speeds(text):
    parts = [part.strip() for part in text.split(",")]
    if len(parts) != 3 or not parts[2].isdigit() or int(parts[2]) < 2:
        raise DustError(
            f"--map {text}: must be two speeds and a number of at least 2, such as "
            '--map "0.01 m/s,5 m/s,40"'
        )
    low, high = (speed_of("--map", part) for part in parts[:2])
    if not 0.0 < low < high:
        raise DustError(f"--map {text}: the speeds must be above 0, and the second above the first")
    return np.geomspace(low, high, int(parts[2]))
