"""Taichi reads its kernels anew at every start, also those that its cache has compiled. What it
does meanwhile for its error messages only, or again for every call of a function, is made short
here: half of that time.
"""

import sys
import textwrap
from functools import cache
from types import SimpleNamespace

from taichi.lang import kernel_impl
from taichi.lang.ast.ast_transformer_utils import ASTTransformerContext


def read_quickly():
    """Leave out what the kernels of this project do not need.

    The line of the source that an error is in is named, not drawn with marks under its words;
    whether a function is a method of a class is told by where it is defined, not looked up in the
    source of its caller; and the lines of a function are found once, not at every call of it.
    """
    if kernel_impl._inside_class is _inside_class:
        return
    ASTTransformerContext.get_pos_info = _position
    kernel_impl._inside_class = _inside_class
    kernel_impl.getsourcelines = _once_for_each_code(kernel_impl.getsourcelines)
    kernel_impl.getsourcefile = _once_for_each_code(kernel_impl.getsourcefile)
    # what it takes of that module: the lines of a function with tabs made spaces, and dedented
    kernel_impl.textwrap = SimpleNamespace(fill=cache(textwrap.fill), dedent=textwrap.dedent)


def _once_for_each_code(find):
    """`find(function)`, remembered by the code of the function, which all its closures share."""
    known = {}

    def found(function):
        code = function.__code__, function.__code__.co_filename
        if code not in known:
            known[code] = find(function)
        return known[code]

    return found


def _position(context, node):
    line = node.lineno + context.lineno_offset
    return f'File "{context.file}", line {line}, in {context.func.func.__name__}:\n'


def _inside_class(level_of_class_stackframe):
    # `level` counts up to the frame that runs the statement "class"; below it is the class's body
    return "__qualname__" in sys._getframe(level_of_class_stackframe - 1).f_locals
