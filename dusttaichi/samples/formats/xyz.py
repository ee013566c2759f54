"""XYZ and extended XYZ, as of ASE and OVITO."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dusttaichi.samples.formats.cell import cell
from dusttaichi.samples.formats.columns import Units, make_table, state
from dusttaichi.samples.formats.names import COMPONENTS, OTHER, STEMS, names_in
from dusttaichi.samples.formats.order import guess
from dusttaichi.samples.formats.text import SPACES, Source, is_text, parse

ANGSTROM = 1e-10  # [m]
DALTON = 1.66053906660e-27  # [kg], of masses in ASE
VECTORS = {stem: COMPONENTS[name] for stem, name in STEMS.items() if name in COMPONENTS} | {
    "velocity_m_per_s": COMPONENTS["velocity"],
    "spin_rad_per_s": COMPONENTS["spin"],
}
_COUNT = re.compile(r"\s*\+?(\d+)\s*(?:#.*)?")
_WORDS = re.compile(r"([\w-]+)\s*=\s*(?:\"([^\"]*)\"|'([^']*)'|\{([^}]*)\}|\[([^\]]*)\]|(\S+))")


@dataclass(frozen=True)
class _Frame:
    about: int  #: Line of the comment.
    rows: list[int]


def count_in(line: str) -> int | None:
    """Number of grains of a line that starts a snapshot, None for another line."""
    match = _COUNT.fullmatch(line)
    return None if match is None else int(match[1])


def read(source: Source) -> dict[str, Any]:
    """State of the requested snapshot, as columns.state, with the cell of an extended XYZ.

    Raises DustError where the number of grains is not that of the lines, and where columns without
    names can be several things.
    """
    frame = source.choose_frame(_frames(source))
    about = source.lines[frame.about]
    values = parse(source, frame.rows)
    if not any(map(is_text, values)) and _is_row(about, len(values)):
        raise source.fault(
            f"{source.quote(frame.about)} can be the comment of an XYZ or a grain of a list; "
            "allowed: a comment of words, or as many lines as the first line announces."
        )
    info = {m[1].lower(): next(filter(None, m.groups()[1:]), "") for m in _WORDS.finditer(about)}
    names = _names(info, about, values, frame, source)
    table = make_table(names, values, frame.rows, source)
    length = ANGSTROM if re.search("angstrom|Å", about, re.IGNORECASE) else source.length
    if length != source.length and source.length not in (1.0, length):
        source.remarks.append("its comment says Angstrom, so that sample.units is not used")
    mass = 1.0 if source.contents.needs_mass else DALTON  # not those of atoms
    state_of_frame = state(table, source, Units(length=length, mass=mass, matter="masses" in about))
    if "lattice" in info:
        state_of_frame |= _cell(info, length, source, frame.about)
    if "time_s" in info and SPACES.is_number(info["time_s"]):
        state_of_frame["time"] = float(info["time_s"])
    return state_of_frame


def _is_row(text: str, width: int) -> bool:
    """True for a line of as many numbers as grains have columns."""
    words = text.split()
    return len(words) == width and all(map(SPACES.is_number, words))


def _frames(source: Source) -> list[_Frame]:
    lines, n = source.lines, 0
    frames: list[_Frame] = []
    while n < len(lines):
        if not lines[n].strip() or (frames and lines[n].lstrip().startswith("#")):
            n += 1
            continue
        count = count_in(lines[n])
        if count is None:
            if not frames:
                raise source.fault(
                    f"{source.quote(n)} is no number of grains; allowed: that of a snapshot."
                )
            raise source.fault(
                f"line {frames[-1].about} announces {len(frames[-1].rows)} grains, and "
                f"{source.quote(n)} is one line more; allowed: as many lines as announced, then "
                "the number of grains of another snapshot."
            )
        rows = list(range(n + 2, min(n + 2 + count, len(lines))))
        rows = [k for k in rows if lines[k].strip()]
        short = next((k for k in rows if len(lines[k].split()) < 3), None)
        if len(rows) < count or short is not None:
            end = "the file ends" if short is None else f"{source.quote(short)} is no grain"
            count_read = len(rows) if short is None else rows.index(short)
            raise source.fault(
                f"line {n + 1} announces {count} grains, and the number of lines below its comment "
                f"(line {n + 2}) is {count_read}, where {end}; allowed: the same, without empty "
                "lines."
            )
        frames.append(_Frame(n + 1, rows))
        n += 2 + count
    if not frames[-1].rows:
        raise source.fault(f"line {frames[-1].about} announces no grains; allowed: one or more.")
    return frames


def _names(
    info: Mapping[str, str], about: str, values: list[NDArray[Any]], frame: _Frame, source: Source
) -> list[str]:
    width = len(values)
    if source.columns is not None:
        return list(source.columns)
    if "properties" in info:
        return _properties(info["properties"], width, source, frame)
    return names_in(about, width, source) or guess(values, source, frame.rows[0])


def _properties(text: str, width: int, source: Source, frame: _Frame) -> list[str]:
    """Names of the columns of an extended XYZ, from "species:S:1:pos:R:3:..."."""
    words = text.split(":")
    names: list[str] = []
    if len(words) % 3 or not all(word.isdigit() for word in words[2::3]):
        raise source.fault(
            f"line {frame.about + 1}: Properties={text}; allowed: name:kind:columns for each "
            "property, as in species:S:1:pos:R:3."
        )
    property_names = [name.lower() for name in words[::3]]
    for name, property_type, count in zip(property_names, words[1::3], words[2::3], strict=True):
        vector = VECTORS.get(name) if count == "3" and property_type != "S" else None
        # SI beside, which is the same in other units
        if vector == COMPONENTS["velocity"] and name != "velocity_m_per_s":
            vector = None if "velocity_m_per_s" in property_names else vector
        names += vector or ([name] if count == "1" else [OTHER + name] * int(count))
    if len(names) != width:
        raise source.fault(
            f"line {frame.about + 1}: its Properties have {len(names)} columns, and "
            f"{source.quote(frame.rows[0])} has {width}; allowed: the same."
        )
    if "spin" in property_names and words[3 * property_names.index("spin") + 2] == "1":
        names = [OTHER + name if name == "spin" else name for name in names]
    return names


def _cell(info: Mapping[str, str], length: float, source: Source, n: int) -> dict[str, Any]:
    """Cell of Lattice, Origin and pbc."""
    try:
        vectors = np.array(info["lattice"].replace(",", " ").split(), float).reshape(3, 3)
        origin = np.array(info.get("origin", "0 0 0").replace(",", " ").split(), float).reshape(3)
    except ValueError:
        raise source.fault(
            f"line {n + 1}: its Lattice or Origin is not 9 or 3 numbers; allowed: these."
        ) from None
    # ASE: a lattice without pbc is periodic
    flags = re.findall(r"[TtFf10]\w*", info.get("pbc", "T T T"))
    periodic = [flag[0] in "Tt1" for flag in flags]
    ends = ["pp" if flag else "ff" for flag in periodic] if len(periodic) == 3 else None
    return cell(length * vectors, length * origin, ends)
