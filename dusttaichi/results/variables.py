"""Variables of the result file, and those that all methods share.

Each method declares further ones (grains: grains/grain_variables.py); writer and layout follow
from the declarations.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from dusttaichi.physics.contact.effect_numbers import CHANNELS, SPRINGS
from dusttaichi.physics.geometry import AXES, WALLS

REQUESTED = "requested"  # feature of optional outputs
# groups with optional outputs (`output.variables`)
CHOSEN = ("snapshots", "contacts", "wall_contacts", "sphere_contacts")
NEEDED = {"snapshot_time", "step", "position", "box", "grain_i", "grain_j", "grain", "wall"}
# dimensions with many entries
EACH = {"grain", "particle", "contact", "wall_contact", "sphere_contact"}
# names of the entries of dimensions, unless a method declares others
LABELS = {
    "wall": WALLS,
    "spring": SPRINGS,
    "channel": CHANNELS,
    "xyz": AXES,
    "axis": AXES,
    "quaternion": ("w", "x", "y", "z"),
}
_RECORDS = {  # group -> the dimension that grows
    "series": "time",
    "profiles": "profile",
    "snapshots": "snapshot",
    "contacts": "contact",
    "wall_contacts": "wall_contact",
    "sphere_contacts": "sphere_contact",
}


def record_dimension(group: str) -> str:
    """The dimension along which a group grows; `record` for a group of the user."""
    return _RECORDS.get(group, "record")


@dataclass(frozen=True)
class Variable:
    """One variable of the result file."""

    group: str  #: Group of the file, such as "series" or "snapshots".
    name: str  #: Name in that group.
    dims: tuple[str, ...]  #: Dimensions, the record first if it grows.
    units: str  #: SI unit.
    long_name: str  #: Meaning.
    source: str = ""  #: Equation or section of a paper.
    dtype: str = "f8"  #: Type in the file.
    needs: frozenset[str] = frozenset()  #: Features that a scene must have.
    counts: str = ""  #: Dimension of a ragged group whose rows of each record it counts.
    #: Part of the contact history, which a sample that is read from the result includes.
    history: bool = False

    @property
    def key(self) -> str:
        """Name as used with the Writer: `pressure`, `snapshots/position`."""
        return self.name if self.group == "series" else f"{self.group}/{self.name}"

    @property
    def grows(self) -> bool:
        """True for one entry per record, False for a static variable."""
        return record_dimension(self.group) in self.dims

    @property
    def is_optional(self) -> bool:
        """True for one that a result may lack, or has on request."""
        is_required = self.name in NEEDED or self.counts or not self.grows
        return self.group in CHOSEN and not is_required


def declare(
    group: str,
    rows: Iterable[Sequence[str]],
    integers: Mapping[str, str] | None = None,
    counts: Mapping[str, str] | None = None,
) -> tuple[Variable, ...]:
    """Variables of a group from the rows of a table.

    Parameters
    ----------
    group : str
        Group of the file.
    rows : sequence of tuple
        Name, dimensions, units, long name, source, features.
    integers : dict
        Name -> type of those that are not f8.
    counts : dict
        Name -> dimension that the variable counts.
    """
    integers, counts = integers or {}, counts or {}
    return tuple(
        Variable(
            group,
            name,
            tuple(dims.split()),
            units,
            long_name,
            source,
            integers.get(name, "f8"),
            frozenset(needs.split()),
            counts.get(name, ""),
        )  # fmt: skip
        for name, dims, units, long_name, source, needs in rows
    )


def select_variables(
    variables: Iterable[Variable],
    features: Iterable[str],
    selection: Sequence[str] = (),
    precision: str = "f64",
) -> tuple[Variable, ...]:
    """Variables whose needs are among the features, in order.

    Parameters
    ----------
    variables : sequence of Variable
    features : set of str
        Features of the scene.
    selection : sequence of str
        Names of `output.variables`: optional outputs (feature REQUESTED) and, with a minus,
        excluded ones.
    precision : str
        "f32": variables of every grain, particle or contact are in single precision.
    """
    present = {*features, REQUESTED}
    selected = [v for v in variables if v.needs <= present and _select_requested(v, selection)]
    if precision == "f64":
        return tuple(selected)
    large = {v.key for v in selected if v.dtype == "f8" and v.grows and EACH & set(v.dims)}
    return tuple(replace(v, dtype="f4") if v.key in large else v for v in selected)


def _select_requested(variable: Variable, selection: Sequence[str]) -> bool:
    if any(name[1:] in (variable.key, variable.name) for name in selection if name[:1] == "-"):
        return not variable.is_optional
    requested = {variable.key, variable.name} & set(selection)
    return REQUESTED not in variable.needs or bool(requested)


def reference_energy(work: Any, kinetic_start: Any, potential_start: Any, losses: Any) -> Any:
    """Energy that has gone through the system [J]: |work| + K(0) + |U(0)| + losses.

    It is the reference of the residual of a ledger; arrays over time or numbers.

    Parameters
    ----------
    work
        Work since the start [J], as are the losses.
    kinetic_start
        Kinetic energy at the start [J].
    potential_start
        Potential energy at the start [J].
    losses
        Sum of all losses [J].

    Returns
    -------
    float or array
    """
    return np.abs(work) + kinetic_start + np.abs(potential_start) + losses


# Variables that the run writes into the series if a method declares them, and those of every
# snapshot. Features: "height" (a finite one), "stages", "filling" (a filling factor), "cell"
# (periodic axes), "snapshots". The time of /snapshots is not called `time`, since a DataTree
# inherits the coordinate of the root with that name.
# fmt: off
_S12 = "S12 section 3.2"
_SERIES = declare(
    "series", [
        ("time", "time", "s", "simulated time", "", ""),
        ("step", "time", "1", "time steps done", "", ""),
        ("height", "time", "m", "top wall above bottom wall", _S12, "height"),
        ("stage", "time", "1", "number of the stage, from 0; their names are in the global "
         "attribute stages", "", "stages"),
        ("filling_factor", "time", "1", "volume of the grains over that of the box or cell, "
         "between plates over projected_area x height", "S12 eq 28, section 3.2", "filling"),
        ("box_length", "time xyz", "m", "edges of the periodic cell, or distance of two walls; not "
         "a number along an open axis", "T19 eq 11", "cell"),
        ("energy_residual", "time", "J", "total energy less that at the start, less work, plus "
         "losses (0 if the ledger closes), with the kinetic energy m v(n-1/2).v(n+1/2)/2 of "
         "successive half steps", "docs, Physics", ""),
        ("energy_residual_relative", "time", "1", "energy_residual over the energy that has gone "
         "through the system, |work| + initial kinetic + |initial potential| + |losses|, but no "
         "less than the largest change of the kinetic energy and the binding energy of the present "
         "contacts", "dusttaichi.running.ledger.turnover", ""),
        ("wall_clock", "time", "s", "real time spent in the run, interruptions left out", "", ""),
    ], {"step": "i8", "stage": "i4"},
)
_SNAPSHOTS = declare(
    "snapshots", [
        ("snapshot_time", "snapshot", "s", "simulated time", "", "snapshots"),
        ("step", "snapshot", "1", "time steps done", "", "snapshots"),
    ], {"step": "i8"},
)
# of a method whose walls are pressed
_OF_WALLS = declare(
    "series", [
        ("pressure", "time wall", "Pa", "pressure on the wall, positive in compression, average "
         "since the last entry or over the stated window; not a number where there is no wall",
         _S12, "walls"),
        ("wall_force", "time wall xyz", "N", "force of the wall on the particles, average as for "
         "pressure", _S12, "walls"),
    ],
)
# fmt: on
COMMON = {variable.key: variable for variable in (*_SERIES, *_SNAPSHOTS)}
_SHARED = COMMON | {variable.key: variable for variable in _OF_WALLS}


def common(*features: str) -> tuple[Variable, ...]:
    """Variables that all methods share, of a scene with these features (see above)."""
    return select_variables(COMMON.values(), features)


def declare_variables(
    table: Mapping[str, Iterable[str | Sequence[str]]],
    integers: Mapping[str, str],
    counts: Mapping[str, str] | None = None,
) -> tuple[Variable, ...]:
    """Variables of a method, a tuple, from its table {group: rows of `declare`}.

    A row that is a mere name is a variable that methods share. counts: of the snapshots.
    """
    out: list[Variable] = []
    for group, rows in table.items():
        of_group = counts if group == "snapshots" else None
        for row in rows:
            if isinstance(row, str):
                out.append(_SHARED[row if group == "series" else f"{group}/{row}"])
            else:
                out += declare(group, [row], integers, of_group)
    return tuple(out)
