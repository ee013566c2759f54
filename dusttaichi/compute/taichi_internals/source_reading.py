"""Patches of Taichi's internals that nearly halve the processor time of a first step.

Taichi reads the sources of kernels at every start, even if the compiled kernels are in its cache;
the patches omit work for its error messages and work repeated at every call of a function.

Only versions that were tested are patched (engine.PATCHED), never with `numerics.debug`, and never
Quadrants. tests/compute/test_taichi_internals.py names what another version has changed.
"""

import ast
import operator
import textwrap
from functools import cache, reduce, wraps
from importlib import import_module

from dusttaichi.compute import compiler, engine
from dusttaichi.compute.engine import ti

if engine.is_tested():
    Expr, Struct = ti.lang.expr.Expr, ti.Struct
    impl, kernel_impl = ti.lang.impl, ti.lang.kernel_impl
    matrix_ops, make_matrix = import_module("taichi.lang.matrix_ops"), ti.lang.matrix.make_matrix
    ast_utils = ti.lang.ast.ast_transformer_utils
    ASTTransformerContext = ast_utils.ASTTransformerContext


def patch(debug):
    """Patch the internals of a tested version; with debug, restore its own."""
    for holder, name, original, ours in patches():
        setattr(holder, name, original if debug else ours)


@cache
def patches():
    """Rows (module or class, name in it, Taichi's own object, replacement); none if not tested.

    Each has its gain in the first step, kernels cached: processor time of `configs/smoke.yaml` on
    an AMD EPYC, median of nine pairs in turn with and without it. Errors name the line of the
    source without marks under its words. The lines of a function are read and parsed once, not at
    every call; for that the pass over a node must not change it. Structs with the same members
    share one class. Products of vectors are compiled as expressions, not as functions whose sources
    are read at every call; without this replacement kernels are compiled to other code.
    """
    if not engine.is_tested():
        return []
    replacements = [
        (ASTTransformerContext, "get_pos_info", _position),  # 0.50 s
        (kernel_impl, "_get_tree_and_ctx", _tree_and_context),  # 0.18 s with the next two
        (kernel_impl, "transform_tree", _transform(kernel_impl.transform_tree)),
        (ast_utils.Builder, "__call__", _build),
        (Struct, "_register_members", _register_members),  # 0.04 to 0.28 s
        *((matrix_ops, name, _at_once(name, ours)) for name, ours in _OPERATIONS),  # 0.05 s
    ]
    return [(holder, name, getattr(holder, name), ours) for holder, name, ours in replacements]


def rows(debug):
    """Rows (name, value) about the compiler, for a scene with that `numerics.debug`."""
    if debug:
        text = "none, as numerics.debug is true: bounds are checked and fast math is off"
    elif patches():
        text = "applied: kernels are read and called in less time"
    else:
        versions = " and ".join(engine.PATCHED)
        text = f"none: they are for Taichi {versions}, and without them the first step takes longer"
    name = compiler.name().capitalize()
    return [("compiler", f"{name} {engine.VERSION}"), ("patches of its internals", text)]


# -- reading of sources ----------------------------------------------------------------------------


class _Source:
    """The source of a function, with a pool of its syntax trees.

    Taichi writes into the nodes of a tree during its pass, so that a tree is reused only after it,
    and a nested call needs another one. The tree of a kernel loses its arguments and is used once.
    """

    def __init__(self, function):
        self.file = kernel_impl.getsourcefile(function)
        lines, self.first = kernel_impl.getsourcelines(function)
        self.lines = [line.rstrip() for line in lines]
        self._text = textwrap.dedent("\n".join(self.lines))
        self._free = [self._parse()]

    def _parse(self):
        tree = ast.parse(self._text)
        tree.body[0].decorator_list = []
        tree.source = self
        return tree

    def take(self):
        """A tree, as of ast.parse, without decorators."""
        return self._free.pop() if self._free else self._parse()

    def give_back(self, tree):
        """A tree for the next call of the function."""
        self._free.append(tree)


_SOURCES = {}  # by code, which all closures of a function share


def _source_of(function):
    code = function.__code__
    key = code, code.co_filename
    if key not in _SOURCES:
        _SOURCES[key] = _Source(function)
    return _SOURCES[key]


_CONTEXT = {  # defaults of Taichi's own function
    "excluded_parameters": (),
    "is_kernel": True,
    "arg_features": None,
    "args": None,
    "ast_builder": None,
    "is_real_function": False,
}


def _tree_and_context(function, **settings):
    settings = dict(_CONTEXT, **settings)
    source = _source_of(function.func)
    names = kernel_impl._get_global_vars(function.func)
    if settings["is_kernel"] or settings["is_real_function"]:
        for i in function.template_slot_locations:
            names[function.arguments[i].name] = settings["args"][i]
    return source.take(), ASTTransformerContext(
        func=function,
        global_vars=names,
        argument_data=settings.pop("args"),
        src=source.lines,
        start_lineno=source.first,
        file=source.file,
        **settings,
    )


def _transform(original):
    def transform(tree, context):
        """Result of Taichi's pass over a tree."""
        try:
            return original(tree, context)
        finally:
            if not context.is_kernel:
                tree.source.give_back(tree)

    return transform


def _build(builder, context, node):
    """Taichi's pass over a node."""
    runtime, node_type = impl.get_runtime(), node.__class__
    placed = issubclass(node_type, (ast.stmt, ast.expr))
    runtime.src_info_stack.append(context.get_pos_info(node) if placed else "")
    try:
        build = getattr(builder, f"build_{node_type.__name__}", None)
        if build is None:
            raise ti.TaichiSyntaxError(f'Unsupported node "{node_type.__name__}"')
        return build(context, node)
    except Exception as error:
        if runtime.print_full_traceback:
            raise
        if context.raised or not placed:
            raise error.with_traceback(None) from None
        context.raised = True
        error = ast_utils.handle_exception_from_cpp(error)
        is_compilation_error = isinstance(error, ti.TaichiCompilationError)
        text = str(error) if is_compilation_error else ast_utils.traceback.format_exc()
        refusal = type(error) if is_compilation_error else ti.TaichiCompilationError
        raise refusal(context.get_pos_info(node) + text) from None
    finally:
        runtime.src_info_stack.pop()
        if node_type is ast.Call:  # the only note on a tree that Taichi looks up
            node.func.__dict__.pop("caller", None)


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
    original = getattr(matrix_ops, name)

    @wraps(original)
    def call(*args):
        vectors = impl.inside_kernel() and all(isinstance(a, Expr) and a.is_tensor() for a in args)
        shapes = {a.get_shape() for a in args} if vectors else ()
        shape = shapes.pop() if len(shapes) == 1 else ()
        if len(shape) != 1 or (ours is _cross and shape != (3,)):
            return original(*args)
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


def _position(context, node):
    line = node.lineno + context.lineno_offset
    return f'File "{context.file}", line {line}, in {context.func.func.__name__}:\n'
