"""Python files that a scene names under `extensions`, imported before the rest of it is read.

This process, and every other one that reads the scene, then has the laws, kinds of samples and
methods that such a file registers. A file is imported once per process and identified by its
content, so that a copy is the same file.
"""

import hashlib
import linecache
import os
import re
import sys
import traceback
import types
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from dusttaichi.compute import compiler
from dusttaichi.errors import DustError
from dusttaichi.physics.registry import Registry, copy_added, restore_added
from dusttaichi.scene import problems, shipped
from dusttaichi.scene.blocks import Path as KeyPath
from dusttaichi.scene.fields import refuse_unreadable
from dusttaichi.scene.paths import path_in

KEY = "extensions"
MOST_BYTES = 10_000_000  # of a file: no law is as long
_EXAMPLE = "for example rolling_with_speed.py"
_NAMED = re.compile(r"\s*([^,\n]+?\.py) sha256:([0-9a-f]{64})")  # the texts of Extension


@dataclass(frozen=True)
class Extension:
    """An imported file: its absolute path, and the SHA-256 of the imported text."""

    path: Path
    digest: str

    def __str__(self) -> str:
        return f"{self.path.name} sha256:{self.digest}"

    @property
    def module(self) -> str:
        """Name of the imported module, the same for copies of the file."""
        return f"dusttaichi_extension_{self.digest[:12]}"


_imported: dict[Path, Extension] = {}
_owners: dict[tuple[str, Any], tuple[Extension, Any]] = {}  # (word, name) -> (file, value)


class _Refusal(Exception):
    """Reason why a file cannot be used, as the end of a line about it."""


_decide_import: ContextVar[Callable[[Path, Path], str | None] | None] = ContextVar(
    "allows", default=None
)


@contextmanager
def restrict_imports(decide: Callable[[Path, Path], str | None]) -> Iterator[None]:
    """Context in which decide(file, folder of the scene) may refuse a file before it is read.

    decide returns the reason, or None. Without it every file that a scene names is imported.
    """
    token = _decide_import.set(decide)
    try:
        yield
    finally:
        _decide_import.reset(token)


def is_outside(path: Path, folder: Path) -> bool:
    """True for a file (resolved path) that is neither bundled nor below the folder of its scene."""
    return not any(
        path.is_relative_to(parent.resolve()) for parent in (folder, shipped.get_folder())
    )


def find_file(entry: str | Path, folder: str | Path | None) -> Path:
    """File of an entry of `extensions` in the folder of its scene, else the bundled one."""
    path = path_in(folder, entry)
    return path if os.path.exists(path) else shipped.find_extension(entry) or path


def load(
    data: Mapping[str, Any],
    folder: str | Path | None,
    *,
    lines: Mapping[KeyPath, int],
    title: str,
    unchanged: bool = False,
) -> tuple[Extension, ...]:
    """Import the files that the plain data of a scene names, each once per process.

    folder: folder of relative paths (default: the current directory). unchanged: refuse a file
    that has changed since it was imported. Raises DustError with one line for each fault.
    """
    entries = data.get(KEY, [])
    imported_files, faults = [], []
    if not isinstance(entries, (list, tuple)):
        text = f"a list of Python files is needed, {_EXAMPLE.replace('rolling', '[rolling')}]"
        faults.append(problems.format_line((KEY,), text, data, lines))
        entries = []
    for number, entry in enumerate(entries):
        try:
            imported_files.append(_import_file(entry, Path(folder or "."), unchanged))
        except _Refusal as error:
            faults.append(problems.format_line((KEY, number), str(error), data, lines))
    if faults:
        raise problems.build_refusal(title, faults)
    return tuple(imported_files)


def import_extension(path: str | Path) -> types.ModuleType:
    """Module of an extension, imported if it is not yet: of a file, or a bundled one by its name.

    Raises DustError where it cannot be imported.
    """
    (extension,) = load({KEY: [path]}, None, lines={}, title=str(path))
    return sys.modules[extension.module]


def import_bundled(attribute: str) -> None:
    """Import the bundled files that a result names in its attribute `extensions`.

    A file is identified by its name and content. It is skipped if another file has registered its
    names.
    """
    for name, digest in _NAMED.findall(attribute):
        imported_digests = {extension.digest for extension in _imported.values()}
        for path in [] if digest in imported_digests else shipped.find_extensions(name):
            if hashlib.sha256(path.read_bytes()).hexdigest() == digest:
                with suppress(DustError):
                    load({KEY: [path]}, None, lines={}, title=name)


def list_missing(attribute: str) -> list[str]:
    """Names of the files in an attribute `extensions` that this process has not imported."""
    imported_digests = {extension.digest for extension in _imported.values()}
    return [name for name, digest in _NAMED.findall(attribute) if digest not in imported_digests]


def find_imported(path: str | Path) -> Extension | None:
    """The Extension of a file that this process has imported, otherwise None."""
    return _imported.get(Path(path).resolve())


def _import_file(entry: Any, folder: Path, unchanged: bool) -> Extension:
    if not isinstance(entry, (str, Path)) or Path(entry).suffix != ".py":
        raise _Refusal(f"a Python file is needed, whose name ends in .py, {_EXAMPLE}")
    try:
        path = find_file(entry, folder).resolve()
    except (OSError, RuntimeError) as error:  # RuntimeError of a loop of links, up to Python 3.12
        raise _Refusal(f"it cannot be found: {error}") from None
    imported_file = _imported.get(path)
    if imported_file is not None and not unchanged:
        return imported_file  # whether the file has changed or not
    decide = _decide_import.get()
    if (
        imported_file is None
        and decide is not None
        and (reason := decide(path, folder)) is not None
    ):
        raise _Refusal(reason)
    try:
        refuse_unreadable(path, MOST_BYTES)
        source = path.read_bytes()
    except (OSError, ValueError) as error:
        reason = "there is no such file" if isinstance(error, FileNotFoundError) else str(error)
        raise _Refusal(
            f"{reason} ({path}); a Python file is needed, relative to the folder of the YAML file"
        ) from None
    extension = Extension(path, hashlib.sha256(source).hexdigest())
    if imported_file is not None and imported_file.digest != extension.digest:
        raise _Refusal(
            f"{path} has changed since this process imported it; restart Python to use the new "
            "version, or restore the old one"
        )
    if extension.digest not in {
        imported_extension.digest for imported_extension in _imported.values()
    }:
        _import(extension, source)
    return _imported.setdefault(path, extension)


def _import(extension: Extension, source: bytes) -> None:
    """Run a file as a module; its registrations are undone where it cannot be used."""
    former_values = copy_added()
    _imported[extension.path] = extension
    try:
        _run_file(extension, source)
        _record_owners(extension, former_values)
    except BaseException:
        del _imported[extension.path]
        restore_added(former_values)
        raise


def _run_file(extension: Extension, source: bytes) -> None:
    path = str(extension.path)
    module = types.ModuleType(extension.module)
    module.__file__ = path
    try:
        code = compile(source, path, "exec", dont_inherit=True)
    except SyntaxError as error:
        location = path if error.lineno is None else f"{path}, line {error.lineno}"
        raise _Refusal(f"it is not valid Python: {error.msg} ({location})") from None
    except ValueError as error:
        raise _Refusal(f"it is not valid Python: {error} ({path})") from None
    # Taichi compiles from the text when a kernel is first needed; it must be the imported text
    text = source.decode("utf-8", "replace")
    linecache.cache[path] = (len(source), None, text.splitlines(keepends=True), path)
    sys.modules[module.__name__] = module
    try:
        exec(code, module.__dict__)
    except KeyboardInterrupt:
        raise
    except BaseException as error:  # any class of error that the file may define
        del sys.modules[module.__name__]
        raise _Refusal(_describe_exception(error, path)) from None
    _refuse_another_compiler(module)


def _refuse_another_compiler(module: types.ModuleType) -> None:
    """Refuse a module that imports another compiler, which cannot call its kernels' functions."""
    modules = [value for value in vars(module).values() if isinstance(value, types.ModuleType)]
    for name in {
        imported_module.__name__ for imported_module in modules
    } & compiler.PREFIX.keys() - {compiler.name()}:
        raise _Refusal(
            f"it imports {name}, while {compiler.name()} compiles the kernels; write `from "
            f"dusttaichi import ti` instead ({module.__file__})"
        )


def _describe_exception(error: BaseException, path: str) -> str:
    """Exception and its line in the file, as one line."""
    frames = traceback.extract_tb(error.__traceback__)
    line = next((frame.lineno for frame in reversed(frames) if frame.filename == path), None)
    location = path if line is None else f"{path}, line {line}"
    message = " ".join([f"{type(error).__name__}:", *str(error).split()]).removesuffix(":")
    return f"it cannot be imported, its code raises {message} ({location})"


# -- registrations ------------------------------------------------------------------------------


def _record_owners(extension: Extension, former_values: dict[str, dict[Any, Any]]) -> None:
    """Record the registrations of this file. Refuses names that another file has registered."""
    new_owners = {}
    for registry in Registry.registries:
        word = registry.word
        former = former_values.get(word, {})
        for name, value in registry.added.items():
            owner, owned_value = _owners.get((word, name), (None, None))
            if value is former.get(name) or value is owned_value:
                continue  # registered earlier, or by an imported file
            if owner is not None:
                text = ".".join(name) if isinstance(name, tuple) else name
                raise _Refusal(
                    f"it registers the {word} {text}, as {owner.path} does, which differs; a name "
                    "of its own is needed"
                )
            new_owners[word, name] = (extension, value)
    _owners.update(new_owners)
