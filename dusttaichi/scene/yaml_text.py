"""YAML text to plain data, with the line of every value; duplicate keys are refused."""

import re
from dataclasses import dataclass, field
from typing import Any

import yaml

Path = tuple[str | int, ...]
MOST_REPEATED = 100_000  # values that aliases may repeat: a nest of them grows without bound
MOST_NESTED = 50  # blocks and lists in each other
MOST_CHARACTERS = 10_000_000  # of a file: a hundred thousand positions have 3
LARGE = 100_000  # characters from which a text is scanned by libyaml, which is ten times faster

_CONTROL = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\ud800-\udfff]")
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

_LargeLoader: type = _Loader
if yaml.__with_libyaml__:

    class _LargeLoader(_Composer, yaml.cyaml.CParser, yaml.resolver.Resolver):  # noqa: F811
        """_Loader on the events of libyaml, for large texts, which take seconds in Python."""

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


@dataclass
class Document:
    """Content of a YAML text.

    data: mappings, lists and scalars. lines: path -> line number from 1, of the key if it has
    one. problems: (path, text) of faults that the validation cannot see.
    """

    data: Any = None
    lines: dict[Path, int] = field(default_factory=dict)
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
        node = yaml.compose(text, _Loader if len(text) < LARGE else _LargeLoader)
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
        if path and node.value == "" and node.style is None:
            text = "nothing is written here; give a value or remove it"
            self.document.problems.append((path, text))
        return _scalar(node)

    def _mapping(self, node: yaml.MappingNode, path: Path, above: tuple) -> dict[str, Any]:
        data: dict[str, Any] = {}
        lines = self.document.lines
        for key_node, value_node in node.value:
            if not isinstance(key_node, yaml.ScalarNode):
                raise _refused("a key must be a word", key_node)
            key, line = _text(key_node), key_node.start_mark.line + 1
            here = (*path, key)
            if key in data:
                text = f"the key is given twice, in lines {lines[here]} and {line}"
                self.document.problems.append((here, text))
                continue
            lines[here] = line
            data[key] = self.build(value_node, here, above)
        return data


def _scalar(node: yaml.ScalarNode) -> Any:
    """Value of a scalar: a text, a number, true, false or nothing."""
    name = node.tag.removeprefix(_TAG)
    if name == "str":
        return _text(node)
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


def _too_deep(mark: yaml.Mark) -> yaml.MarkedYAMLError:
    text = f"more than {MOST_NESTED} blocks and lists are nested"
    return yaml.MarkedYAMLError(problem=text, problem_mark=mark)


def _refused(text: str, node: yaml.Node) -> yaml.MarkedYAMLError:
    return yaml.MarkedYAMLError(problem=text, problem_mark=node.start_mark)
