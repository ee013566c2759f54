"""YAML text to plain data, with the line of every value; duplicate keys are refused.

Scalars are those of YAML 1.2; merge keys (`<<: *anchor`) are those of YAML 1.1.
"""

import json
import re
import unicodedata
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import IO, Any

import yaml

Path = tuple[str | int, ...]
MOST_REPEATED = 100_000  # values that aliases may repeat: a nest of them grows without bound
MOST_NESTED = 50  # blocks and lists in each other
MOST_CHARACTERS = 10_000_000  # of a file: a hundred thousand positions have 3
LARGE = 100_000  # characters from which a text is scanned by libyaml alone: Python takes seconds

_CONTROL = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\ud800-\udfff]")
# invisible characters and unusual spaces, as word processors and web pages insert them
_SPACES = re.compile("[\u00a0\u1680\u2000-\u200b\u202f\u205f\u2060\u3000\ufeff]")
_MERGE = "<<"
_FRACTION = r"\d+(?:[eE][-+]?\d+)?(?:\s*[A-Za-zµμ/].*)?"  # behind a decimal comma
_TAG = "tag:yaml.org,2002:"
# The words of YAML 1.2, core schema: off and no are texts, 1e-3 is a number.
_SCALARS = {
    "null": (r"(?:~|null|Null|NULL|)$", None),
    "bool": (r"(?:true|True|TRUE|false|False|FALSE)$", list("tTfF")),
    "int": (r"[-+]?[0-9]+$", list("-+0123456789")),
    "float": (
        r"(?:[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?"
        r"|[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN))$",
        list("-+.0123456789"),
    ),
}


class _Composer(yaml.composer.Composer):
    """Composer of nodes with a limited depth."""

    depth = 0

    def compose_node(self, parent: yaml.Node | None, index: Any) -> yaml.Node | None:
        """The next node; too deep nesting is refused before it exhausts the stack of Python."""
        if self.depth > MOST_NESTED:
            raise _build_depth_error(self.peek_event().start_mark)
        self.depth += 1
        node = super().compose_node(parent, index)
        self.depth -= 1
        return node


class _Loader(_Composer, yaml.SafeLoader):
    """Loader of nodes with the tags of YAML 1.2; this module converts their values."""

    yaml_implicit_resolvers: dict[str, list[tuple[str, re.Pattern[str]]]] = {}


for _name, (_pattern, _first) in _SCALARS.items():
    _Loader.add_implicit_resolver(_TAG + _name, re.compile(_pattern), _first)

_quick_loader: type[_Composer] = _Loader
if yaml.__with_libyaml__:

    class _QuickLoader(_Composer, yaml.cyaml.CParser, yaml.resolver.Resolver):
        """_Loader on the events of libyaml, which is four to ten times faster."""

        yaml_implicit_resolvers = _Loader.yaml_implicit_resolvers

        def __init__(self, stream: str | IO[str]) -> None:
            yaml.cyaml.CParser.__init__(self, stream)
            _Composer.__init__(self)
            yaml.resolver.Resolver.__init__(self)

        def dispose(self) -> None:
            """Do nothing: no file is open."""

    _quick_loader = _QuickLoader


_CONVERT: dict[str, Callable[[str], Any]] = {
    "null": lambda text: None,
    "bool": lambda text: text.lower() == "true",
    "int": int,
    "float": lambda text: float(re.sub(r"\.(?=[inIN])", "", text)),
}


class Lines(dict[Path, int]):
    """Path -> line number from 1, of the key if it has one.

    texts: path -> value as written, of a number or a word that Python writes otherwise (1.10).
    """

    def __init__(self) -> None:
        super().__init__()
        self.texts: dict[Path, str] = {}


@dataclass
class Document:
    """Content of a YAML text.

    data: mappings, lists and scalars. problems: (path, text) of faults that the validation cannot
    see.
    """

    data: Any = None
    lines: Lines = field(default_factory=Lines)
    problems: list[tuple[Path, str]] = field(default_factory=list)


def read(text: str) -> Document:
    """The Document of a YAML text.

    Raises yaml.YAMLError if the text is not YAML, or contains custom tags, keys that are not words,
    anchors that refer to themselves, aliases that repeat more than MOST_REPEATED values, more than
    MOST_NESTED nested blocks or MOST_CHARACTERS.
    """
    if len(text) > MOST_CHARACTERS:
        raise yaml.YAMLError(f"it has {len(text)} characters, {MOST_CHARACTERS} are allowed")
    try:
        node = _compose(text)
    except yaml.reader.ReaderError as error:
        text_before, character = text[: error.position], error.character
        if isinstance(character, int):  # of libyaml, whose position counts bytes
            text_before = text.encode(errors="replace")[: error.position].decode(errors="ignore")
            character = chr(character)
        line, code = text_before.count("\n") + 1, f"U+{ord(character):04X}"
        raise yaml.YAMLError(f"the character {code} is not allowed (line {line})") from None
    except yaml.scanner.ScannerError as error:
        if "nesting depth" in error.problem:  # libyaml's own limit, in recent versions
            raise _build_depth_error(error.problem_mark) from None
        raise
    reader = _Reader()
    if node is not None:
        reader.document.data = reader.build(node, (), ())
    return reader.document


def _compose(text: str) -> yaml.Node | None:
    """The root node of a text. Python's own scanner explains what libyaml refuses."""
    try:
        return yaml.compose(text, _quick_loader)
    except yaml.YAMLError:
        if len(text) >= LARGE:
            raise
        return yaml.compose(text, _Loader)


class _Reader:
    """Builder of a document from YAML nodes."""

    def __init__(self) -> None:
        self.document = Document()
        self.seen: set[int] = set()
        self.repeated = 0

    def build(self, node: yaml.Node, path: Path, ancestors: tuple[yaml.Node, ...]) -> Any:
        """The data of a node; ancestors: the nodes that contain it."""
        self.document.lines.setdefault(path, node.start_mark.line + 1)
        if any(node is ancestor for ancestor in ancestors):
            raise _build_error("an anchor refers to itself", node)
        self.repeated += id(node) in self.seen
        self.seen.add(id(node))
        if self.repeated > MOST_REPEATED:
            raise _build_error(f"its aliases repeat more than {MOST_REPEATED} values", node)
        ancestors = (*ancestors, node)
        if isinstance(node, yaml.MappingNode):
            return self._build_mapping(node, path, ancestors)
        if isinstance(node, yaml.SequenceNode):
            return [self.build(item, (*path, n), ancestors) for n, item in enumerate(node.value)]
        if path and _is_empty(node):
            text = "nothing is written here; give a value or remove it"
            self.document.problems.append((path, text))
        value = _read_scalar(node)
        if not isinstance(value, str) and json.dumps(value) != node.value:
            self.document.lines.texts.setdefault(path, node.value)
        return value

    def _build_mapping(
        self, node: yaml.MappingNode, path: Path, ancestors: tuple[yaml.Node, ...]
    ) -> dict[str, Any]:
        data: dict[str, Any] = {}
        lines = self.document.lines
        last_entry: tuple[str, yaml.Node] | None = None
        for key_node, value_node in _merge_pairs(node, ancestors):
            if not isinstance(key_node, yaml.ScalarNode):
                raise _build_error("a key must be a word", key_node)
            key, line = _read_key(key_node), key_node.start_mark.line + 1
            key_path = (*path, key)
            comma = _find_decimal_comma(last_entry, key, value_node)
            if last_entry is not None and comma is not None:
                self.document.problems.append(((*path, last_entry[0]), comma))
                continue
            last_entry = key, value_node
            if key in data:
                text = f"the key is given twice, in lines {lines[key_path]} and {line}"
                self.document.problems.append((key_path, text))
                continue
            lines[key_path] = line
            data[key] = self.build(value_node, key_path, ancestors)
        return data


def _merge_pairs(
    node: yaml.MappingNode, ancestors: tuple[yaml.Node, ...]
) -> list[tuple[yaml.Node, yaml.Node]]:
    """Pairs (key, value) of a mapping; those of merge keys are last, without keys that it has."""
    pairs = [pair for pair in node.value if not _is_merge(pair[0])]
    if len(pairs) == len(node.value):
        return pairs
    used_keys = {key.value for key, _ in pairs}
    for _, value in (pair for pair in node.value if _is_merge(pair[0])):
        for source in value.value if isinstance(value, yaml.SequenceNode) else [value]:
            if not isinstance(source, yaml.MappingNode):
                raise _build_error(f"{_MERGE} needs a block, or a list of blocks, to merge", value)
            if any(source is ancestor for ancestor in ancestors):
                raise _build_error("an anchor refers to itself", value)
            merged_pairs = [
                p for p in _merge_pairs(source, (*ancestors, source)) if p[0].value not in used_keys
            ]
            used_keys.update(key.value for key, _ in merged_pairs)
            pairs += merged_pairs
    return pairs


def _is_merge(key: yaml.Node) -> bool:
    return isinstance(key, yaml.ScalarNode) and key.value == _MERGE and not key.style


def _is_empty(node: yaml.Node) -> bool:
    return isinstance(node, yaml.ScalarNode) and node.value == "" and not node.style


def _find_decimal_comma(
    last_entry: tuple[str, yaml.Node] | None, key: str, value: yaml.Node
) -> str | None:
    """Fault of {time: 1,5 ns}, which YAML reads as time: 1 and a key `5 ns` without a value."""
    if last_entry is None or not _is_empty(value) or not re.fullmatch(_FRACTION, key):
        return None
    integer_text = last_entry[1].value
    if not isinstance(integer_text, str) or not re.fullmatch(r"[-+]?\d+", integer_text):
        return None
    return (
        "a comma separates two entries here; write a decimal point: "
        f"{integer_text}.{key} in place of {integer_text},{key}"
    )


def _read_scalar(node: yaml.ScalarNode) -> Any:
    """Value of a scalar: a text, a number, true, false or nothing."""
    name = node.tag.removeprefix(_TAG)
    if name == "str":
        text = _read_text(node)
        return _SPACES.sub(" ", text).strip() if not node.style else text
    if name not in _SCALARS or not re.match(_SCALARS[name][0], node.value):
        raise _build_error(f"{node.value!r} cannot be read as {node.tag.replace(_TAG, '!!')}", node)
    try:
        return _CONVERT[name](node.value)
    except ValueError as error:  # a whole number of thousands of digits
        raise _build_error(str(error), node) from None


def _read_text(node: yaml.ScalarNode) -> str:
    """The text of a node; refuses characters that paths and terminals do not accept."""
    match = _CONTROL.search(node.value)
    if match:
        raise _build_error(f"the character U+{ord(match[0]):04X} is not allowed", node)
    return str(node.value)


def _read_key(node: yaml.ScalarNode) -> str:
    """The text of a key; refuses unusual spaces, which would make it another key."""
    match = _SPACES.search(node.value)
    if match and not node.style:
        name = unicodedata.name(match[0], "").lower()
        raise _build_error(
            f"the character U+{ord(match[0]):04X} ({name}) is in {node.value!r}; type an ordinary "
            "space in its place",
            node,
        )
    return _read_text(node)


def _build_depth_error(mark: yaml.Mark) -> yaml.MarkedYAMLError:
    text = f"more than {MOST_NESTED} blocks and lists are nested"
    return yaml.MarkedYAMLError(problem=text, problem_mark=mark)


def _build_error(text: str, node: yaml.Node) -> yaml.MarkedYAMLError:
    return yaml.MarkedYAMLError(problem=text, problem_mark=node.start_mark)
