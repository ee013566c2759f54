"""Stored results of a study: rows of answers in files, modes of runs."""

from __future__ import annotations

import json
import os
from contextlib import suppress
from pathlib import Path
from typing import Any

from dusttaichi.errors import DustError
from dusttaichi.results import files
from dusttaichi.results.pieces import make_exists_error
from dusttaichi.studies.workers import INTERRUPTED, Answer

UNFINISHED = ".unfinished"  # suffix of the file of checkpoints beside that of the rows
CHECKPOINT = "checkpoint"  # of an interrupted task: in its answer, and an argument of the next one
ALL_POINTS = 1, 1  # the part (k, n) that is all of a study


class ResultStore:
    """Stored results of a study.

    force: they are computed again; resume: the missing ones are; else there must be none. timed:
    costs are needed. part: (k, n) of the study that is computed. modes: label -> mode of each run
    that has been looked up.
    """

    def __init__(
        self, *, force: bool, resume: bool, timed: bool, part: tuple[int, int] = ALL_POINTS
    ) -> None:
        self.force, self.resume, self.timed, self._part = force, resume, timed, part
        self.modes: dict[str, str | None] = {}
        self._rows: dict[Path | None, Rows] = {}

    def open_rows(self, file: Path | None) -> Rows:
        """The Rows of a file, or of None."""
        if file not in self._rows:
            self._rows[file] = Rows(file, force=self.force, resume=self.resume, part=self._part)
        return self._rows[file]


class Rows:
    """Answers in a file, a line of JSON each: the row with its `key`, or with an `error`.

    path: None where they are not stored. Each part (k, n) of a study, which may run at the same
    time as others, has a file of its own beside it. rows_by_key: rows of all these files, without
    those of failed requests, which are computed again. unfinished: key -> checkpoint of interrupted
    requests; these are in files that end with UNFINISHED. Raises DustError where the file exists,
    with neither force nor resume, or cannot be written.
    """

    def __init__(
        self,
        path: Path | None,
        *,
        force: bool,
        resume: bool,
        part: tuple[int, int] = ALL_POINTS,
    ) -> None:
        self.path = path
        self.rows_by_key: dict[str, dict[str, Any]] = {}
        self.unfinished: dict[str, Any] = {}
        self._checkpoint_files: list[Path] = []
        if path is None:
            return
        is_complete = part == ALL_POINTS
        part_files = sorted(path.parent.glob(f"{path.stem}.*-of-*{path.suffix}"))
        own_file = path
        if not is_complete:
            own_file = path.with_name("{}.{}-of-{}{}".format(path.stem, *part, path.suffix))
        self.path = own_file
        written = [path, *part_files] if is_complete else [path, own_file]
        existing = [file for file in written if file.exists()]
        if existing and not force and not resume:
            raise make_exists_error(existing[0], "with the missing ones")
        own_rows = self._read_all([path, *part_files], own_file) if resume and not force else {}
        rows = self.rows_by_key if is_complete else own_rows
        self._write(own_file, "".join(_format_row(key, row) for key, row in rows.items()))
        for file in part_files if force and is_complete else ():
            files.remove(file)
        written = [path, *part_files] if is_complete else [own_file]
        self._checkpoint_files = [file.with_suffix(UNFINISHED) for file in written]
        self._remove_checkpoints()

    def _read_all(self, paths: list[Path], own_file: Path) -> dict[str, dict[str, Any]]:
        """Read rows and checkpoints of all files; returns the rows of `own_file`."""
        for file in paths:
            self.rows_by_key |= {} if file == own_file else _read_rows(file)
        own_rows = _read_rows(own_file)
        self.rows_by_key |= own_rows
        for file in {*paths, own_file}:
            for key, row in _read_rows(file.with_suffix(UNFINISHED)).items():
                if key not in self.rows_by_key:
                    self.unfinished[key] = row[CHECKPOINT]
        return own_rows

    def _remove_checkpoints(self) -> None:
        """Remove the files of the checkpoints once nothing is unfinished."""
        for file in () if self.unfinished else self._checkpoint_files:
            files.remove(file)

    def _write(self, path: Path, text: str) -> None:
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            files.write_whole(path, text.encode())
        except OSError as error:
            raise _make_write_error(path, error) from error

    def add(self, key: str, answer: Answer) -> None:
        """Add the line of an Answer, on the disk when this returns. Raises DustError.

        One that was interrupted has a line among the unfinished ones where it has a checkpoint.
        """
        if self.path is None:
            return
        if answer.code == INTERRUPTED:
            if CHECKPOINT in answer.values:
                row = {CHECKPOINT: answer.values[CHECKPOINT]}
                self._append(self.path.with_suffix(UNFINISHED), key, row)
            return
        row = {"error": answer.text, "code": answer.code} if answer.code else answer.values
        self._append(self.path, key, row)
        if self.unfinished.pop(key, None) is not None:
            self._remove_checkpoints()

    def _append(self, path: Path, key: str, row: dict[str, Any]) -> None:
        try:
            with path.open("a", encoding="utf-8") as file:
                file.write(_format_row(key, row))
                file.flush()
                os.fsync(file.fileno())
        except OSError as error:
            raise _make_write_error(path, error) from error


def _make_write_error(path: Path, error: OSError) -> DustError:
    return DustError(f"Cannot write {path}: {files.explain(error, path)}.")


def _read_rows(path: Path) -> dict[str, dict[str, Any]]:
    """key -> row of the lines of a file that have numbers, {} without a file."""
    rows = {}
    for line in path.read_text(encoding="utf-8").splitlines() if path.exists() else ():
        with suppress(ValueError, KeyError, TypeError):  # the last may have been cut off
            row = json.loads(line)
            if "error" not in row:
                rows[row.pop("key")] = row
    return rows


def _format_row(key: str, row: dict[str, Any]) -> str:
    return json.dumps({"key": key, **row}) + "\n"
