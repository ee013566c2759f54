"""Readers of files with grains, one a family of formats; the content decides which it is.

- lists: CSV, tables between white space, text of YADE
- dump, data: LAMMPS and LIGGGHTS
- xyz: XYZ and extended XYZ
- mercury: MercuryDPM

A file with units (`ITEM: UNITS`, `units = micro`, an XYZ in Angstrom, `x [um]`) is read in these;
in all others lengths are in the `units` of the sample, velocities in m/s, spins in rad/s. These
files have no contacts: they are found from the distances.
"""

from __future__ import annotations

import re
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dusttaichi.errors import DustError
from dusttaichi.samples.formats import data, dump, lists, mercury, xyz
from dusttaichi.samples.formats.lammps import run_lammps
from dusttaichi.samples.formats.text import SPACES, Source, decode, read_bytes

if TYPE_CHECKING:
    import types


RESTART = b"LammpS RestartT"
NETCDF = (b"\x89HDF", b"CDF")
OTHERS = {  # of formats that are not read: their first bytes, and what to do
    b"PK\x03\x04": "a zip archive (also xlsx and npz); allowed: the text file in it, as CSV",
    b"\x93NUMPY": "an array of NumPy; allowed: a text of numpy.savetxt, or NetCDF",
    b"<?xml": "an XML file, maybe of VTK; allowed: the CSV that ParaView saves of it (Save Data)",
    b"<VTKFile": "a VTK file; allowed: the CSV that ParaView saves of it (File, Save Data)",
    b"# vtk": "a VTK file; allowed: the CSV that ParaView saves of it (File, Save Data)",
    b"%PDF": "a PDF document; allowed: a text",
    b"solid ": "an STL file of surfaces; allowed: positions of grains",
    b"{": "a JSON file; allowed: CSV or NetCDF",
}


def read(path: Path, settings: Source) -> dict[str, Any]:
    """Arrays of a text file or a restart file of LAMMPS in SI, as columns.state.

    settings: a Source without lines. Raises DustError for a file that cannot be used.
    """
    content, packed = read_bytes(path, settings.name)
    if content.startswith(RESTART):
        if packed:
            raise settings.fault("a packed restart file; allowed: an unpacked one.")
        return _read_restart(path, settings)
    if content.startswith(NETCDF):
        raise settings.fault("a packed NetCDF file; allowed: an unpacked one.")
    unsupported_format = next(
        (text for start, text in OTHERS.items() if content.startswith(start)), None
    )
    if unsupported_format:
        raise settings.fault(f"it is {unsupported_format}.")
    source = replace(settings, lines=decode(content, settings.name))
    module = _reader(source)
    if source.style is not None and module is not data:
        raise DustError(
            f"sample.style = {source.style}: {source.name} is no data file of LAMMPS; leave the "
            "key out (sample.columns names columns)."
        )
    state: dict[str, Any] = module.read(source)
    return state | {"remarks": source.remarks}


def _reader(source: Source) -> types.ModuleType:
    """Module that reads these lines."""
    text = "\n".join(source.lines)
    filled = [line for line in source.lines if line.strip()][:3]
    if filled and filled[0].lstrip().startswith("ITEM:"):
        return dump
    if re.search(data.COUNT, text, re.MULTILINE) and re.search(
        rf"{data.ATOMS}|\b[xyz]lo +[xyz]hi\b", text, re.MULTILINE
    ):
        return data
    if mercury.is_mercury(source):
        return mercury
    return xyz if filled and xyz.count_in(filled[0]) is not None and not _counts_rows(source) \
        else lists  # fmt: skip


def _counts_rows(source: Source) -> bool:
    """True where the number of grains is that of a list, without the comment of an XYZ."""
    filled = [line for line in source.lines if line.strip()]
    rows = [re.split(r"[\s,;]+", line.strip()) for line in filled[1:3]]
    if len(filled[-1].split()) < 3 <= len(rows[-1] if rows else ()):  # commas or semicolons
        return True
    if len(filled) - 1 != xyz.count_in(filled[0]) or not rows:
        return False
    return len(rows[0]) > 2 and all(map(SPACES.is_number, rows[0]))


def _read_restart(path: Path, settings: Source) -> dict[str, Any]:
    """Read the data file that LAMMPS makes of a restart file."""
    with tempfile.TemporaryDirectory() as folder:
        try:
            run_lammps(folder, "-restart2data", str(path.resolve()), "grains.data")
        except DustError as error:
            raise settings.fault(str(error)) from None
        return read(Path(folder) / "grains.data", settings)
