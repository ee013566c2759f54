"""What differs between the compilers (compute/compiler.py) for tests, and the code of LLVM."""

import re

import pytest

from dusttaichi.compute import compiler, taichi_internals

taichi_alone = pytest.mark.skipif(
    compiler.name() != "taichi" or not taichi_internals.are_allowed(), reason="internals of Taichi"
)

BLOCK = re.compile(r"^[\w.]+:.*?(?=^[\w.]+:|^})", re.MULTILINE | re.DOTALL)


def blocks_with_roots(folder):
    """The basic blocks that take a square root, of all code that Taichi has printed in a folder.

    Every loop over contacts or neighbours takes one. Other loops, say those that gather, LLVM
    unrolls as often as it sees fit for the processor, so that their size means nothing.
    """
    code = "".join(file.read_text() for file in folder.glob("*optimized*.ll"))
    return [block for block in BLOCK.findall(code) if "@llvm.sqrt" in block]
