"""How often a reader who follows a scene of grains through `make` comes back to a file.

python tests/walk.py omni_static

The walk is the functions of `dusttaichi/grains` in the order of their first calls. Left out are
kernels, and functions of one statement, which say all at the call.
"""

import ast
import sys
from functools import cache
from itertools import groupby
from pathlib import Path

import dusttaichi
from dusttaichi.grains.build import make
from dusttaichi.method import make_sample

GRAINS = Path(dusttaichi.__file__).parent / "grains"


@cache
def _lines_of_short_functions(path):
    """First lines of the functions of a file that have one statement after their docstring."""
    functions = [node for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
                 if isinstance(node, ast.FunctionDef)]  # fmt: skip
    return {
        min(part.lineno for part in (node, *node.decorator_list))
        for node in functions
        if len(node.body) - (ast.get_docstring(node) is not None) <= 1
    }


def follow(scene, sample):
    """(file, function) in the order of the first calls by `make`."""
    codes = {}

    def note(frame, event, _):
        if event == "call":
            codes.setdefault(frame.f_code)

    sys.setprofile(note)
    try:
        make(scene, sample)
    finally:
        sys.setprofile(None)
    walk = []
    for code in codes:
        path = Path(code.co_filename)
        if path.parent == GRAINS and not code.co_name.startswith("<"):
            if code.co_firstlineno not in _lines_of_short_functions(path):
                walk.append((path.name, code.co_name))
    return walk


def count_stays(walk):
    """(stays in a file, returns to one that has been left) of a walk."""
    stays = [name for name, _ in groupby(walk, key=lambda step: step[0])]
    return len(stays), len(stays) - len(set(stays))


if __name__ == "__main__":
    scene = dusttaichi.load(sys.argv[1])
    walk = follow(scene, make_sample(scene))
    for name, steps in groupby(walk, key=lambda step: step[0]):
        print(f"{name:24}", *(function for _, function in steps))
    print("{} stays, {} returns".format(*count_stays(walk)))
