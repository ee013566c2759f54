"""Reads a scene from a YAML file; the JSON Schema of such files."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml

from dusttaichi import method
from dusttaichi.errors import DustError
from dusttaichi.scene import extensions, plain_values, problems, shipped, yaml_text
from dusttaichi.scene.fields import refuse_unreadable
from dusttaichi.scene.keys import find_scene_class
from dusttaichi.scene.paths import user_path
from dusttaichi.scene.readable_schema import make_readable, select_by_key
from dusttaichi.scene.scene import Scene
from dusttaichi.scene.yaml_text import MOST_CHARACTERS

DRAFT = "https://json-schema.org/draft/2020-12/schema"


def load(path: str | Path) -> Scene:
    """Scene of a YAML file, with `source` and `path` set.

    Parameters
    ----------
    path
        A file, or the name of a bundled scene, such as "omni_static".

    Raises
    ------
    DustError
        The file is missing, not readable, not YAML, or not a scene; the last with one line for each
        fault, with its path in the YAML, value, allowed values, and line number.
    """
    path = _find_file(path)
    scene = from_yaml(_read_text(path), path.parent, title=str(path), check_files=True)
    scene._path = path
    return scene


def from_yaml(
    text: str,
    folder: str | Path | None = None,
    *,
    title: str = "the scene",
    check_files: bool = False,
) -> Scene:
    """Scene of a YAML text.

    Parameters
    ----------
    text
    folder
        Folder of relative paths in the text.
    title
        Name of the scene in errors.
    check_files
        As in `Scene.from_dict`.

    Raises
    ------
    DustError
        The text is not YAML or no valid scene.
    """
    document = _read_document(text, title)
    _refuse_problems(document, title)
    scene = Scene.from_dict(
        document.data, folder, lines=document.lines, title=title, check_files=check_files
    )
    scene._source = text
    return scene


def as_scene(source: Scene | str | Path | Mapping[str, Any]) -> Scene:
    """Scene of anything that defines one.

    Parameters
    ----------
    source
        A Scene, a file, the name of a bundled scene, YAML as text (several lines, or one that
        begins with a brace), or plain data with the keys of a file.

    Raises
    ------
    DustError
        It cannot be read, or is no valid scene.
    """
    if isinstance(source, Scene):
        return source
    if isinstance(source, Mapping):
        return Scene.from_dict(plain_values.without_numpy(dict(source)))
    if isinstance(source, str) and ("\n" in source or source.lstrip().startswith("{")):
        return from_yaml(source)
    if isinstance(source, (str, Path)):
        return load(source)
    raise DustError(
        f"{source!r:.60} ({type(source).__name__}) is no scene; a Scene, the path of a YAML file, "
        "the name of a bundled scene, YAML as text or a dictionary is needed."
    )


def load_extensions(path: str | Path) -> None:
    """Import the extensions of a YAML file, so that the JSON Schema includes them.

    Other keys of the file need not be valid.

    Raises
    ------
    DustError
        The file or an extension cannot be read.
    """
    path, title = _find_file(path), str(path)
    document = _read_document(_read_text(path), title)
    _refuse_problems(document, title)
    extensions.load(document.data, path.parent, lines=document.lines, title=title, unchanged=True)


def _refuse_problems(document: yaml_text.Document, title: str) -> None:
    if document.problems:
        problem_lines = [
            problems.format_line(p, t, None, document.lines) for p, t in document.problems
        ]
        raise problems.build_refusal(title, problem_lines)


def _find_file(path: str | Path) -> Path:
    """The file itself; where there is none, the bundled scene of that name."""
    path = user_path(path)
    try:
        return path if path.is_file() else shipped.find_scene(path) or path
    except OSError:  # such as a name that is too long
        return path


def _read_text(path: Path) -> str:
    try:
        refuse_unreadable(path, MOST_CHARACTERS)
        return path.read_text(encoding="utf-8")
    except UnicodeDecodeError:
        raise DustError(f"{path} is not a text file in UTF-8; a YAML file is needed.") from None
    except ValueError as error:
        raise DustError(f"{_shorten(path)}: {error}; a YAML file is needed.") from None
    except FileNotFoundError:
        near = shipped.find_similar_names(path)
        hint = f" Do you mean the bundled scene {near[0]}?" if near else ""
        raise DustError(f"{path}: there is no such file.{hint}") from None
    except PermissionError:
        raise DustError(f"{path} cannot be read: permission denied.") from None
    except OSError as error:
        raise DustError(f"{path} cannot be read: {error.strerror or error}.") from None


def _shorten(path: Path) -> str:
    """A path for a message; a very long one is shortened."""
    text = str(path)
    return text if len(text) <= 200 else f"{text[:150]}...{text[-40:]}"


def _read_document(text: str, title: str) -> yaml_text.Document:
    try:
        document = yaml_text.read(text)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        location = f" (line {mark.line + 1}, column {mark.column + 1})" if mark else ""
        raise DustError(f"{title} is not valid YAML: {error.problem}{location}.") from None
    except (yaml.YAMLError, RecursionError) as error:
        raise DustError(f"{title} is not valid YAML: {str(error).splitlines()[0]}.") from None
    if document.data is None:
        raise DustError(f"{title} is empty; {_BLOCKS}.")
    if not isinstance(document.data, dict):
        raise DustError(f"{title} does not contain a scene; {_BLOCKS}.")
    return document


_BLOCKS = "the keys name, material, sample, boundary and stop (or stages) are needed"


def json_schema() -> dict[str, Any]:
    """JSON Schema (draft 2020-12) of the YAML file, shorthands included, for editors.

    It includes everything that is registered in this process.
    """
    schemas = [
        _without_titles(find_scene_class(name).model_json_schema()) for name in method.METHODS
    ]
    head = {"$schema": DRAFT, "title": "dusttaichi scene", "description": "One run of dusttaichi."}
    blocks = {name: block for schema in schemas for name, block in schema.pop("$defs").items()}
    blocks = {name: make_readable(block, blocks) for name, block in blocks.items()}
    scenes = {
        name: make_readable(schema, blocks)
        for name, schema in zip(method.METHODS, schemas, strict=True)
    }
    scene_schema = select_by_key("method", scenes, method.DEFAULT)
    method_description = next(iter(scenes.values()))["properties"]["method"].get(
        "description", "method"
    )
    scene_schema["properties"]["method"]["description"] = method_description
    return {**head, **scene_schema, "$defs": blocks}


def schema_text() -> str:
    """Content of the file configs/scene.schema.json."""
    return json.dumps(json_schema(), indent=2, ensure_ascii=False) + "\n"


def _without_titles(node: Any) -> Any:
    """The schema without pydantic's titles, which only repeat the names of the fields."""
    if isinstance(node, dict):
        items = ((k, v) for k, v in node.items() if not (k == "title" and isinstance(v, str)))
        return {key: _without_titles(value) for key, value in items}
    return [_without_titles(item) for item in node] if isinstance(node, list) else node
