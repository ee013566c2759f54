"""Results that another program has written or changed: checks of their texts and numbers."""

from __future__ import annotations

import pickle
import re
from collections.abc import Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager
from functools import lru_cache
from pathlib import Path
from typing import Any

import yaml

from dusttaichi.errors import DustError
from dusttaichi.results import outputs
from dusttaichi.results.integrity import DIGEST, DamagedFile, open_netcdf, refusal

_CONTROL = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f]")  # a terminal would obey them
_NUMBERS = ("grains", "time_step", "particles", "spacing")
_TEXTS = ("title", "status", "stages", "sample", "scene_resolved")


def check_attributes(recorded: Mapping[str, Any], path: str | Path) -> dict[str, Any]:
    """The global attributes of a result, their texts without control characters.

    Raises DustError where one that is a number or a text is something else.
    """
    clean = {k: _CONTROL.sub("", v) if isinstance(v, str) else v for k, v in recorded.items()}
    for name in _NUMBERS:
        value = clean.get(name, 0)
        if isinstance(value, str) or getattr(value, "size", 1) != 1:
            raise _refuse_attribute(path, name, value, "a number")
    for name in _TEXTS:
        if not isinstance(clean.get(name, ""), str):
            raise _refuse_attribute(path, name, clean[name], "a text")
    return clean


def parse_block(attributes: Mapping[str, Any], name: str, path: str | Path) -> dict[str, Any]:
    """The YAML of an attribute as plain data, {} without it. Raises DustError unless a block."""
    text = attributes.get(name, "")
    data = pickle.loads(_pickle_yaml(text))
    if not isinstance(data, dict) or not all(isinstance(key, str) for key in data):
        raise _refuse_attribute(path, name, text, "a block of YAML")
    return data


@lru_cache(maxsize=64)
def _pickle_yaml(text: str) -> bytes:
    """Plain data of a text, once for all numbers of a run that ask for it; None if not YAML.

    They are pickled, of which every user makes a copy, in a tenth of the time of copy.deepcopy.
    """
    try:
        data = yaml.load(text, getattr(yaml, "CSafeLoader", yaml.SafeLoader)) or {}
    except yaml.YAMLError:
        data = None
    return pickle.dumps(data)


def _refuse_attribute(path: str | Path, name: str, value: object, required: str) -> DustError:
    shown = repr(value) if len(repr(value)) <= 70 else f"{value!r:.67}..."
    return DustError(f"{path}: the attribute {name} = {shown}; {required} is needed. {_ADVICE}")


_ADVICE = "Another program has written or changed the file: take the original from a backup."


@contextmanager
def explain_foreign_errors(paths: Iterable[str | Path]) -> Iterator[None]:
    """Context in which any error of a result without DIGEST is a DustError.

    The content of such a file is unknown. Damage of a large file shows only as it is read. paths:
    result files and run directories; others are ignored.
    """
    try:
        yield
    except DustError:
        raise
    except Exception as error:
        files = [Path(p) / "result.nc" if Path(p).is_dir() else Path(p) for p in paths]
        if isinstance(error, (OSError, RuntimeError)) and "HDF error" in str(error):
            for reason in (refusal(error, file) for file in files if file.exists()):
                if reason is not None and not isinstance(reason, DamagedFile):
                    raise reason from error
            raise DustError(
                f"Damaged ({error}): one of {', '.join(map(str, files))}. Take it from a backup, "
                "or compute it again (--force)."
            ) from error
        foreign = [file for file in files if _is_foreign(file)]
        if not foreign:
            raise
        lines = str(error).splitlines() or [""]
        raise DustError(
            f"{foreign[0]} cannot be used ({type(error).__name__}: {lines[0]:.200}). It has no "
            f"attribute {DIGEST}, and its content is not that of a result. {_ADVICE}"
        ) from error


@contextmanager
def writing(*, force: bool = False, inputs: Collection[str | Path] = ()) -> Iterator[None]:
    """Context in which files of others are not overwritten (`results.outputs.writing`).

    Faults of results are error messages (`explain_foreign_errors`). inputs: paths that are read.
    """
    with outputs.writing(force=force, inputs=inputs), explain_foreign_errors(inputs):
        yield


def _is_foreign(file: Path) -> bool:
    try:
        with open_netcdf(file) as opened:
            return DIGEST not in opened.ncattrs()
    except (DustError, OSError, RuntimeError):
        return False
