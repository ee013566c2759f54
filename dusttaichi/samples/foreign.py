"""Grains from files of other programs: LAMMPS (dumps, data files, restart files), YADE's text, XYZ.

The first lines of a file identify its format. A file with units (`ITEM: UNITS`, `units = micro`, an
XYZ in Angstrom) is read in these; in all others lengths are in the `units` of the sample,
velocities in m/s, spins in rad/s. Types of LAMMPS are numbers of the scene's materials, from 1 on.
These files have no contacts: they are found from the distances.
"""

import re
import tempfile
from pathlib import Path

import numpy as np

from dusttaichi.errors import DustError
from dusttaichi.processes import run_lammps
from dusttaichi.samples.sample import check_grains

# of LAMMPS: length [m], speed [m/s], angular velocity [rad/s]
UNITS = {
    "micro": (1e-6, 1.0, 1e6),
    "nano": (1e-9, 1.0, 1e9),
    "si": (1.0, 1.0, 1.0),
    "cgs": (1e-2, 1e-2, 1.0),
    "metal": (1e-10, 1e2, 1e12),
    "real": (1e-10, 1e5, 1e15),
}
ANGSTROM = 1e-10
RESTART = b"LammpS RestartT"
# columns of an Atoms section by the style of atoms
STYLES = {"sphere": "id type diameter density x y z", "atomic": "id type x y z"}
VECTORS = {
    "position": ("x", "y", "z"),
    "velocity": ("vx", "vy", "vz"),
    "spin": ("omegax", "omegay", "omegaz"),
}


def reader(head: bytes):
    """Reader of a file with these first bytes; None for an unknown format.

    It is a function (path, where, length_unit, snapshot) -> arrays in SI as `files.read`.
    """
    if head.startswith(RESTART):
        return _read_restart
    text = head.decode("utf-8", errors="replace")
    lines = text.splitlines()
    first = lines[0].strip() if lines else ""
    if first.startswith("ITEM:"):
        return _read_dump
    if re.search(r"^\s*\d+\s+atoms\s*$", text, re.MULTILINE):
        return _read_data
    if re.search(r"^#\s*format\s+\w+", text, re.MULTILINE):
        return _read_yade
    return _read_xyz if first.isdigit() else None


# -- LAMMPS --------------------------------------------------------------------------------------


def _read_restart(path, where, length_unit, snapshot):
    """Read a data file that LAMMPS makes of a restart file."""
    with tempfile.TemporaryDirectory() as folder:
        try:
            run_lammps(folder, "-restart2data", str(path.resolve()), "grains.data")
        except DustError as error:
            raise DustError(f"{where}: {error}") from None
        return _read_data(Path(folder) / "grains.data", where, length_unit, snapshot)


def _read_dump(path, where, length_unit, snapshot):
    lines = _lines(path, where)
    starts = [n for n, line in enumerate(lines) if line.startswith("ITEM: TIMESTEP")]
    begin, end = _chosen(starts, len(lines), snapshot, where)
    items = {}
    for n in range(begin, end):
        if lines[n].startswith("ITEM:"):
            items[lines[n].removeprefix("ITEM:").strip()] = n + 1
    heads = {name.split()[0]: name for name in items}
    if not {"ATOMS", "BOX"} <= set(heads):
        raise DustError(f"{where}: the dump has no ITEM: ATOMS or no BOX BOUNDS; allowed: both.")
    count = int(_numbers(lines[items["NUMBER OF ATOMS"] :][:1], 1, where)[0, 0])
    check_grains(count, where)
    names = heads["ATOMS"].split()[1:]
    rows = _numbers(lines[items[heads["ATOMS"]] :][:count], len(names), where, count)
    box = _numbers([" ".join(li.split()[:2]) for li in lines[items[heads["BOX"]] :][:3]], 2, where)
    head = next((lines[n + 1] for n in range(begin) if lines[n].startswith("ITEM: UNITS")), None)
    factors = _factors(head, length_unit, where)
    columns = dict(zip(names, rows.T, strict=True))
    for axis, (low, high) in zip("xyz", box, strict=True):
        if axis not in columns and f"{axis}s" in columns:  # fractions of the box
            columns[axis] = low + columns[f"{axis}s"] * (high - low)
        columns.setdefault(axis, columns.get(f"{axis}u"))
    ends = [word for word in heads["BOX"].split()[2:] if len(word) == 2 and word not in TILTS]
    return _state(columns, factors, where) | _around(box * factors[0], ends)


TILTS = ("xy", "xz", "yz")


def _around(box, ends):
    """Positions of walls and faces, from a box (3, 2) [m] and its words such as pp, ff and sm."""
    room = np.full((3, 2), np.nan)
    for axis, words in enumerate(ends):
        for side, word in enumerate(words):
            if word in "pf":
                room[axis, side] = box[axis, side]
    found = {"room": room.ravel()}
    periodic = np.array([word == "pp" for word in ends] or [False] * 3)
    if periodic.any():
        found["period"] = np.where(periodic, box[:, 1] - box[:, 0], np.inf)
    return found


def _read_data(path, where, length_unit, snapshot):
    _refuse_snapshot(snapshot, where)
    lines = _lines(path, where)
    sections = [
        (n, re.match(r"(Atoms|Velocities|[A-Z][\w ]*?)\s*(?:#\s*(\w+).*)?$", line))
        for n, line in enumerate(lines)
        if n > 0
    ]
    found = {match[1]: (n, match[2]) for n, match in sections if match}
    if "Atoms" not in found:
        raise DustError(f"{where}: the data file has no section Atoms; allowed: one with grains.")
    count = int(next(li.split()[0] for li in lines if re.match(r"\s*\d+\s+atoms\s*$", li)))
    check_grains(count, where)
    factors = _factors((re.search(r"units\s*=?\s*(\w+)", lines[0]) or [None, None])[1],
                       length_unit, where)  # fmt: skip
    first, style = found["Atoms"]
    rows = _section(lines, first, count, where)
    names = STYLES.get(style or _style_of(rows.shape[1]), "").split()
    if len(names) not in (rows.shape[1], rows.shape[1] - 3):  # with image flags behind
        raise DustError(
            f"{where}: atoms of the style {style or 'that is not named'} with {rows.shape[1]} "
            f"columns; allowed: {' or '.join(STYLES)}."
        )
    columns = dict(zip(names, rows.T, strict=False))
    if "Velocities" in found:
        moves = _section(lines, found["Velocities"][0], count, where)
        order = np.argsort(columns["id"])
        place = np.searchsorted(columns["id"], moves[:, 0], sorter=order)
        for k, name in enumerate((*VECTORS["velocity"], *VECTORS["spin"])[: moves.shape[1] - 1]):
            columns[name] = np.zeros(count)
            columns[name][order[place]] = moves[:, 1 + k]
    return _state(columns, factors, where)


def _style_of(columns):
    """Style of atoms from the number of columns, with or without image flags."""
    return {7: "sphere", 10: "sphere", 5: "atomic", 8: "atomic"}.get(columns)


def _section(lines, first, count, where):
    """The numbers of a section whose heading is line `first`, (count, columns)."""
    rows = [line.split("#")[0] for line in lines[first + 1 :] if line.strip()][:count]
    columns = len(rows[0].split()) if rows else 0
    return _numbers(rows, columns, where, count)


def _factors(style, length_unit, where):
    """Length [m], speed [m/s] and angular velocity [rad/s] of the units of a file."""
    if style is None:
        return (length_unit or 1.0), 1.0, 1.0
    name = style.strip()
    if name not in UNITS:
        raise DustError(f"{where}: its units are {name!r}; allowed: {', '.join(UNITS)}.")
    return UNITS[name]


# -- YADE and XYZ --------------------------------------------------------------------------------


def _read_yade(path, where, length_unit, snapshot):
    """Text of yade.export.text and textExt: "#format x_y_z_r...", columns between white space."""
    _refuse_snapshot(snapshot, where)
    lines = _lines(path, where)
    form = next(li for li in lines if re.match(r"#\s*format", li))
    names = form.split()[-1].split("_")
    rows = [line for line in lines if line.strip() and not line.lstrip().startswith("#")]
    check_grains(len(rows), where)
    width = len(rows[0].split()) if rows else len(names)
    columns = dict(zip(names, _numbers(rows, width, where).T, strict=False))
    if "r" in columns:
        columns["radius"] = columns.pop("r")
    return _state(columns, _factors(None, length_unit, where), where)


def _read_xyz(path, where, length_unit, snapshot):
    lines = _lines(path, where)
    starts, n = [], 0
    while n < len(lines) and lines[n].strip().isdigit():
        starts.append(n)
        n += 2 + int(lines[n])
    begin, _ = _chosen(starts, len(lines), snapshot, where)
    count, about = int(lines[begin]), lines[begin + 1] if begin + 1 < len(lines) else ""
    check_grains(count, where)
    length = ANGSTROM if "angstrom" in about.lower() else length_unit
    form = re.search(r"Properties=\"?([\w:]+)", about)
    names = _properties(form[1]) if form else ["species", "x", "y", "z"]
    rows = [line.split()[: len(names)] for line in lines[begin + 2 :][:count]]
    if len(rows) < count or any(len(row) < len(names) for row in rows):
        raise DustError(f"{where}: fewer lines or columns than in its header; allowed: {count} "
                        f"lines of {len(names)} columns.")  # fmt: skip
    numeric = [k for k, name in enumerate(names) if name != "species"]
    values = _numbers([" ".join(row[k] for k in numeric) for row in rows], len(numeric), where)
    columns = dict(zip([names[k] for k in numeric], values.T, strict=True))
    return _state(columns, _factors(None, length, where), where)


def _properties(text):
    """Names of the columns of an extended XYZ, from "species:S:1:pos:R:3:..."."""
    words, names = text.split(":"), []
    known = {
        "pos": VECTORS["position"],
        "velocity_m_per_s": VECTORS["velocity"],
        "spin_rad_per_s": VECTORS["spin"],
    }
    for name, kind, count in zip(words[::3], words[1::3], words[2::3], strict=False):
        more = known.get(name, [f"{name}_{k}" for k in range(int(count))])
        names += [name if kind != "S" else "species"] if count == "1" else more
    return names


# -- common --------------------------------------------------------------------------------------


def _lines(path, where):
    try:
        return path.read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError as error:
        raise DustError(f"{where}: it cannot be read ({error.strerror}).") from None


def _chosen(starts, end, snapshot, where):
    """First line and end of the requested snapshot, a number or "last"."""
    number = len(starts) - 1 if snapshot == "last" else snapshot
    if not 0 <= number < len(starts):
        raise DustError(
            f"sample.snapshot = {snapshot}: {where} has {len(starts)} snapshots; allowed: 0 to "
            f"{len(starts) - 1}, or last."
        )
    return starts[number], [*starts, end][number + 1]


def _refuse_snapshot(snapshot, where):
    if snapshot != "last":
        raise DustError(f"{where}: this file has no snapshots; leave sample.snapshot out.")


def _numbers(rows, columns, where, count=None):
    """Rows of text as numbers, (rows, columns). Raises DustError where they are something else."""
    try:
        values = np.array([row.split() for row in rows], dtype=float).reshape(-1, columns)
    except ValueError:
        values = None
    if values is None or (count is not None and len(values) != count):
        raise DustError(
            f"{where}: its lines are not {count or 'rows'} of {columns or 'some'} plain numbers "
            "each; allowed: a whole file."
        )
    return values


def _state(columns, factors, where):
    """Arrays in SI from columns by LAMMPS' names, in the order of the ids."""
    missing = [name for name in VECTORS["position"] if columns.get(name) is None]
    if missing:
        raise DustError(f"{where}: it lacks {', '.join(missing)}; allowed: x, y, z of every grain.")
    order = np.argsort(columns["id"], kind="stable") if "id" in columns else slice(None)
    state = {}
    for (quantity, names), factor in zip(VECTORS.items(), factors, strict=True):
        if all(columns.get(name) is not None for name in names):
            state[quantity] = factor * np.column_stack([columns[name] for name in names])[order]
    for name, share in (("radius", 1.0), ("diameter", 0.5)):
        if name in columns:
            state["radius"] = share * factors[0] * columns[name][order]
    kinds = columns["type"] - 1 if "type" in columns else columns.get("material")
    if kinds is not None and np.any(kinds != 0):
        state["material"] = kinds[order].astype(int).tolist()
    return state
