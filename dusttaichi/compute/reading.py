"""Taichi reads its kernels anew at every start, also those that its cache has compiled. What it
does meanwhile for its error messages only is made short here: a third of that time.
"""

import sys

from taichi.lang import kernel_impl
from taichi.lang.ast.ast_transformer_utils import ASTTransformerContext


def read_quickly():
    """Leave out what the kernels of this project do not need.

    The line of the source that an error is in is named, not drawn with marks under its words; and
    whether a function is a method of a class is told by where it is defined, not looked up in the
    source of its caller.
    """
    ASTTransformerContext.get_pos_info = _position
    kernel_impl._inside_class = _inside_class


def _position(context, node):
    line = node.lineno + context.lineno_offset
    return f'File "{context.file}", line {line}, in {context.func.func.__name__}:\n'


def _inside_class(level_of_class_stackframe):
    # `level` counts up to the frame that runs the statement "class"; below it is the class's body
    return "__qualname__" in sys._getframe(level_of_class_stackframe - 1).f_locals
