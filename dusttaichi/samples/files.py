"""Grains from CSV and NetCDF files, as a dict of arrays in SI: position, velocity, spin, contacts.

CSV: comma separated, a header line with x, y, z and perhaps vx, vy, vz, wx, wy, wz, radius,
material (in any order), then a line a grain; a material is a name or a number of the scene's; lines
that begin with # are skipped. Numbers are in SI unless the column's heading names a unit, as in `x
[um]`.

NetCDF: variables position, velocity, spin of shape (grain, 3), or x, y, z, vx, ... of shape
(grain,), in the group `snapshots` if there is one, else at the root; with one more dimension in
front (snapshots) the last entry is taken; perhaps radius and material (grain,). The attribute
`units` is honoured, without it SI.
"""

from __future__ import annotations

import csv
import re
import stat
from pathlib import Path

import numpy as np

from dusttaichi.errors import DustError
from dusttaichi.files import parts_folder
from dusttaichi.names import AXES
from dusttaichi.samples.limits import check_grains, memory
from dusttaichi.scene import quantities

COMPONENTS = {
    "position": ("x", "y", "z"),
    "velocity": ("vx", "vy", "vz"),
    "spin": ("wx", "wy", "wz"),
}
DIMENSIONS = {
    "position": "length",
    "velocity": "speed",
    "spin": "angular velocity",
    "radius": "length",
}
COLUMNS = {name: quantity for quantity, names in COMPONENTS.items() for name in names}
COLUMNS |= {"radius": "radius", "material": "material"}
CONTACTS = {  # our name: the result file's
    "i": "grain_i",
    "j": "grain_j",
    "pointer_i": "pointer_i",
    "pointer_j": "pointer_j",
    "twist": "twist",
    "approach": "approach",
}


def read(path: Path, where: str, length_unit: float | None = None) -> dict:
    """Arrays of a CSV file, a NetCDF file, or a run directory's result.nc.

    where: how errors name the file. length_unit [m]: what x, y, z of a CSV file count in where
    their headings do not say.
    """
    if path.is_dir():
        path = path / "result.nc"
        if not path.exists():
            raise DustError(f"{where}: there is no result.nc in this directory; allowed: a run's.")
    _check_kind(path, where)
    if not path.exists():
        raise DustError(
            f"{where}: there is no such file; allowed: a CSV file, a NetCDF file, or the "
            "directory of another run. Relative paths start at the YAML file."
        )
    if path.suffix == ".nc" and parts_folder(path).is_dir():
        raise DustError(
            f"{where}: the run of this result is not at its end; finish it first, with --resume."
        )
    if _first_bytes(path, where).startswith((b"\x89HDF", b"CDF")):
        return _read_netcdf(path, where)
    return _read_csv(path, where, length_unit)


def _check_kind(path: Path, where: str) -> None:
    """Refuse what is no file with an end, and what is larger than the memory."""
    try:
        found = path.stat()
    except FileNotFoundError:
        return
    except OSError as error:
        raise DustError(f"{where}: it cannot be read ({error.strerror}).") from None
    if not stat.S_ISREG(found.st_mode):
        raise DustError(f"{where}: it is a device or a pipe; allowed: a file.")
    if found.st_size > memory():
        raise DustError(
            f"{where}: it has {found.st_size / 1e9:.3g} GB, more than the memory of this machine."
        )


def _first_bytes(path: Path, where: str) -> bytes:
    try:
        with path.open("rb") as file:
            return file.read(4)
    except OSError as error:
        raise DustError(f"{where}: it cannot be read ({error.strerror}).") from None


def _read_csv(path: Path, where: str, length_unit: float | None) -> dict:
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            rows = [
                (line, row)
                for line, row in enumerate(csv.reader(file, skipinitialspace=True), start=1)
                if any(cell.strip() for cell in row) and not row[0].lstrip().startswith("#")
            ]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise DustError(
            f"{where}: it cannot be read as text ({error}); allowed: CSV or NetCDF."
        ) from None
    if not rows:
        raise DustError(f"{where}: the file is empty; allowed: a header x,y,z and lines of grains.")
    names, factors = _header(rows[0][1], where, length_unit)
    values = (
        np.array(
            [_numbers(row, line, names, where) for line, row in rows[1:]], dtype=np.float64
        ).reshape(-1, len(names))
        * factors
    )
    column = {name: values[:, k] for k, name in enumerate(names)}
    state = {
        quantity: np.column_stack([column[name] for name in parts])
        for quantity, parts in COMPONENTS.items()
        if parts[0] in column
    }
    if "radius" in column:
        state["radius"] = column["radius"]
    if "material" in column:
        state["material"] = [row[names.index("material")] for _, row in rows[1:]]
    return state


def _header(cells: list[str], where: str, length_unit: float | None):
    """Column names, and what each must be multiplied with to be in SI."""
    allowed = (
        "allowed: x,y,z and perhaps vx,vy,vz, wx,wy,wz, radius and material, each perhaps with a "
        "unit: x [um]."
    )
    names, factors = [], []
    for cell in cells:
        match = re.fullmatch(r"\s*(\w+)\s*(?:\[([^\]]*)\])?\s*", cell)
        if match is None or match[1] not in COLUMNS or match[1] in names:
            raise DustError(f"{where}: the header has the column {cell.strip()!r}; {allowed}")
        name, unit = match.groups()
        quantity = COLUMNS[name]
        if quantity == "material" and unit is not None:
            raise DustError(f"{where}: the column {cell.strip()!r} has no unit; {allowed}")
        length = quantity in ("position", "radius")
        default = length_unit if length and length_unit is not None else 1.0
        names.append(name)
        factors.append(
            default if unit is None else _factor(unit, quantity, f"{where}, column {name}")
        )
    for quantity, parts in COMPONENTS.items():
        missing = [part for part in parts if part not in names]
        if missing and (quantity == "position" or len(missing) < 3):
            raise DustError(f"{where}: the header lacks {', '.join(missing)}; {allowed}")
    return names, np.array(factors)


def _factor(unit: str, quantity: str, where: str) -> float:
    return quantities.parse(f"1 {unit}", DIMENSIONS[quantity], where)


def _numbers(row: list[str], line: int, names: list[str], where: str) -> list[float]:
    if len(row) != len(names):
        raise DustError(
            f"{where}: line {line} has {len(row)} columns; allowed: {len(names)}, as the header."
        )
    try:
        return [
            0.0 if name == "material" else float(cell)
            for name, cell in zip(names, row, strict=True)
        ]
    except ValueError as error:
        raise DustError(f"{where}: line {line}: {error}; allowed: plain numbers.") from None


def _read_netcdf(path: Path, where: str) -> dict:
    import netCDF4  # a fifth of a second, which only such a file is worth

    try:
        with netCDF4.Dataset(path) as data:
            frame = data.groups.get("snapshots", data)
            state = {}
            for quantity in COMPONENTS:
                values = _last_frame(frame, quantity, where)
                if values is not None:
                    state[quantity] = values
            if "position" not in state:
                raise DustError(
                    f"{where}: it has the variables {', '.join(frame.variables) or 'none'}; "
                    "allowed: position (grain, 3), or x, y and z."
                )
            if "radius" in frame.variables:
                state["radius"] = _last(frame.variables["radius"], 1, "radius", where)
            if "material" in frame.variables:
                state["material"] = _materials(frame.variables["material"], where)
            if "contacts" in data.groups and "contact_count" in frame.variables:
                state["contacts"] = _last_contacts(
                    data.groups["contacts"], frame.variables["contact_count"], where
                )
                state["period"] = _period(data, frame)
            return state
    except (OSError, RuntimeError) as error:
        raise DustError(
            f"{where}: it cannot be read as NetCDF ({error}); allowed: a whole file."
        ) from None


def _materials(variable, where: str) -> list:
    if variable.ndim != 1:
        raise DustError(
            f"{where}: {variable.name} has the shape {variable.shape}; allowed: (grain,)."
        )
    check_grains(len(variable), where)
    return variable[...].tolist()


def _period(data, frame) -> np.ndarray:
    """Edges of the periodic cell of a result [m], (3,), inf along axes that are not periodic."""
    period = np.full(3, np.inf)
    axes = str(getattr(data, "periodic_axes", "")).split()
    if axes and "box" in frame.variables:
        box = np.ma.filled(frame.variables["box"][-1], np.nan)
        for k in (AXES.index(axis) for axis in axes if axis in AXES):
            period[k] = box[2 * k + 1] - box[2 * k]
    return period


def _plain(values, name: str, where: str) -> np.ndarray:
    """float64 of what a variable holds, nan where it holds nothing."""
    try:
        return np.ma.filled(np.ma.asarray(values, dtype=np.float64), np.nan)
    except (TypeError, ValueError):
        raise DustError(f"{where}: {name} holds texts; allowed: numbers.") from None


def _last_frame(frame, quantity: str, where: str) -> np.ndarray | None:
    """(N, 3) in SI of the last snapshot, or None where the file does not have the quantity."""
    parts = COMPONENTS[quantity]
    if quantity in frame.variables:
        return _last(frame.variables[quantity], 2, quantity, where)
    present = [part for part in parts if part in frame.variables]
    if not present:
        return None
    if len(present) < 3:
        missing = ", ".join(part for part in parts if part not in present)
        raise DustError(f"{where}: it lacks the variable {missing}; allowed: {', '.join(parts)}.")
    columns = [_last(frame.variables[part], 1, quantity, where) for part in parts]
    if len({len(column) for column in columns}) > 1:
        lengths = ", ".join(str(len(column)) for column in columns)
        raise DustError(f"{where}: {', '.join(parts)} have {lengths} grains; allowed: the same.")
    return np.column_stack(columns)


def _last(variable, rank: int, quantity: str, where: str) -> np.ndarray:
    """Last entry along the snapshots, if there are any, of a variable with so many own axes."""
    shape = "(grain, 3)" if rank == 2 else "(grain,)"
    if variable.ndim == rank + 1 and variable.shape[0] == 0:
        raise DustError(f"{where}: it has no snapshot yet; allowed: one or more.")
    if variable.ndim not in (rank, rank + 1):
        raise DustError(
            f"{where}: {variable.name} has the shape {variable.shape}; allowed: {shape}, with "
            "or without a dimension for snapshots in front."
        )
    check_grains(variable.shape[-rank], where)
    values = variable[...] if variable.ndim == rank else variable[-1]
    values = _plain(values, variable.name, where)
    unit = getattr(variable, "units", None)
    if unit is None:
        return values
    return values * _factor(unit, quantity, f"{where}, units of {variable.name}")


def _last_contacts(group, count, where: str) -> dict[str, np.ndarray]:
    missing = [name for name in CONTACTS.values() if name not in group.variables]
    if missing:
        raise DustError(f"{where}: its contacts lack {', '.join(missing)}; allowed: all of them.")
    check_grains(count.size, where)
    counts = np.ma.filled(count[...], 0)
    if not np.issubdtype(counts.dtype, np.number) or counts.ndim != 1:
        raise DustError(f"{where}: contact_count holds no numbers of contacts; allowed: these.")
    counts = np.where(np.isfinite(counts), counts, -1).astype(np.int64)
    if (counts < 0).any():
        snapshot = int(np.argmax(counts < 0))
        raise DustError(
            f"{where}: contact_count of snapshot {snapshot} is {counts[snapshot]}; allowed: 0 or "
            "more."
        )
    start, stop = int(counts[:-1].sum()), int(counts.sum())
    held = len(group.variables["grain_i"])
    if held < stop:
        raise DustError(f"{where}: it holds {held} contacts; allowed: {stop}, as it counts.")
    contacts = {}
    for ours, theirs in CONTACTS.items():
        contacts[ours] = _plain(group.variables[theirs][start:stop], theirs, where)
        shape = (stop - start, 3) if ours.startswith("pointer") else (stop - start,)
        if contacts[ours].shape != shape:
            raise DustError(
                f"{where}: {theirs} of its contacts has the shape {contacts[ours].shape}; allowed: "
                f"{shape}."
            )
    for grain in ("i", "j"):
        values = contacts[grain]
        contacts[grain] = np.where(np.isfinite(values), values, -1).astype(np.int64)
    return contacts
