"""Python files as syntax trees, each parsed and walked once by a process; modules of docs."""

import ast
import importlib
from functools import cache

import pytest
from scenes import ROOT


def import_from_docs(name):
    """Import a module of the folder docs, which is no part of the package."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(ROOT / "docs")
        return importlib.import_module(name)


@cache
def list_nodes(path):
    """All nodes of a file, that of the module first."""
    return list(ast.walk(ast.parse(path.read_text(encoding="utf-8"))))
