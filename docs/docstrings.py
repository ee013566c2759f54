"""Docstrings of the package for Sphinx: plain text in NumPy's layout, `names` in backticks."""

import inspect
import re
import typing
from functools import cache

import interface
from pydantic import BaseModel
from sphinx.ext.napoleon import Config, NumpyDocstring

# Types in words and pieces of default values, which Sphinx takes for names of classes.
ELSEWHERE = [(r"py:(class|exc)", r"(?!dusttaichi\.).*")]

SECTIONS = ("Parameters", "Returns", "Attributes", "Raises", "Notes")  # in this order


def setup(app):
    """Connect the functions below to autodoc."""
    app.connect("autodoc-process-docstring", _process)
    app.connect("autodoc-process-signature", _signature)
    app.connect("autodoc-skip-member", _skip)


def _process(app, what, name, value, options, lines):
    """Turn a docstring in NumPy's layout into fields; text that looks like markup is escaped."""
    plain = restructured(_with_returns("\n".join(lines), value)).split("\n")
    # a property is none here: napoleon would take its text up to a colon for a type
    kind = "object" if what in ("attribute", "data", "property") else what
    lines[:] = NumpyDocstring(plain, _layout(), app, kind, name, value, options).lines()
    if what == "class" and issubclass(value, BaseModel):
        lines += _keys(value)


def _with_returns(text, value):
    """A docstring with parameters and the section Returns, which the annotation states as well."""
    kind = getattr(inspect.unwrap(value), "__annotations__", {}).get("return")
    if "Parameters\n---" not in text or "Returns\n---" in text or kind is None:
        return text
    end = re.search(r"^(Attributes|Raises|Notes)\n---|\Z", text, re.MULTILINE).start()
    return f"{text[:end].rstrip()}\n\nReturns\n-------\n{_words(kind)}\n\n{text[end:]}"


def _words(kind):
    """An annotation in words: `list of Band`, `xarray.Dataset`."""
    if isinstance(kind, str):
        return kind
    if typing.get_origin(kind) is list:
        return f"list of {_words(*typing.get_args(kind))}"
    home = kind.__module__.partition(".")[0]
    return kind.__name__ if home in ("builtins", "dusttaichi") else f"{home}.{kind.__name__}"


@cache
def _layout():
    return Config(
        napoleon_attr_annotations=False,
        napoleon_use_ivar=True,
        napoleon_use_rtype=False,
        napoleon_preprocess_types=True,
        napoleon_type_aliases=interface.aliases(),
    )


def _keys(block):
    """The keys of a block of the YAML, with what they say."""
    own = {name: field for name, field in block.model_fields.items() if field.description}
    return [f"- ``{name}``: {_escaped(field.description)}" for name, field in own.items()] + [""]


def restructured(text):
    """Plain text as reStructuredText: names in backticks as code, formulas as they stand."""
    paragraphs = re.split(r"\n[ \t]*\n", text.strip("\n"))
    return "\n\n".join(_paragraph(one) for one in paragraphs) + "\n"


def _paragraph(text):
    lines = text.split("\n")
    if lines[0] in SECTIONS and lines[1:] and set(lines[1]) == {"-"}:
        return "\n".join(lines[:2] + [_escaped(line) for line in lines[2:]])
    indents = [len(line) - len(line.lstrip()) for line in lines if line.strip()]
    if indents and min(indents) >= 2 or len(lines) > 1 and len(set(indents)) > 1:
        # set apart by the writer: formulas, tables, lists that go on in the next line
        if not re.match(r"\s*[-*] ", text):
            return "::\n\n" + "\n".join("    " + line for line in lines)
    if re.match(r"\s*[-*] ", text):
        return "\n".join(_escaped(line, keep_bullet=True) for line in lines)
    return "\n".join(_escaped(line) for line in lines)


def _escaped(line, keep_bullet=False):
    bullet = re.match(r"\s*[-*] ", line) if keep_bullet else None
    start = bullet.group() if bullet else ""
    parts = re.split(r"(``.+?``|`[^`]+`)", line[len(start) :])
    shown = [
        f"``{part.strip('`')}``" if part.startswith("`") else re.sub(r"([\\*|_`])", r"\\\1", part)
        for part in parts
    ]
    return start + "".join(shown)


def _signature(app, what, name, value, options, signature, returns):
    """Blocks of the YAML are filled by keys, which the page of the scene lists."""
    if isinstance(value, type) and issubclass(value, BaseModel):
        return "", None
    return None


def _skip(app, what, name, value, skip, options):
    """Members that pydantic adds to a class are no part of the interface."""
    return True if name.startswith(("model_", "_")) else None
