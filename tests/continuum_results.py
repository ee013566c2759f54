"""Result files of the continuum as a test writes them: a bead that falls as it is told."""

import netCDF4
import numpy as np
import yaml

AXES = np.array(["x", "y", "z"], dtype=object)


def write(path, *, series, snapshots, static, sample, **attributes):
    """A result.nc with these series (time, ...), snapshots (a list of dicts), and static arrays.

    By default records are a millisecond apart, and the ledger closes.
    """
    length = len(next(iter(series.values())))
    zero = np.zeros(length)
    series = {"time": 1e-3 * np.arange(length), "step": np.arange(length), "wall_clock": zero,
              "energy_residual": zero, "energy_residual_relative": zero} | series  # fmt: skip
    static = {"role": 0.0 * static["mass"], "body": 0.0 * static["mass"]} | static
    with netCDF4.Dataset(path, "w") as file:
        file.setncatts({"spacing": 1e-4, "solid_density": 2000.0, "dimension": 2, "gravity": 9.81})
        file.setncatts({"sample": yaml.safe_dump(sample), "particles": len(static["mass"])})
        file.setncatts({"scene_resolved": "method: continuum"} | attributes)
        file.createDimension("time", None)
        for name, length in (("xyz", 3), ("rigid", 1), ("particle", len(static["mass"]))):
            file.createDimension(name, length)
        file.createDimension("component", 6)
        file.createVariable("xyz", str, ("xyz",))[:] = AXES
        file.createVariable("rigid", str, ("rigid",))[:] = np.array(["bead"], dtype=object)
        for name, values in series.items():
            dims = ("time", *(("rigid", "xyz") if name.startswith("body") else ("xyz",)))
            dims = dims[: np.ndim(values)]
            file.createVariable(name, "f8", dims)[:] = values
        group = file.createGroup("snapshots")
        group.createDimension("snapshot", None)
        for name, values in static.items():
            group.createVariable(name, "f8", ("particle",))[:] = values
        names = {"snapshot_time": 0, "step": 0} | snapshots[0]
        for name in names:
            rows = [frame.get(name, n) for n, frame in enumerate(snapshots)]
            last = {"position": "xyz", "velocity": "xyz", "deviator": "component"}.get(name)
            dims = ("snapshot", "particle", *([last] if last else []))[: np.ndim(rows)]
            group.createVariable(name, "f8", dims)[:] = rows
    return path


def frame(position, velocity=None, density=300.0):
    """A snapshot of particles (N, 3) without stress."""
    n = len(position)
    return {
        "position": position,
        "velocity": np.zeros((n, 3)) if velocity is None else velocity,
        "density": np.zeros(n) + density,
        "pressure": np.zeros(n),
        "deviator": np.zeros((n, 6)),
    }
