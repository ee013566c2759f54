"""The files that a result is in while its run goes on: result.nc, and the parts that continue it.

Once a file has some size it is left as it is, and what follows goes into a further one in the
folder result.parts, so that writing costs the same however much there is already. Every file is
whole by itself. A part names the result that it continues by the identity of that file, and says at
which record of each group it begins; what the files before it hold from there on no longer counts.
At its end a run joins them all into result.nc.
"""

import json
import os
import shutil
import subprocess
import sys
import uuid
from pathlib import Path
from typing import NamedTuple

import netCDF4

from dusttaichi.errors import DustError
from dusttaichi.files import clone, explain, parts_folder, replace_atomically, reserve
from dusttaichi.results.layout import (
    DIGEST,
    attributes_of,
    check_attributes,
    copy_records,
    define,
    describe,
    record_counts,
    write_attributes,
)

# global attributes that put a piece in its place
IDENTITY, CONTINUES, STARTS = "id", "continues", "starts"
OWN = IDENTITY, CONTINUES, STARTS, DIGEST


class Piece(NamedTuple):
    """A file of a result: its records of each group, from `starts` up to `ends`, count."""

    path: Path
    starts: dict
    ends: dict


def identity_of(path):
    """What tells a result file from others; "" of a file that was written before there was one."""
    with netCDF4.Dataset(path) as file:
        return str(getattr(file, IDENTITY, ""))


def new_identity():
    """The identity of a file that is made now."""
    return uuid.uuid4().hex


def pieces_of(path):
    """The Pieces of the result at `path`, in order; the first is that file. OSError is let out."""
    path = Path(path)
    with netCDF4.Dataset(path) as file:
        check_attributes(file)
        identity, totals = str(getattr(file, IDENTITY, "")), record_counts(file)
    found = [Piece(path, dict.fromkeys(totals, 0), totals)]
    for part in sorted(parts_folder(path).glob("[0-9]*.nc")):
        with netCDF4.Dataset(part) as file:
            if getattr(file, CONTINUES, None) != identity:
                break
            check_attributes(file)
            own = json.loads(getattr(file, STARTS))
            starts = {group: own.get(group, 0) for group in record_counts(file)}
            ends = {group: starts[group] + n for group, n in record_counts(file).items()}
        if any(starts[group] > found[-1].ends.get(group, 0) for group in starts):
            break
        before = {group: starts.get(group, n) for group, n in found[-1].ends.items()}
        found[-1] = found[-1]._replace(ends=before)
        found.append(Piece(part, starts, ends))
    return found


def remove_parts(path, after=0):
    """Remove the parts of the result at `path` from the one behind number `after` on."""
    folder = parts_folder(path)
    for part in sorted(folder.glob("[0-9]*.nc"), reverse=True):
        if int(part.stem) > after:
            part.unlink(missing_ok=True)
    if not after:
        shutil.rmtree(folder, ignore_errors=True)


def join(path, lock=None):
    """One file out of the pieces of the result at `path`, in a process of its own: HDF5 does not
    recover from a write that fails. Raises DustError; all pieces are then kept.

    lock: the RunLock of the directory, which that process holds, too, should this one be killed.
    """
    command = [sys.executable, "-m", "dusttaichi.results.pieces", str(path)]
    done = subprocess.run(
        command,
        capture_output=True,
        text=True,
        errors="replace",
        pass_fds=[] if lock is None else lock.descriptors,
        start_new_session=True,  # Ctrl-C waits for its end
    )
    if done.returncode != 0:
        last = (done.stderr.strip().splitlines() or [f"status {done.returncode}"])[-1]
        raise DustError(
            f"The parts of {path} could not be joined into one file: {last}. Nothing is lost: they "
            f"are kept in {parts_folder(path)} and read from there. Mend that and join them with "
            "--resume."
        )


def _put_together(path):
    """Write the joined file in the place of that at `path`. Raises OSError, DustError."""
    pieces, parent = pieces_of(path), os.getppid()
    layout, sizes, static, _, _ = describe(pieces[-1].path)
    with netCDF4.Dataset(pieces[-1].path) as file:
        attributes = attributes_of(file)
    for name in (CONTINUES, STARTS):
        attributes.pop(name, None)
    first, temporary = pieces[0], path.with_name(f".{path.name}.tmp")
    grown = describe(path)
    fits = set(grown[0]) == set(layout)
    fits = fits and all(grown[-1][g] <= n for g, n in pieces[-1].ends.items())
    if fits:  # its records stay where they are; those that no longer count are written over
        clone(path, temporary)
        pieces = pieces[1:]
    else:
        temporary.write_bytes(b"")
    reserve(temporary, sum(piece.path.stat().st_size for piece in pieces) + 1_000_000)
    with netCDF4.Dataset(temporary, "a" if fits else "w", format="NETCDF4") as new:
        if not fits:
            define(new, layout, sizes, static)
        for piece in pieces:
            if os.getppid() != parent:
                raise OSError("the run that joins them has been killed")
            counts = {g: n - piece.starts[g] for g, n in piece.ends.items()}
            with netCDF4.Dataset(piece.path) as old:
                copy_records(old, new, layout, counts, piece.starts)
        write_attributes(new, attributes | {IDENTITY: new_identity()})
    replace_atomically(temporary, first.path)
    remove_parts(path)


def main():
    """Entry point of the process that joins: its argument is the path of the result."""
    path = Path(sys.argv[1])
    try:
        _put_together(path)
    except (OSError, RuntimeError, DustError) as error:
        path.with_name(f".{path.name}.tmp").unlink(missing_ok=True)
        sys.exit(str(error) if isinstance(error, DustError) else explain(error, path))


if __name__ == "__main__":
    main()
