"""YAML text to plain data, with the line of every value; duplicate keys are refused.

Scalars are those of YAML 1.2; merge keys (`<<: *anchor`) are those of YAML 1.1.
"""

import json
import re
import unicodedata
from dataclasses import dataclass, field
from typing import Any

import yaml

Path = tuple[str | int, ...]
MOST_REPEATED = 100_000  # values that aliases may repeat: a nest of them grows without bound
MOST_NESTED = 50  # blocks and lists in each other
MOST_CHARACTERS = 10_000_000  # of a file: a hundred thousand positions have 3
LARGE = 100_000  # characters from which a text is scanned by libyaml alone: Python takes seconds

_CONTROL = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\ud800-\udfff]")
# what looks like a space or like nothing, as word processors and web pages insert it
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

    def compose_node(self, parent, index):
        """The next node; too deep nesting is refused before it exhausts the stack of Python."""
        if self.depth > MOST_NESTED:
            raise _too_deep(self.peek_event().start_mark)
        self.depth += 1
        node = super().compose_node(parent, index)
        self.depth -= 1
        return node


class _Loader(_Composer, yaml.SafeLoader):
    """Loader of nodes with the tags of YAML 1.2; their values are made in this module."""

    yaml_implicit_resolvers: dict = {}


for _name, (_pattern, _first) in _SCALARS.items():
    _Loader.add_implicit_resolver(_TAG + _name, re.compile(_pattern), _first)

_QuickLoader: type = _Loader
if yaml.__with_libyaml__:

    class _QuickLoader(_Composer, yaml.cyaml.CParser, yaml.resolver.Resolver):  # noqa: F811
        """_Loader on the events of libyaml, which is four to ten times faster."""

        yaml_implicit_resolvers = _Loader.yaml_implicit_resolvers

        def __init__(self, stream):
            yaml.cyaml.CParser.__init__(self, stream)
            _Composer.__init__(self)
            yaml.resolver.Resolver.__init__(self)

        def dispose(self):
            """Nothing is left open."""


_MAKE = {
    "null": lambda text: None,
    "bool": lambda text: text.lower() == "true",
    "int": int,
    "float": lambda text: float(re.sub(r"\.(?=[inIN])", "", text)),
}


class Lines(dict[Path, int]):
    """Path -> line number from 1, of the key if it has one.

    texts: path -> value as written, of a number or a word that Python writes otherwise (1.10).
    """

    def __init__(self):
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
        node = _composed(text)
    except yaml.reader.ReaderError as error:
        before, character = text[: error.position], error.character
        if isinstance(character, int):  # of libyaml, whose position counts bytes
            before = text.encode(errors="replace")[: error.position].decode(errors="ignore")
            character = chr(character)
        line, code = before.count("\n") + 1, f"U+{ord(character):04X}"
        raise yaml.YAMLError(f"the character {code} is not allowed (line {line})") from None
    except yaml.scanner.ScannerError as error:
        if "nesting depth" in error.problem:  # libyaml's own limit, in recent versions
            raise _too_deep(error.problem_mark) from None
        raise
    reader = _Reader()
    if node is not None:
        reader.document.data = reader.build(node, (), ())
    return reader.document


def _composed(text: str) -> yaml.Node | None:
    """The root node of a text. Python's own scanner explains what libyaml refuses."""
    try:
        return yaml.compose(text, _QuickLoader)
    except yaml.YAMLError:
        if len(text) >= LARGE:
            raise
        return yaml.compose(text, _Loader)


class _Reader:
    """Builder of a document from YAML nodes."""

    def __init__(self):
        self.document = Document()
        self.seen: set[int] = set()
        self.repeated = 0

    def build(self, node: yaml.Node, path: Path, above: tuple[yaml.Node, ...]) -> Any:
        """The data of a node; above: the nodes around it."""
        self.document.lines.setdefault(path, node.start_mark.line + 1)
        if any(node is other for other in above):
            raise _refused("an anchor refers to itself", node)
        self.repeated += id(node) in self.seen
        self.seen.add(id(node))
        if self.repeated > MOST_REPEATED:
            raise _refused(f"its aliases repeat more than {MOST_REPEATED} values", node)
        above = (*above, node)
        if isinstance(node, yaml.MappingNode):
            return self._mapping(node, path, above)
        if isinstance(node, yaml.SequenceNode):
            return [self.build(item, (*path, n), above) for n, item in enumerate(node.value)]
        if path and _is_empty(node):
            text = "nothing is written here; give a value or remove it"
            self.document.problems.append((path, text))
        value = _scalar(node)
        if not isinstance(value, str) and json.dumps(value) != node.value:
            self.document.lines.texts.setdefault(path, node.value)
        return value

    def _mapping(self, node: yaml.MappingNode, path: Path, above: tuple) -> dict[str, Any]:
        data: dict[str, Any] = {}
        lines = self.document.lines
        before = None
        for key_node, value_node in _merged(node, above):
            if not isinstance(key_node, yaml.ScalarNode):
                raise _refused("a key must be a word", key_node)
            key, line = _key(key_node), key_node.start_mark.line + 1
            here = (*path, key)
            if (text := _decimal_comma(before, key, value_node)) is not None:
                self.document.problems.append((here[:-1] + (before[0],), text))
                continue
            before = key, value_node
            if key in data:
                text = f"the key is given twice, in lines {lines[here]} and {line}"
                self.document.problems.append((here, text))
                continue
            lines[here] = line
            data[key] = self.build(value_node, here, above)
        return data


def _merged(node: yaml.MappingNode, above: tuple) -> list[tuple[yaml.Node, yaml.Node]]:
    """Pairs (key, value) of a mapping; those of merge keys are last, without keys given before."""
    own = [pair for pair in node.value if not _is_merge(pair[0])]
    if len(own) == len(node.value):
        return node.value
    known = {key.value for key, _ in own}
    for _, value in (pair for pair in node.value if _is_merge(pair[0])):
        for source in value.value if isinstance(value, yaml.SequenceNode) else [value]:
            if not isinstance(source, yaml.MappingNode):
                raise _refused(f"{_MERGE} needs a block, or a list of blocks, to merge", value)
            if any(source is other for other in above):
                raise _refused("an anchor refers to itself", value)
            new = [p for p in _merged(source, (*above, source)) if p[0].value not in known]
            known.update(key.value for key, _ in new)
            own += new
    return own


def _is_merge(key: yaml.Node) -> bool:
    return isinstance(key, yaml.ScalarNode) and key.value == _MERGE and not key.style


def _is_empty(node: yaml.Node) -> bool:
    return isinstance(node, yaml.ScalarNode) and node.value == "" and not node.style


def _decimal_comma(before: tuple | None, key: str, value: yaml.Node) -> str | None:
    """Fault of {time: 1,5 ns}, which YAML reads as time: 1 and a key `5 ns` without a value."""
    if before is None or not _is_empty(value) or not re.fullmatch(_FRACTION, key):
        return None
    whole = before[1].value
    if not isinstance(whole, str) or not re.fullmatch(r"[-+]?\d+", whole):
        return None
    return (
        f"a comma separates two entries here; write a decimal point: {whole}.{key} in place of "
        f"{whole},{key}"
    )


def _scalar(node: yaml.ScalarNode) -> Any:
    """Value of a scalar: a text, a number, true, false or nothing."""
    name = node.tag.removeprefix(_TAG)
    if name == "str":
        text = _text(node)
        return _SPACES.sub(" ", text).strip() if not node.style else text
    if name not in _SCALARS or not re.match(_SCALARS[name][0], node.value):
        raise _refused(f"{node.value!r} cannot be read as {node.tag.replace(_TAG, '!!')}", node)
    try:
        return _MAKE[name](node.value)
    except ValueError as error:  # a whole number of thousands of digits
        raise _refused(str(error), node) from None


def _text(node: yaml.ScalarNode) -> str:
    """The text of a node; refuses characters that paths and terminals do not accept."""
    found = _CONTROL.search(node.value)
    if found:
        raise _refused(f"the character U+{ord(found[0]):04X} is not allowed", node)
    return node.value


def _key(node: yaml.ScalarNode) -> str:
    """The text of a key; refuses what only looks like a space, which makes it another key."""
    found = _SPACES.search(node.value)
    if found and not node.style:
        name = unicodedata.name(found[0], "").lower()
        raise _refused(
            f"the character U+{ord(found[0]):04X} ({name}) is in {node.value!r}; type an ordinary "
            "space in its place",
            node,
        )
    return _text(node)


def _too_deep(mark: yaml.Mark) -> yaml.MarkedYAMLError:
    text = f"more than {MOST_NESTED} blocks and lists are nested"
    return yaml.MarkedYAMLError(problem=text, problem_mark=mark)


def _refused(text: str, node: yaml.Node) -> yaml.MarkedYAMLError:
    return yaml.MarkedYAMLError(problem=text, problem_mark=node.start_mark)
