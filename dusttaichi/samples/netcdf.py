"""Grains from a NetCDF file, also from the result of an unfinished run in several files.

Variables position, velocity, spin of shape (grain, 3), or x, y, z, vx, ... of shape (grain,), in
the group `snapshots` if there is one, otherwise at the root; with one more dimension in front
(snapshots) one entry is read; optionally radius and material (grain,). Units are those of the
attribute `units`, otherwise SI. A result also has contacts and the box around the grains.
"""

from pathlib import Path

import numpy as np

from dusttaichi.errors import DustError
from dusttaichi.physics.geometry import AXES
from dusttaichi.results.reading import open_tree
from dusttaichi.samples.formats.names import COMPONENTS, unit_factor
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


def read(path: Path, where: str, snapshot="last") -> dict:
    """Arrays of a snapshot in SI, in the order of the file.

    position, velocity, spin (N, 3), radius and material (N,) if present. For a result also contacts
    and wall_contacts, name -> rows; period (3,), edges of its cell [m], inf along axes that are not
    periodic, and tilt [m], shift of the image above along x; room (6,), coordinates of walls and
    faces [m], NaN where there is none; time [s]; stiffness_scaling of its contacts. where: name of
    the file in errors. snapshot: number from 0, or "last". Raises DustError for a file that cannot
    be used.
    """
    try:
        tree = open_tree(path)
    except DustError as error:
        raise DustError(f"{where}: {error}") from None
    except (OSError, RuntimeError, ValueError, KeyError, TypeError) as error:
        raise _unreadable(where, error) from None
    try:
        return _Snapshot(tree, where, snapshot).read()
    except (OSError, RuntimeError) as error:
        raise _unreadable(where, error) from None
    finally:
        tree.close()


def _unreadable(where, error) -> DustError:
    return DustError(f"{where}: it cannot be read as NetCDF ({error}); allowed: a whole file.")


class _Snapshot:
    """One snapshot of the open result, or of the file with grains, `tree`."""

    def __init__(self, tree, where: str, snapshot):
        self.where, self.tree = where, tree
        self.groups = set(tree.children)
        node = tree["snapshots"] if "snapshots" in self.groups else tree
        self.frame = dict(node.to_dataset(inherit=False).variables)
        self.requested, self.number = snapshot, -1 if snapshot == "last" else snapshot

    def read(self) -> dict:
        state = {}
        for quantity in COMPONENTS:
            values = self._vectors(quantity)
            if values is not None:
                state[quantity] = values
        if "position" not in state:
            raise DustError(
                f"{self.where}: it has the variables {', '.join(self.frame) or 'none'}; "
                "allowed: position (grain, 3), or x, y and z."
            )
        if "radius" in self.frame:
            state["radius"] = self._entry("radius", 1, "radius")
        if "material" in self.frame:
            state["material"] = self._materials()
        state |= self._environment()
        for group, count, names in (
            ("contacts", "contact_count", PAIRS),
            ("wall_contacts", "wall_contact_count", WALL_CONTACTS),
        ):
            if group in self.groups and count in self.frame:
                state[group] = self._rows(group, count, names)
        return state

    def _vectors(self, quantity: str) -> np.ndarray | None:
        """(N, 3) in SI, or None where the file does not have the quantity."""
        parts = COMPONENTS[quantity]
        if quantity in self.frame:
            return self._entry(quantity, 2, quantity)
        missing = [part for part in parts if part not in self.frame]
        if len(missing) == 3:
            return None
        if missing:
            raise DustError(
                f"{self.where}: it lacks the variable {', '.join(missing)}; allowed: "
                f"{', '.join(parts)}."
            )
        columns = [self._entry(part, 1, quantity) for part in parts]
        if len({len(column) for column in columns}) > 1:
            lengths = ", ".join(str(len(column)) for column in columns)
            raise DustError(
                f"{self.where}: {', '.join(parts)} have {lengths} grains; allowed: the same."
            )
        return np.column_stack(columns)

    def _entry(self, name: str, rank: int, quantity: str) -> np.ndarray:
        """Values of a variable with `rank` axes in the snapshot, or without snapshots."""
        variable, where = self.frame[name], self.where
        shape = "(grain, 3)" if rank == 2 else "(grain,)"
        if variable.ndim not in (rank, rank + 1):
            raise DustError(
                f"{where}: {name} has the shape {variable.shape}; allowed: {shape}, with "
                "or without a dimension for snapshots in front."
            )
        check_grains(variable.shape[-rank], where)
        values = variable[self._place(variable.shape[0])] if variable.ndim > rank else variable
        values = self._plain(values.values, name)
        unit = variable.attrs.get("units")
        if unit is None:
            return values
        return values * unit_factor(unit, quantity, f"{where}, units of {name}")

    def _place(self, count: int) -> int:
        """Index of the snapshot among `count`."""
        if count == 0:
            raise DustError(f"{self.where}: it has no snapshot yet; allowed: one or more.")
        if self.number >= count:
            raise DustError(
                f"sample.snapshot = {self.requested}: {self.where} has {count} snapshots; allowed: "
                f"0 to {count - 1}, or last."
            )
        return self.number % count

    def _plain(self, values, name: str) -> np.ndarray:
        try:
            return np.asarray(values, dtype=np.float64)
        except (TypeError, ValueError):
            raise DustError(f"{self.where}: {name} contains texts; allowed: numbers.") from None

    def _materials(self) -> list:
        variable = self.frame["material"]
        if variable.ndim != 1:
            raise DustError(
                f"{self.where}: material has the shape {variable.shape}; allowed: (grain,)."
            )
        check_grains(len(variable), self.where)
        return variable.values.tolist()

    def _environment(self) -> dict:
        """Period, positions of walls and faces, and time, if the file has them."""
        period, found = np.full(3, np.inf), {}
        box = self.frame.get("box")
        if box is not None and box.shape[1:] == (6,):
            room = self._plain(box[self._place(len(box))].values, "box")
            found["room"] = room
            axes = str(self.tree.attrs.get("periodic_axes", "")).split()
            for k in (AXES.index(axis) for axis in axes if axis in AXES):
                period[k] = room[2 * k + 1] - room[2 * k]
        time = self.frame.get("snapshot_time")
        if time is not None and time.ndim == 1 and len(time):
            found["time"] = float(time[self._place(len(time))].values)
        scaling = self.tree.attrs.get("stiffness_scaling", 1.0)
        found["stiffness_scaling"] = self._number("stiffness_scaling", scaling)
        return found | {"period": period, "tilt": self._number("tilt", 0.0)}

    def _number(self, name: str, default: float) -> float:
        """Number of the snapshot, or the default where the file has none."""
        own = self.frame.get(name)
        values = np.zeros(0) if own is None else self._plain(own.values, name).reshape(-1)
        return float(values[self._place(len(values))] if len(values) else default)

    def _rows(self, group: str, count: str, names: dict) -> dict[str, np.ndarray]:
        """Rows of a group in the snapshot, by our names."""
        where, what = self.where, group.replace("_", " ")
        stored = self.tree[group].to_dataset(inherit=False).variables
        missing = [name for name in names.values() if name not in stored]
        if missing:
            raise DustError(f"{where}: its {what} lack {', '.join(missing)}; allowed: all of them.")
        start, stop = self._span(self.frame[count], count)
        there = len(stored[next(iter(names.values()))])
        if there < stop:
            raise DustError(f"{where}: it has {there} {what}; allowed: {stop}, its own count.")
        rows = {}
        registered = [name for name, v in stored.items() if "contact_history" in v.attrs]
        for ours, theirs in (names | {name: name for name in registered}).items():
            rows[ours] = self._plain(stored[theirs][start:stop].values, theirs)
            vector = ours in _VECTORS or (ours in registered and stored[theirs].ndim == 2)
            shape = (stop - start, 3) if vector else (stop - start,)
            if rows[ours].shape != shape:
                raise DustError(
                    f"{where}: {theirs} of its {what} has the shape {rows[ours].shape}; allowed: "
                    f"{shape}."
                )
            if ours in _NUMBERS:
                known = np.isfinite(rows[ours])
                rows[ours] = np.where(known, rows[ours], -1).astype(np.int64)
        return rows

    def _span(self, variable, name: str) -> tuple[int, int]:
        """First row of the snapshot, and the one after its last."""
        where = self.where
        check_grains(variable.size, where)
        counts = variable.values
        if not np.issubdtype(counts.dtype, np.number) or counts.ndim != 1:
            raise DustError(f"{where}: {name} contains no numbers of contacts; allowed: these.")
        counts = np.where(np.isfinite(counts), counts, -1).astype(np.int64)
        if (counts < 0).any():
            snapshot = int(np.argmax(counts < 0))
            raise DustError(
                f"{where}: {name} of snapshot {snapshot} is {counts[snapshot]}; allowed: 0 or more."
            )
        place = self._place(len(counts))
        return int(counts[:place].sum()), int(counts[: place + 1].sum())
