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


def _process(app, object_type, name, value, options, lines):
    """Turn a docstring in NumPy's layout into fields; text that looks like markup is escaped."""
    plain = convert_to_rst(_add_returns("\n".join(lines), value)).split("\n")
    # a property is none here: napoleon would take its text up to a colon for a type
    napoleon_type = "object" if object_type in ("attribute", "data", "property") else object_type
    lines[:] = NumpyDocstring(plain, _layout(), app, napoleon_type, name, value, options).lines()
    if object_type == "class" and issubclass(value, BaseModel):
        lines += _keys(value)


def _add_returns(text, value):
    """A docstring with parameters and the section Returns, which the annotation states as well."""
    annotation = getattr(inspect.unwrap(value), "__annotations__", {}).get("return")
    if "Parameters\n---" not in text or "Returns\n---" in text or annotation is None:
        return text
    end = re.search(r"^(Attributes|Raises|Notes)\n---|\Z", text, re.MULTILINE).start()
    return f"{text[:end].rstrip()}\n\nReturns\n-------\n{_words(annotation)}\n\n{text[end:]}"


def _words(annotation):
    """An annotation in words: `list of Band`, `xarray.Dataset`."""
    if isinstance(annotation, str):
        return annotation
    if typing.get_origin(annotation) is list:
        return f"list of {_words(*typing.get_args(annotation))}"
    home = annotation.__module__.partition(".")[0]
    return (
        annotation.__name__
        if home in ("builtins", "dusttaichi")
        else f"{home}.{annotation.__name__}"
    )


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
    described_fields = {
        name: field for name, field in block.model_fields.items() if field.description
    }
    return [
        f"- ``{name}``: {_escape_markup(field.description)}"
        for name, field in described_fields.items()
    ] + [""]


def convert_to_rst(text):
    """Plain text as reStructuredText: names in backticks as code, formulas as they stand."""
    paragraphs = re.split(r"\n[ \t]*\n", text.strip("\n"))
    return "\n\n".join(_paragraph(paragraph) for paragraph in paragraphs) + "\n"


def _paragraph(text):
    lines = text.split("\n")
    if lines[0] in SECTIONS and lines[1:] and set(lines[1]) == {"-"}:
        return "\n".join(lines[:2] + [_escape_markup(line) for line in lines[2:]])
    indents = [len(line) - len(line.lstrip()) for line in lines if line.strip()]
    if indents and min(indents) >= 2 or len(lines) > 1 and len(set(indents)) > 1:
        # set apart by the writer: formulas, tables, lists that go on in the next line
        if not re.match(r"\s*[-*] ", text):
            return "::\n\n" + "\n".join("    " + line for line in lines)
    if re.match(r"\s*[-*] ", text):
        return "\n".join(_escape_markup(line, keep_bullet=True) for line in lines)
    return "\n".join(_escape_markup(line) for line in lines)


def _escape_markup(line, keep_bullet=False):
    bullet = re.match(r"\s*[-*] ", line) if keep_bullet else None
    start = bullet.group() if bullet else ""
    pieces = re.split(r"(``.+?``|`[^`]+`)", line[len(start) :])
    shown = [
        f"``{piece.strip('`')}``"
        if piece.startswith("`")
        else re.sub(r"([\\*|_`])", r"\\\1", piece)
        for piece in pieces
    ]
    return start + "".join(shown)


def _signature(app, object_type, name, value, options, signature, returns):
    """Blocks of the YAML are filled by keys, which the page of the scene lists."""
    if isinstance(value, type) and issubclass(value, BaseModel):
        return "", None
    return None


def _skip(app, object_type, name, value, skip, options):
    """Members that pydantic adds to a class are no part of the interface."""
    return True if name.startswith(("model_", "_")) else None
