"""YAML text to plain data, with the line of every value; duplicate keys are refused."""

import re
from dataclasses import dataclass, field
from typing import Any

import yaml

Path = tuple[str | int, ...]


class _Loader(yaml.SafeLoader):
    """Scalars by the rules of YAML 1.2: off and no are words, 1e-3 is a number."""

    yaml_implicit_resolvers: dict = {}


_Loader.add_implicit_resolver("tag:yaml.org,2002:null", re.compile(r"(?:~|null|Null|NULL|)$"), None)
_Loader.add_implicit_resolver(
    "tag:yaml.org,2002:bool", re.compile(r"(?:true|True|TRUE|false|False|FALSE)$"), list("tTfF")
)
_Loader.add_implicit_resolver(
    "tag:yaml.org,2002:int", re.compile(r"[-+]?[0-9]+$"), list("-+0123456789")
)
_Loader.add_implicit_resolver(
    "tag:yaml.org,2002:float",
    re.compile(
        r"(?:[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?|[-+]?\.(?:inf|Inf|INF)"
        r"|\.(?:nan|NaN|NAN))$"
    ),
    list("-+.0123456789"),
)
_Loader.add_constructor(
    "tag:yaml.org,2002:int", lambda loader, node: int(loader.construct_scalar(node))
)


@dataclass
class Document:
    """data: mappings, lists and scalars. lines: path -> line number from 1.

    problems: (path, text) of what no validation would see.
    """

    data: Any = None
    lines: dict[Path, int] = field(default_factory=dict)
    problems: list[tuple[Path, str]] = field(default_factory=list)


def read(text: str) -> Document:
    """Raises yaml.YAMLError if the text is not YAML."""
    loader = _Loader(text)
    try:
        node = loader.get_single_node()
        document = Document()
        if node is not None:
            document.data = _build(loader, node, (), document, ())
        return document
    finally:
        loader.dispose()


def _build(loader, node, path: Path, document: Document, above: tuple) -> Any:
    document.lines.setdefault(path, node.start_mark.line + 1)
    if node in above:
        raise yaml.YAMLError("an anchor refers to itself")
    above = (*above, node)
    if isinstance(node, yaml.MappingNode):
        return _mapping(loader, node, path, document, above)
    if isinstance(node, yaml.SequenceNode):
        return [
            _build(loader, item, (*path, index), document, above)
            for index, item in enumerate(node.value)
        ]
    if path and node.value == "" and node.style is None:
        document.problems.append((path, "nothing is written here; give a value or remove it"))
    try:
        return loader.construct_object(node)
    except ValueError as error:
        raise yaml.constructor.ConstructorError(None, None, str(error), node.start_mark) from None


def _mapping(loader, node, path: Path, document: Document, above: tuple) -> dict[str, Any]:
    data: dict[str, Any] = {}
    for key_node, value_node in node.value:
        line = key_node.start_mark.line + 1
        if not isinstance(key_node, yaml.ScalarNode):
            raise yaml.constructor.ConstructorError(
                None, None, "a key must be a word", key_node.start_mark
            )
        key = key_node.value
        here = (*path, key)
        if key in data:
            document.problems.append(
                (here, f"the key is given twice, in lines {document.lines[here]} and {line}")
            )
            continue
        document.lines[here] = line
        data[key] = _build(loader, value_node, here, document, above)
    return data
