"""Patches that halve the time Taichi needs to read the sources of kernels.

It reads them at every start, even if the compiled kernels are in its cache; the patches omit work
for its error messages and work repeated at every call of a function.
"""

import ast
import operator
import sys
import textwrap
from functools import cache, reduce, wraps
from importlib import import_module
from types import SimpleNamespace

from dusttaichi.compute.engine import ti

Expr = ti.lang.expr.Expr
impl, kernel_impl, snode, Struct = ti.lang.impl, ti.lang.kernel_impl, ti.lang.snode, ti.Struct
matrix_ops, make_matrix = import_module("taichi.lang.matrix_ops"), ti.lang.matrix.make_matrix
ASTTransformerContext = ti.lang.ast.ast_transformer_utils.ASTTransformerContext


def patches():
    """(module or class, name in it, replacement) of the patches; engine.py applies them.

    Errors name the line of the source without marks under its words. Whether a function is a method
    follows from its place of definition, not from the source of its caller. Places where fields
    were declared are not recorded. The lines of a function are found and parsed once, not at every
    call, and structs with the same members share one class. Products of vectors are expressions at
    once, not functions whose sources are read at every call.
    """
    # the functions that Taichi uses of this module
    wrap = SimpleNamespace(fill=cache(textwrap.fill), dedent=cache(textwrap.dedent))
    trees = _Trees(kernel_impl.transform_tree)
    return [
        (ASTTransformerContext, "get_pos_info", _position),
        (impl, "get_traceback", _nowhere),
        (snode, "get_traceback", _nowhere),
        (kernel_impl, "_inside_class", _inside_class),
        (kernel_impl, "getsourcelines", _once_for_each_code(kernel_impl.getsourcelines)),
        (kernel_impl, "getsourcefile", _once_for_each_code(kernel_impl.getsourcefile)),
        (kernel_impl, "textwrap", wrap),
        (kernel_impl, "ast", trees),
        (kernel_impl, "transform_tree", trees.transform),
        (Struct, "_register_members", _register_members),
        *((matrix_ops, name, _at_once(name, ours)) for name, ours in _OPERATIONS),
    ]


def _once_for_each_code(find):
    """`find(function)`, cached by the code of the function, which all its closures share."""
    known = {}

    def found(function):
        code = function.__code__, function.__code__.co_filename
        if code not in known:
            known[code] = find(function)
        return known[code]

    return found


class _Trees:
    """Pool of syntax trees of functions.

    Taichi writes into the nodes of a tree during its pass, so that a tree is reused only after it,
    and a nested call needs another one. The tree of a kernel loses its arguments and is used once.
    """

    def __init__(self, transform):
        self._transform, self._free = transform, {}

    def parse(self, source):
        """The tree of a source, as of ast.parse."""
        free = self._free.setdefault(source, [])
        if free:
            return free.pop()
        tree = ast.parse(source)
        tree.pool = free
        tree.attributes = [node for node in ast.walk(tree) if isinstance(node, ast.Attribute)]
        return tree

    def transform(self, tree, context):
        """Result of Taichi's pass over a tree."""
        try:
            return self._transform(tree, context)
        finally:
            for node in tree.attributes:  # the only note that Taichi looks up
                node.__dict__.pop("caller", None)
            if not context.is_kernel:
                tree.pool.append(tree)


def _register_members(struct):
    struct.__class__ = _class_with(type(struct), tuple(struct.keys))


@cache
def _class_with(cls, names):
    """The subclass of a Taichi struct that has its members as properties."""
    properties = {name: property(cls._make_getter(name), cls._make_setter(name)) for name in names}
    return type(cls.__name__, (cls,), properties)


def _at_once(name, ours):
    """The function of matrix_ops of that name: `ours` for vectors of a kernel, else its own.

    A cross product in the plane is a number and stays Taichi's own.
    """
    own = getattr(matrix_ops, name)

    @wraps(own)
    def call(*args):
        vectors = impl.inside_kernel() and all(isinstance(a, Expr) and a.is_tensor() for a in args)
        shapes = {a.get_shape() for a in args} if vectors else ()
        shape = shapes.pop() if len(shapes) == 1 else ()
        if len(shape) != 1 or (ours is _cross and shape != (3,)):
            return own(*args)
        return ours(*(_components(a, shape[0]) for a in args))

    return call


def _components(vector, size):
    """The components of a vector, which is evaluated once."""
    stored = impl.expr_init(vector)
    builder = impl.get_runtime().compiling_callable.ast_builder()
    return [impl.subscript(builder, stored, n) for n in range(size)]


def _sum(a):
    return reduce(operator.add, a)


def _dot(a, b):
    return _sum([x * y for x, y in zip(a, b, strict=True)])


def _norm_sqr(a):
    return _dot(a, a)


def _cross(a, b):
    turns = ((1, 2), (2, 0), (0, 1))
    return make_matrix([a[m] * b[n] - a[n] * b[m] for m, n in turns])


_OPERATIONS = (("sum", _sum), ("dot", _dot), ("norm_sqr", _norm_sqr), ("cross", _cross))


def _nowhere(stacklevel=1):
    return ""


def _position(context, node):
    line = node.lineno + context.lineno_offset
    return f'File "{context.file}", line {line}, in {context.func.func.__name__}:\n'


def _inside_class(level_of_class_stackframe):
    # `level` counts up to the frame that runs the statement "class"; below it is the class's body
    return "__qualname__" in sys._getframe(level_of_class_stackframe - 1).f_locals
