"""The files of the result of a running run: result.nc, and the segments that continue it.

A file that exceeds some size is complete, and further records go to a new segment (segments.py) in
the folder result.parts, so that the cost of writing is independent of the size of the result.
Numbers are written to a segment as they are, and into NetCDF once, as a run joins all files into
result.nc at its end. The attributes of a segment are the identity of the result that it continues
and the number of its first record in each group; its records replace such records of earlier files.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import uuid
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import netCDF4

from dusttaichi.compute.processes import python_command
from dusttaichi.errors import DustError
from dusttaichi.results import segments
from dusttaichi.results.files import (
    clone,
    explain,
    is_segment,
    list_segments,
    parts_folder,
    remove,
    remove_other_parts,
    replace_atomically,
    reserve,
    temporary_path,
    write_whole,
)
from dusttaichi.results.integrity import (
    DIGEST,
    DamagedFile,
    check,
    numbers_unread,
    open_result,
)
from dusttaichi.results.layout import (
    Contents,
    copy_records,
    count_bytes,
    define,
    describe,
    read_records,
    readable,
    write_attributes,
    write_rows,
    yield_file_blocks,
)

if TYPE_CHECKING:
    from dusttaichi.compute.background import Background
    from dusttaichi.results.layout import Layout, Rows
    from dusttaichi.results.run_lock import RunLock
    from dusttaichi.results.waiting import Batch


IDENTITY = "id"  # global attribute of result.nc, by which its parts know it
CONTINUES, STARTS = "continues", "starts"  # of a part: that identity; first records, as JSON
MARGIN = 1_000_000  # bytes of a joined file beside its records
OWN = IDENTITY, CONTINUES, STARTS, DIGEST  # attributes of one file, not of its continuation


class Piece(NamedTuple):
    """A file of a result, with the records of each group from `starts` up to `ends`."""

    path: Path
    starts: dict[str, int]
    ends: dict[str, int]

    @property
    def number(self) -> int:
        """Its number; 0 is the result itself."""
        return int(self.path.stem) if is_segment(self.path) else 0


def identity_of(path: str | Path) -> str:
    """Identity of a result file; "" of a file of an older version."""
    return str(check(path).attributes.get(IDENTITY, ""))


def new_identity() -> str:
    """A new identity of a file."""
    return uuid.uuid4().hex


def place(identity: str, starts: Mapping[str, int] | None = None) -> dict[str, str]:
    """Attributes of result.nc, or of a part that begins with the records `starts`.

    identity: of result.nc. starts: group -> number.
    """
    if starts is None:
        return {IDENTITY: identity}
    return {CONTINUES: identity, STARTS: json.dumps(starts)}


def pieces_of(path: str | Path) -> list[Piece]:
    """The Pieces of the result at `path`, in order, beginning with that file.

    Raises as `integrity.open_netcdf`; DamagedFile also where a part is missing.
    """
    path = Path(path)
    identity, records = identity_of(path), check(path).records
    pieces = [Piece(path, dict.fromkeys(records, 0), records)]
    _refuse_earlier(path, identity)
    for part_path in list_segments(path):
        attributes, records = segments.check(part_path)
        if attributes[CONTINUES] != identity:
            break  # of an earlier result
        starts = dict.fromkeys(records, 0) | json.loads(attributes[STARTS])
        ends = {group: starts[group] + n for group, n in records.items()}
        if any(starts[group] > pieces[-1].ends.get(group, 0) for group in starts):
            raise DamagedFile(
                f"Records are missing between {pieces[-1].path} and {part_path}: a part is lost. "
                f"Take it from a backup; without {part_path.name} and the parts after it the "
                "earlier records can be read."
            )
        former_ends = {group: starts.get(group, n) for group, n in pieces[-1].ends.items()}
        pieces[-1] = pieces[-1]._replace(ends=former_ends)
        pieces.append(Piece(part_path, starts, ends))
    return pieces


def _refuse_earlier(path: Path, identity: str) -> None:
    """Raise DustError for a result that is continued by NetCDF files, of an earlier version."""
    for part_path in parts_folder(path).glob("[0-9]*.nc"):
        if check(part_path).attributes.get(CONTINUES) == identity:
            raise DustError(
                f"{part_path.parent} has records in the form of an earlier version of dusttaichi. "
                "Join them by that version, with `dust run --resume`."
            )


def describe_until(path: Path, counts: Mapping[str, int]) -> tuple[Contents, Piece]:
    """Contents of a result up to these records of each group, and its last Piece there.

    Raises DustError where it has fewer, or is damaged.
    """
    with readable(path):  # damage is reported now, not at the end of the run
        files = pieces_of(path)
    short = [group for group, n in counts.items() if files[-1].ends.get(group, 0) < n]
    if short:
        raise DustError(
            f"{path} has fewer records of {', '.join(short)} than the checkpoint: they are not "
            "of the same run. Start again with --force."
        )
    while len(files) > 1 and all(n >= counts.get(g, 0) for g, n in files[-1].starts.items()):
        files.pop()  # it is later than the checkpoint
    contents = _describe(path, files[-1])
    attributes = {k: v for k, v in contents.attributes.items() if k not in OWN}
    records = {group: int(counts.get(group, 0)) for group in files[-1].ends}
    return contents._replace(attributes=attributes, records=records), files[-1]


def _describe(path: Path, piece: Piece) -> Contents:
    """Contents of a Piece of the result at `path`, with the static values of that."""
    contents = describe(path)
    if piece.number:
        contents = segments.describe(piece.path)._replace(static=contents.static)
    return contents


def make_exists_error(path: str | Path, remainder: str = "it") -> DustError:
    """Error for an existing result; remainder: such as "with the missing runs"."""
    return DustError(
        f"{path} exists already. Use --force to overwrite it, --resume to continue {remainder}, or "
        "choose another output directory."
    )


def read_piece(path: Path, layout: Layout, counts: Mapping[str, int]) -> Rows:
    """The first `counts` records of each group of a file of a result. Raises DustError."""
    if not is_segment(path):
        return read_records(path, layout, counts)
    with readable(path), segments.open_segment(path) as segment:
        return segment.read_records(counts)


def write_piece(
    path: str | Path,
    contents: tuple[Any, ...],
    attributes: Mapping[str, Any],
    result_path: str | Path,
) -> None:
    """Write one file of a result, whole. Raises OSError, RuntimeError.

    contents: layout, dimensions, static values and rows, as `yield_file_blocks` takes them.
    """
    if path != result_path:
        replace_atomically(segments.write(Path(path), contents, attributes), path)
        return
    layout, dimensions, static, rows = contents
    blocks = yield_file_blocks(
        layout, dimensions, static, rows, attributes, result_path=result_path
    )
    write_whole(path, blocks)


def begin_piece(arguments: tuple[Path, tuple[Any, ...], dict[str, Any], Path]) -> tuple[Any, ...]:
    """Begin `write_piece` of these arguments; returns the call that completes it elsewhere.

    Numbers of a segment are written at once: to send them to another process takes longer. Raises
    OSError.
    """
    path, contents, attributes, result_path = arguments
    if path == result_path:
        return write_piece, *arguments
    return replace_atomically, segments.write(path, contents, attributes), path


def join(
    path: Path,
    lock: RunLock | None = None,
    background: Background | None = None,
    last: Batch | None = None,
) -> str:
    """Join the pieces of the result at `path` into one file; returns its identity.

    In a separate process, since HDF5 does not recover from a failed write: that of `background` if
    it has begun. lock: the RunLock of the directory, which that process holds, too, in case this
    one is killed. last: records that are not on disk and that end the file, with a background.
    Raises DustError; nothing is lost then.
    """
    identity = new_identity()
    if background is not None and background.has_begun:
        background.start((join_pieces, path, identity, last))
        error = background.wait()
        reason = "" if error is None else _explain_joining(error, path)
        if error is not None:
            background.close()  # HDF5 may not work any more
    else:
        reason = _join_in_process(path, identity, lock)
    if reason:
        remove(temporary_path(path))
        raise DustError(
            f"The parts of {path} could not be joined into one file: {reason}. Nothing is lost: "
            f"they are in {parts_folder(path)} and are read from there. Remove the cause and join "
            "them with --resume."
        )
    return identity


def _join_in_process(path: Path, identity: str, lock: RunLock | None) -> str:
    """Join the pieces in a process that ends with it; returns why it could not, or ""."""
    command = python_command("dusttaichi.results.pieces", path, identity)
    process = subprocess.run(
        command,
        capture_output=True,
        text=True,
        errors="replace",
        pass_fds=[] if lock is None else lock.descriptors,
        start_new_session=True,  # Ctrl-C waits for its end
    )
    if process.returncode < 0:
        return f"HDF5 was ended by signal {-process.returncode}, as after a failed write"
    if process.returncode > 0:
        return (process.stderr.strip().splitlines() or ["no message"])[-1]
    return ""


def _put_together(path: Path, identity: str, last: Batch | None = None) -> None:
    """Replace the file at `path` by the joined one of that identity. Raises OSError, DustError.

    last: see `join`. A run calls it in `numbers_unread`: it has written the files or verified those
    that it continued, and numbers are checked as they are copied.
    """
    pieces, parent = pieces_of(path), os.getppid()
    rows: Rows = {}
    if last is None:
        layout, sizes, static, attributes, _ = _describe(path, pieces[-1])
    else:
        _, (layout, sizes, static, rows), attributes, _ = last.arguments
        pieces = [piece for piece in pieces if piece.number < last.number]
        pieces[-1] = pieces[-1]._replace(ends={g: last.starts[g] for g in pieces[-1].ends})
    first, temporary = pieces[0], temporary_path(path)
    first_layout, *_, present = describe(path)
    ends = pieces[-1].ends | (last.ends if last is not None else {})
    fits = set(first_layout) == set(layout) and all(present[g] <= n for g, n in ends.items())
    if fits:  # its records remain; those that are replaced are overwritten
        clone(path, temporary)
        pieces = pieces[1:]
    else:
        temporary.write_bytes(b"")
    size = sum(piece.path.stat().st_size for piece in pieces) + count_bytes(rows)
    reserve(temporary, size + MARGIN)
    with netCDF4.Dataset(temporary, "a" if fits else "w", format="NETCDF4") as joined_file:
        if not fits:
            define(joined_file, layout, sizes, static)
        for piece in pieces:
            if os.getppid() != parent:
                raise OSError("the run was killed")
            counts = {g: n - piece.starts[g] for g, n in piece.ends.items()}
            if piece.number:
                with segments.open_segment(piece.path) as segment:
                    segment.copy_records(joined_file, counts, piece.starts)
                continue
            with open_result(piece.path) as piece_file:
                copy_records(piece_file, joined_file, layout, counts)
        write_rows(joined_file, rows, None if last is None else last.starts)
        attributes = {k: v for k, v in attributes.items() if k not in OWN}
        write_attributes(joined_file, attributes | place(identity))
    replace_atomically(temporary, first.path)
    remove_other_parts(path)


def main(arguments: list[str]) -> None:
    """Entry point of the joining process: path of the result, identity of the joined one."""
    path, identity = Path(arguments[0]), arguments[1]
    try:
        join_pieces(path, identity)
    except (OSError, RuntimeError, DustError) as error:
        sys.exit(_explain_joining(error, path))


def join_pieces(path: Path, identity: str, last: Batch | None = None) -> None:
    """Join the pieces of a result in this process, see `join`. Raises OSError, DustError."""
    try:
        with numbers_unread():
            _put_together(path, identity, last)
    except BaseException:
        remove(temporary_path(path))
        raise


def _explain_joining(error: BaseException, path: Path) -> str:
    return str(error) if isinstance(error, DustError) else explain(error, path)


if __name__ == "__main__":
    main(sys.argv[1:])
