"""Grains from a NetCDF file, also from the result of an unfinished run in several files.

Variables in the group `snapshots` if there is one, otherwise at the root, under the names of
samples.formats.names; their dimensions are those of samples.formats.variables. Units are those of
the attribute `units`, else lengths are in the unit of the sample, all others in SI. A result also
has contacts and the box around the grains.
"""

from dataclasses import replace
from pathlib import Path
from typing import Any, cast

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from dusttaichi.errors import DustError
from dusttaichi.physics.geometry import AXES
from dusttaichi.results.reading import open_tree
from dusttaichi.samples.formats.columns import Units, state
from dusttaichi.samples.formats.text import Source
from dusttaichi.samples.formats.variables import Frame, read_columns, read_numbers
from dusttaichi.samples.sample import check_grains

_BOTH = {"twist": "twist", "approach": "approach"}
PAIRS = {  # our name: the result file's
    "i": "grain_i",
    "j": "grain_j",
    "pointer_i": "pointer_i",
    "pointer_j": "pointer_j",
    **_BOTH,
}
WALL_CONTACTS = {"grain": "grain", "wall": "wall", "pointer": "pointer", "foot": "foot", **_BOTH}
_VECTORS = ("pointer_i", "pointer_j", "pointer", "foot")
_NUMBERS = ("i", "j", "grain", "wall")


def read(path: Path, source: Source) -> dict[str, Any]:
    """Arrays of a snapshot in SI as columns.state, in the order of the file or of its ids.

    Also the sentences `remarks` on how it is read, and `of_run`: True for a result of this program.
    For a result also contacts and wall_contacts, name -> rows; period (3,), edges of its cell [m],
    inf along axes that are not periodic, and tilt [m], shift of the image above along x; room (6,),
    coordinates of walls and faces [m], NaN where there is none; time [s]; stiffness_scaling of its
    contacts. source: without lines. Raises DustError for a file that cannot be used.
    """
    origin = source.name
    try:
        tree = open_tree(path)
    except DustError as error:
        raise DustError(f"{origin}: {error}") from None
    except (OSError, RuntimeError, ValueError, KeyError, TypeError) as error:
        raise _make_unreadable_error(origin, error) from None
    try:
        return _Snapshot(tree, source).read()
    except (OSError, RuntimeError) as error:
        raise _make_unreadable_error(origin, error) from None
    finally:
        tree.close()


def _make_unreadable_error(origin: str, error: Exception) -> DustError:
    return DustError(f"{origin}: it cannot be read as NetCDF ({error}); allowed: a whole file.")


ENVIRONMENT = (  # of a snapshot, not of its grains
    "box", "snapshot_time", "step", "tilt", "contact_count",
    "wall_contact_count",
)  # fmt: skip


class _Snapshot:
    """One snapshot of the open result, or of the file with grains, `tree`."""

    def __init__(self, tree: xr.DataTree, source: Source) -> None:
        self.source, self.origin, self.tree = source, source.name, tree
        self.groups = set(tree.children)
        self.of_run = "dusttaichi_version" in tree.attrs
        if self.of_run and "snapshots" not in self.groups:
            raise source.fault("this run has no snapshots; allowed: one with output.snapshots.")
        node = tree["snapshots"] if "snapshots" in self.groups else tree
        variables = cast(xr.DataTree, node).to_dataset(inherit=False).variables
        self.frame: dict[str, xr.Variable] = {str(n): v for n, v in variables.items()}

    def read(self) -> dict[str, Any]:
        state = self._columns() | self._environment()
        for group, count, names in (
            ("contacts", "contact_count", PAIRS),
            ("wall_contacts", "wall_contact_count", WALL_CONTACTS),
        ):
            if group in self.groups and count in self.frame:
                state[group] = self._rows(group, count, names)
        return state | {"remarks": self.source.remarks, "of_run": self.of_run}

    def _columns(self) -> dict[str, Any]:
        """Arrays of the grains, and under `unread` the variables that are none of them."""
        source = self.source
        if "contacts" in self.groups:  # their numbers are those of the file's order
            contents = source.contents
            contents = replace(contents, quantities=contents.quantities - {"id"})
            source = replace(source, contents=contents)
        table, names = read_columns(Frame(self.frame, ENVIRONMENT, source))
        if not any(quantity == "position" for quantity, _ in filter(None, table.meanings)):
            raise DustError(
                f"{self.origin}: it has the variables {', '.join(self.frame) or 'none'}; "
                "allowed: position (grain, 3), or x, y and z."
            )
        # a unit of length alone does not say those of masses
        units = Units(length=source.length, matter=source.length == 1.0)
        arrays = state(table, source, units)
        unread = {*arrays["unread"], *names}
        if self.of_run:  # all else is computed from the state
            unread &= source.contents.history
        else:
            groups = self.groups - {"snapshots", "contacts", "wall_contacts"}
            unread |= {f"group {name}" for name in groups}
        arrays["unread"] = sorted(unread)
        return arrays

    def _environment(self) -> dict[str, Any]:
        """Period, positions of walls and faces, and time, if the file has them."""
        period = np.full(3, np.inf)
        environment: dict[str, Any] = {}
        box = self.frame.get("box")
        if box is not None and box.shape[1:] == (6,):
            room = read_numbers(box[self.source.choose_number(len(box))].values, "box", self.source)
            environment["room"] = room
            axes = str(self.tree.attrs.get("periodic_axes", "")).split()
            for k in (AXES.index(axis) for axis in axes if axis in AXES):
                period[k] = room[2 * k + 1] - room[2 * k]
        time = self.frame.get("snapshot_time")
        if time is not None and time.ndim == 1 and len(time):
            environment["time"] = float(time[self.source.choose_number(len(time))].values)
        scaling = self.tree.attrs.get("stiffness_scaling", 1.0)
        environment["stiffness_scaling"] = self._number("stiffness_scaling", scaling)
        return environment | {"period": period, "tilt": self._number("tilt", 0.0)}

    def _number(self, name: str, default: float) -> float:
        """Number of the snapshot, or the default where the file has none."""
        variable = self.frame.get(name)
        if variable is None:
            return default
        values = read_numbers(variable.values, name, self.source).reshape(-1)
        return float(values[self.source.choose_number(len(values))] if len(values) else default)

    def _rows(self, group: str, count: str, names: dict[str, Any]) -> dict[str, np.ndarray]:
        """Rows of a group in the snapshot, by our names."""
        origin, group_name = self.origin, group.replace("_", " ")
        variables = cast(xr.DataTree, self.tree[group]).to_dataset(inherit=False).variables
        stored = {str(n): v for n, v in variables.items()}
        missing = [name for name in names.values() if name not in stored]
        if missing:
            raise DustError(
                f"{origin}: its {group_name} lack {', '.join(missing)}; allowed: all of them."
            )
        start, stop = self._span(self.frame[count], count)
        row_count = len(stored[next(iter(names.values()))])
        if row_count < stop:
            raise DustError(
                f"{origin}: it has {row_count} {group_name}; allowed: {stop}, its own count."
            )
        rows: dict[str, NDArray[Any]] = {}
        registered = [name for name, v in stored.items() if "contact_history" in v.attrs]
        for ours, theirs in (names | {name: name for name in registered}).items():
            rows[ours] = read_numbers(stored[theirs][start:stop].values, theirs, self.source)
            vector = ours in _VECTORS or (ours in registered and stored[theirs].ndim == 2)
            shape = (stop - start, 3) if vector else (stop - start,)
            if rows[ours].shape != shape:
                raise DustError(
                    f"{origin}: {theirs} of its {group_name} has the shape {rows[ours].shape}; "
                    "allowed: "
                    f"{shape}."
                )
            if ours in _NUMBERS:
                finite = np.isfinite(rows[ours])
                rows[ours] = np.where(finite, rows[ours], -1).astype(np.int64)
        return rows

    def _span(self, variable: Any, name: str) -> tuple[int, int]:
        """First row of the snapshot, and the one after its last."""
        origin = self.origin
        check_grains(variable.size, origin)
        counts = variable.values
        if not np.issubdtype(counts.dtype, np.number) or counts.ndim != 1:
            raise DustError(f"{origin}: {name} contains no numbers of contacts; allowed: these.")
        counts = np.where(np.isfinite(counts), counts, -1).astype(np.int64)
        if (counts < 0).any():
            snapshot = int(np.argmax(counts < 0))
            raise DustError(
                f"{origin}: {name} of snapshot {snapshot} is {counts[snapshot]}; allowed: 0 or "
                "more."
            )
        number = self.source.choose_number(len(counts))
        return int(counts[:number].sum()), int(counts[: number + 1].sum())
