"""Atom styles of LAMMPS: the columns of their data files, and which of them fit given values.

Source of the columns: lammps.org, read_data, section Atoms.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from dusttaichi.samples.formats.names import names_in
from dusttaichi.samples.formats.text import Source, is_integer_column, is_text

DataFile = Any  # formats.data.DataFile, which imports this module
POSITION = ("x", "y", "z")
FLAGS = ("nx", "ny", "nz")  # images, behind the columns of any style
STYLES = {
    "sphere": "id type diameter density x y z",
    "bpm/sphere": "id molecule type diameter density x y z",
    "ellipsoid": "id type ellipsoidflag density x y z",
    "atomic": "id type x y z",
    "bond": "id molecule type x y z",
    "angle": "id molecule type x y z",
    "molecular": "id molecule type x y z",
    "charge": "id type q x y z",
    "full": "id molecule type q x y z",
    "dipole": "id type q x y z mux muy muz",
    "dielectric": "id type q x y z mux muy muz area ed em epsilon curvature",
    "peri": "id type volume density x y z",
    "body": "id type bodyflag mass x y z",
    "line": "id molecule type lineflag density x y z",
    "tri": "id molecule type triangleflag density x y z",
    "dpd": "id type theta x y z",
    "mdpd": "id type sph_rho x y z",
    "edpd": "id type edpd_temp edpd_cv x y z",
    "sph": "id type sph_rho esph cv x y z",
    "rheo": "id type status sph_rho x y z",
    "rheo/thermal": "id type status sph_rho energy x y z",
    "smd": "id type molecule volume mass kradius cradius x0 y0 z0 x y z",
    "electron": "id type q espin eradius x y z",
    "wavepacket": "id type q espin eradius etag cs_re cs_im x y z",
    "template": "id type molecule template-index template-atom x y z",
    "spin": "id type x y z spx spy spz sp",
    "tdpd": "id type x y z",  # and a number of concentrations
}
_WHOLE = {"molecule", "status", "espin", "etag", "template-index", "template-atom", *FLAGS}
_POSITIVE = {"density", "volume", "mass", "sph_rho", "kradius", "cradius", "edpd_cv", "cv", "area"}
_MARGIN = 1e-3  # of an edge: LAMMPS wraps grains into the box before it writes them
# what the header or a section of the file says of its style
_MARKS = {"ellipsoid": "llipsoids", "line": "ines", "tri": "riangles", "body": "odies"}


def columns_of(values: list[NDArray[Any]], data: DataFile, source: Source) -> tuple[str, list[str]]:
    """Style and names of the columns of the section Atoms.

    The style is that of the scene, of the file's comment, or the only one that its columns and
    their values allow; styles that put the same columns at the same places count as one. Raises
    DustError where there is none or are several, and asks for `sample.style`.
    """
    hint = data.hints.get("Atoms", "")
    row = source.quote(data.sections["Atoms"][0])
    style = source.style or next(iter(hint.split()), "")
    if style not in STYLES and " " in hint and style != "hybrid":  # some other comment
        if names := names_in(hint, len(values), source):
            return "", names
        style = ""
    if style:
        return style, _of_style(style, values, data, source)
    _refuse_infinite(values, data, source)
    marked = [style for style, mark in _MARKS.items()
              if any(name.endswith(mark) for name in (*data.counts, *data.sections))]  # fmt: skip
    fits = [(style, names) for style in (marked or STYLES) if (names := _names(style, len(values)))
            and not _misfit(names, values, data, source, inside=True)]  # fmt: skip
    readings: dict[tuple[Any, ...], list[tuple[str, list[str]]]] = {}
    for style, names in fits:
        readings.setdefault(_reading(names, values), []).append((style, names))
    # concentrations can be anything, and must not be what is left of a damaged file
    if len(readings) == 1 and [style for style, _ in fits] != ["tdpd"]:
        alike = next(iter(readings.values()))
        source.remarks.append(
            f"it names no atom style; {' or '.join(style for style, _ in alike)} alone fits its "
            "columns and values (sample.style names another one)"
        )
        return alike[0]
    none, columns = "its section Atoms names no style", f"the {len(values)} columns of {row}"
    if not fits:
        raise source.fault(
            f"{none}, and none fits {columns}; allowed: the columns of one of {', '.join(STYLES)} "
            "(sample.style says which), or sample.columns with the names of the columns in their "
            "order."
        )
    names = [style for style, _ in fits]
    raise source.fault(
        f"{none}, and {', '.join(names)} fit {columns}; say which it is, for example sample.style: "
        f"{names[0]}, or name the columns with sample.columns."
    )


def _of_style(style: str, values: list[NDArray[Any]], data: DataFile, source: Source) -> list[str]:
    """Names of the columns of a style. Raises DustError where it has others or other values."""
    row = source.quote(data.sections["Atoms"][0])
    if style not in STYLES:
        raise source.fault(
            f"its atom style is {style!r}; allowed: {', '.join(STYLES)} (sample.style), or "
            "sample.columns with the names of the columns in their order."
        )
    names = _names(style, len(values))
    if names is None:
        width = len(STYLES[style].split())
        raise source.fault(
            f"atoms of the style {style} have {width} columns, or {width + 3} with image "
            f"flags, and {row} has {len(values)}; sample.style names another style."
        )
    fault = _misfit(names, values, data, source, inside=False)
    if fault:
        raise source.fault(f"its atoms are not of the style {style}: {fault}; sample.style "
                           "names another style.")  # fmt: skip
    return names


def _refuse_infinite(values: list[NDArray[Any]], data: DataFile, source: Source) -> None:
    for n, numbers in enumerate(values):
        if not is_text(numbers) and not np.isfinite(numbers).all():
            k = data.sections["Atoms"][int(np.argmin(np.isfinite(numbers)))]
            raise source.fault(
                f"{source.quote(k)}: column {n + 1} is not finite; allowed: numbers."
            )


def _names(style: str, width: int) -> list[str] | None:
    """Names of `width` columns of a style, also with image flags; None for another number."""
    names = STYLES[style].split()
    if style == "tdpd":
        concentrations = [f"cc{k + 1}" for k in range(width - len(names))]
        return names + concentrations if concentrations else None
    flags = {len(names): (), len(names) + 3: FLAGS}.get(width)
    return None if flags is None else [*names, *flags]


def _misfit(
    names: list[str], values: list[NDArray[Any]], data: DataFile, source: Source, inside: bool
) -> str | None:
    """Reason why values are not of these columns, or None; inside: positions are in the box."""
    column = dict(zip(names, values, strict=True))
    types = data.counts.get("atom types", np.inf)
    for name, numbers in column.items():
        if name == "type" and is_text(numbers):
            if "Atom Type Labels" in data.sections:
                continue
            return f"the column {name} has texts, and there are no Atom Type Labels"
        if is_text(numbers):
            return f"the column {name} has texts"
        if name in ("id", "type") and not is_integer_column(numbers, 0 if name == "id" else 1):
            return f"the column {name} is not of whole numbers"
        if name == "type" and numbers.max() > types:
            return f"the largest type is {numbers.max():g}, of {types}"
        if name in _WHOLE and not is_integer_column(numbers):
            return f"the column {name} is not of whole numbers"
        if name.endswith("flag") and not (is_integer_column(numbers, 0) and numbers.max() <= 1):
            return f"the column {name} is not of 0 and 1"
        if name in _POSITIVE and not np.all(numbers > 0):
            return f"the column {name} is not positive"
        if name in ("diameter", "eradius") and not np.all(numbers >= 0):
            return f"the column {name} is negative"
    if not inside:
        return None
    ids = column["id"]
    if len(np.unique(ids)) < len(ids) and ids.any():
        return "ids are given twice"
    origin, vectors = data.box
    if not np.isfinite(vectors).all():
        return None
    x = np.column_stack([column[axis] for axis in POSITION])
    if np.any(np.abs((x - origin) @ np.linalg.pinv(vectors) - 0.5) > 0.5 + _MARGIN):
        return "positions are outside of the box"
    return None


def _reading(names: list[str], values: list[NDArray[Any]]) -> tuple[tuple[Any, ...] | None, ...]:
    """Grains by these columns, as a key."""
    read = ("type", *POSITION, "diameter")
    columns = dict(zip(names, values, strict=True))
    return tuple(tuple(columns[name].tolist()) if name in columns else None for name in read)
