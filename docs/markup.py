"""Markdown that the generated parts are made of."""


def cell(content):
    """A text as the cell of a table."""
    return content.replace("|", "\\|").replace("\n", " ")


def text(lines):
    """Lines as a text that ends with one line break."""
    return "\n".join(lines).rstrip("\n") + "\n"


def prose(docstring):
    """The paragraphs of a docstring, each on one line."""
    return "\n\n".join(" ".join(part.split()) for part in docstring.strip().split("\n\n"))
