"""Docstrings of the package for Sphinx: they are plain text, with `names` in single backticks."""

import re

from pydantic import BaseModel

# Pieces of default values in signatures, which Sphinx takes for names of classes.
ELSEWHERE = [(r"py:class", r".*[\[\]{}'].*")]


def setup(app):
    """Connect the functions below to autodoc."""
    app.connect("autodoc-process-docstring", _process)
    app.connect("autodoc-process-signature", _signature)
    app.connect("autodoc-skip-member", _skip)


def _process(app, what, name, value, options, lines):
    """Markup of reStructuredText that plain text has by chance is escaped."""
    lines[:] = restructured("\n".join(lines)).split("\n")
    if what == "class" and issubclass(value, BaseModel):
        lines += _keys(value)


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
    """What pydantic makes of a class by itself is no part of the interface."""
    return True if name.startswith(("model_", "_")) else None
