"""Patches of Taichi's internals that halve the processor time of a first step.

Taichi reads the sources of kernels at every start, even if the compiled kernels are in its cache;
the patches omit work for its error messages and work repeated at every call of a function.

Only versions that were tested are patched (engine.PATCHED), never with `numerics.debug`, and never
Quadrants. tests/compute/test_taichi_patches.py names what another version has changed.
"""

import ast
import linecache
import operator
import textwrap
from functools import cache, reduce, wraps
from importlib import import_module

from dusttaichi.compute import compiler, engine
from dusttaichi.compute.engine import ti

if engine.tested():
    expr, Expr = ti.lang.expr, ti.lang.expr.Expr
    impl, kernel_impl, snode, Struct = ti.lang.impl, ti.lang.kernel_impl, ti.lang.snode, ti.Struct
    matrix_ops, make_matrix = import_module("taichi.lang.matrix_ops"), ti.lang.matrix.make_matrix
    ast_utils, core = ti.lang.ast.ast_transformer_utils, ti.lang.impl._ti_core
    ASTTransformerContext = ast_utils.ASTTransformerContext


def patch(debug):
    """Patch the internals of a tested version; with debug, restore its own."""
    for holder, name, own, ours in patches():
        setattr(holder, name, own if debug else ours)


@cache
def patches():
    """Rows (module or class, name in it, Taichi's own object, replacement); none if not tested.

    Each has its gain in the first step, kernels cached: processor time of `configs/smoke.yaml` on
    an AMD EPYC, median of nine pairs in turn with and without it; all together 1.4 of 2.8 s. Errors
    name the line of the source without marks under its words. The lines of a function are found
    without a tokenizer, and parsed once, not at every call; for that the pass over a node leaves no
    note in it. Places where fields were declared are not recorded. Structs with the same members
    share one class. Products of vectors are expressions at once, not functions whose sources are
    read at every call; without it kernels are other code.
    """
    if not engine.tested():
        return []
    transform, constant = kernel_impl.transform_tree, expr.make_constant_expr
    found = [
        (ASTTransformerContext, "get_pos_info", _position),  # 0.50 s
        (kernel_impl, "_get_tree_and_ctx", _tree_and_context),  # 0.27 s with the next two
        (kernel_impl, "transform_tree", _transform(transform)),
        (ast_utils.Builder, "__call__", _build),
        (expr, "make_constant_expr", _quick_constant(constant)),  # 0.06 to 0.11 s
        (impl, "get_traceback", _nowhere),  # 0.06 to 0.10 s with the next
        (snode, "get_traceback", _nowhere),
        (Struct, "_register_members", _register_members),  # 0.04 to 0.28 s
        *((matrix_ops, name, _at_once(name, ours)) for name, ours in _OPERATIONS),  # 0.05 s
    ]
    return [(holder, name, getattr(holder, name), ours) for holder, name, ours in found]


def rows(debug):
    """Rows (name, value) about the compiler, for a scene with that `numerics.debug`."""
    if debug:
        text = "none, as numerics.debug is true: bounds are checked and fast math is off"
    elif patches():
        text = "applied: kernels are read and called in less time"
    else:
        known = " and ".join(engine.PATCHED)
        text = f"none: they are for Taichi {known}, and without them the first step takes longer"
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
        try:
            self._read(*_lines_of(function))
        except SyntaxError:  # more follows without an instruction, as the body of a docstring alone
            self._read(*kernel_impl.getsourcelines(function))

    def _read(self, lines, first):
        self.lines, self.first = [line.rstrip() for line in lines], first
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


def _lines_of(function):
    """Lines of a function, and the number of the first, as of inspect.getsourcelines.

    It ends where a line after its last statement is indented no more than its first.
    """
    code = function.__code__
    lines = linecache.getlines(code.co_filename, function.__globals__)
    if not lines:
        return kernel_impl.getsourcelines(function)
    first, end = code.co_firstlineno, _last_line(code)
    edge = _indent(lines[first - 1])
    while end < len(lines) and (not lines[end].strip() or _indent(lines[end]) > edge):
        end += 1
    return lines[first - 1 : end], first


def _indent(line):
    return len(line) - len(line.lstrip())


def _last_line(code):
    """The last line with an instruction of a code or of one within it."""
    inner = [_last_line(other) for other in code.co_consts if hasattr(other, "co_lines")]
    return max(inner + [line for *_, line in code.co_lines() if line is not None])


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


def _transform(own):
    def transform(tree, context):
        """Result of Taichi's pass over a tree."""
        try:
            return own(tree, context)
        finally:
            if not context.is_kernel:
                tree.source.give_back(tree)

    return transform


def _build(builder, context, node):
    """Taichi's pass over a node."""
    runtime, kind = impl.get_runtime(), node.__class__
    placed = issubclass(kind, (ast.stmt, ast.expr))
    runtime.src_info_stack.append(context.get_pos_info(node) if placed else "")
    try:
        build = getattr(builder, f"build_{kind.__name__}", None)
        if build is None:
            raise ti.TaichiSyntaxError(f'Unsupported node "{kind.__name__}"')
        return build(context, node)
    except Exception as error:
        if runtime.print_full_traceback:
            raise
        if context.raised or not placed:
            raise error.with_traceback(None) from None
        context.raised = True
        error = ast_utils.handle_exception_from_cpp(error)
        known = isinstance(error, ti.TaichiCompilationError)
        text = str(error) if known else ast_utils.traceback.format_exc()
        refusal = type(error) if known else ti.TaichiCompilationError
        raise refusal(context.get_pos_info(node) + text) from None
    finally:
        runtime.src_info_stack.pop()
        if kind is ast.Call:  # the only note on a tree that Taichi looks up
            node.func.__dict__.pop("caller", None)


def _quick_constant(own):
    """expr.make_constant_expr, first of an integer."""

    def make_constant_expr(value, dtype):
        usual = type(value) is int and dtype is None and impl.get_runtime().default_ip is ti.i32
        if not usual or not -(2**31) <= value < 2**31:
            return own(value, dtype)
        return Expr(core.make_const_expr_int(ti.i32, value))

    return make_constant_expr


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
