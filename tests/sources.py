"""Python files as syntax trees, each parsed and walked once by a process."""

import ast
from functools import cache


@cache
def list_nodes(path):
    """All nodes of a file, that of the module first."""
    return list(ast.walk(ast.parse(path.read_text(encoding="utf-8"))))
