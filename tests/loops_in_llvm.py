"""The loops of compiled kernels, as LLVM's optimised code shows them."""

import re

BLOCK = re.compile(r"^[\w.]+:.*?(?=^[\w.]+:|^})", re.MULTILINE | re.DOTALL)


def blocks_with_roots(folder):
    """The basic blocks that take a square root, of all code that Taichi has printed in a folder.

    Every loop over contacts or neighbours takes one. Other loops, say those that gather, LLVM
    unrolls as often as it sees fit for the processor, so that their size tells nothing.
    """
    code = "".join(file.read_text() for file in folder.glob("*optimized*.ll"))
    return [block for block in BLOCK.findall(code) if "@llvm.sqrt" in block]
