"""Translation of PTX instructions to C, statement by statement. The functions that they call are in
threads.h; a register becomes a union of all types, and addresses are those of the host.
"""

import re

C_TYPES = {
    **{f"{k}{n}": f"uint{n}_t" for k in "ub" for n in (8, 16, 32, 64)},
    **{f"s{n}": f"int{n}_t" for n in (8, 16, 32, 64)},
    "f32": "float",
    "f64": "double",
    "pred": "uint8_t",
    "s128": "__int128",
    "u128": "unsigned __int128",
}
SPECIAL = {"%laneid": "(T->tid & 31)"} | {
    f"%{name}.{axis}": f"T->{name}" if axis == "x" else "0" if name in ("tid", "ctaid") else "1"
    for name in ("tid", "ctaid", "ntid", "nctaid")
    for axis in "xyz"
}
COMPARE = {"eq": "==", "ne": "!=", "lt": "<", "le": "<=", "gt": ">", "ge": ">="}
COMPARE |= {"lo": "<", "ls": "<=", "hi": ">", "hs": ">="}
ROUNDING = {"rni": "rint", "rzi": "trunc", "rmi": "floor", "rpi": "ceil"}
LOGIC = {"and": "&", "or": "|", "xor": "^"}
SIGNS = LOGIC | {"add.f": "+", "sub.f": "-", "mul.f": "*", "div": "/", "rem": "%"}
SIGNS |= {f"setp.{name}": sign for name, sign in COMPARE.items()}
APPROXIMATE = ("rcp", "rsqrt", "sqrt", "ex2", "lg2", "sin", "cos")
# C of what an instruction makes of its operands after the first, read as its type if none is named;
# "add.f" is of floats. {kind}: the type, {bits}: of it, {u}: the unsigned integer of its width,
# {c2}: the integer of twice its width, {f}: f of single precision.
FORMS = {
    **{name: f"{{0}} {sign} {{1}}" for name, sign in SIGNS.items()},
    **{f"setp.{x}u": f"unordered({{0}}, {{1}}) || {{0}} {s} {{1}}" for x, s in COMPARE.items()},
    "add": "({u})({0}) + ({u})({1})",
    "sub": "({u})({0}) - ({u})({1})",
    "setp.ne.f": "!unordered({0}, {1}) && {0} != {1}",
    "setp.num": "!unordered({0}, {1})",
    "setp.nan": "unordered({0}, {1})",
    "selp": "{2:pred} ? {0} : {1}",
    "mul.lo": "({u})({0}) * ({u})({1})",
    "mul.wide": "({c2}){0} * ({c2}){1}",
    "mul.hi": "(({c2}){0} * ({c2}){1}) >> {bits}",
    "mad.lo": "({u})({0}) * ({u})({1}) + {2}",
    "mad.wide": "({c2}){0} * ({c2}){1} + {2:wide}",
    "mad.hi": "((({c2}){0} * ({c2}){1}) >> {bits}) + {2}",
    "shl": "{1:u32} >= {bits} ? 0 : {0} << {1:u32}",
    "shr": "{1:u32} >= {bits} ? 0 : {0} >> {1:u32}",
    "shr.s": "{0} >> ({1:u32} < {bits} ? {1:u32} : {bits} - 1)",
    "bfe": "bfe_{kind}({0}, {1:u32}, {2:u32})",
    "cvta": "{0}",
    "min": "{0} < {1} ? {0} : {1}",
    "max": "{0} > {1} ? {0} : {1}",
    "abs": "({0} < 0 ? -{0} : {0})",
    "neg": "-({0})",
    "not": "~{0}",
    "not.pred": "!{0}",
    "rcp": "1 / {0}",
    **{f"{x}.approx": f"{x}_approx_{{kind}}({{0}})" for x in APPROXIMATE},
    "div.approx": "div_approx_{kind}({0}, {1})",
    "div.full": "div_full_{kind}({0}, {1})",
    "copysign": "__builtin_copysign({1}, {0})",
    "popc": "__builtin_popcountll({0})",
    "clz": "clz_{kind}({0})",
    "prmt": "prmt({0}, {1}, {2})",
    "fma": "__builtin_fma{f}({0}, {1}, {2})",
    "sqrt": "__builtin_sqrt{f}({0})",
    "abs.f": "__builtin_fabs{f}({0})",
    "min.f": "__builtin_fmin{f}({0}, {1})",
    "max.f": "__builtin_fmax{f}({0}, {1})",
}
RESULTS = {"setp": "pred", "popc": "u32", "clz": "u32"}  # of another type than the operands
STOP = 'emu_stop("a kernel has stopped: trap");'
# C of an instruction without a result
PLAIN = {"ret": "return;", "trap": STOP, "exit": STOP, "membar": ";", "fence": ";"}
ATOMIC = {
    "add": "old + {0}",
    "exch": "{0}",
    "min": "old < {0} ? old : {0}",
    "max": "old > {0} ? old : {0}",
    "and": "old & {0}",
    "or": "old | {0}",
    "xor": "old ^ {0}",
    "cas": "old == {0} ? {1} : old",
}
# `.param .align 8 .b8 name[16]`, `.param .u64 .ptr .global .align 1 name`
PARAMETER = re.compile(
    r"\.param (?:\.align \d+ )?\.(\w+)\s+(?:\.ptr (?:\.\w+ )??\.align \d+ )?([\w$]+)(?:\[(\d+)\])?$"
)


class Untranslated(Exception):
    """An instruction that this file does not know."""


def size_of(dtype):
    return 1 if dtype == "pred" else int(dtype[1:]) // 8


def is_float(dtype):
    return dtype[0] == "f"


def variable(register):
    return "v_" + register[1:] if register.startswith("%") else register


def operands(text):
    """Operands between commas, those in brackets whole."""
    out, depth, token = [], 0, ""
    for char in text:
        depth += (char in "{[(") - (char in "}])")
        if char == "," and depth == 0:
            out.append(token.strip())
            token = ""
        else:
            token += char
    return out + [token.strip()] if token.strip() else out


def read(text, dtype):
    """An operand read as that type."""
    c_type = C_TYPES[dtype]
    if text in SPECIAL:
        return f"(({c_type}){SPECIAL[text]})"
    if text.startswith("%"):
        return f"{variable(text)}.{dtype}"
    if text[:2] in ("0d", "0f"):
        bits = f"0x{text[2:]}ull"
        return f"as_{'f64' if text[1] == 'd' else 'f32'}({bits})" if is_float(dtype) else bits
    if re.match(r"-?\d+$", text):
        if is_float(dtype):
            return f"as_{dtype}({text}ull)"
        if text == "-9223372036854775808":
            return f"(({c_type})INT64_MIN)"
        return f"(({c_type}){text}{'ll' if '-' in text else 'ull'})"
    match = re.match(r"([\w$.]+)\+(\d+)$", text)
    return f"((uint64_t){match[1]} + {match[2]})" if match else f"((uint64_t){text})"


class Operand:
    """An operand of a form, which is read as the type that the form names, or its instruction."""

    def __init__(self, text, dtype, wide):
        self.text, self.kinds = text, {"": dtype, "wide": wide}

    def __format__(self, named):
        return read(self.text, self.kinds.get(named, named))


class Body:
    """The body of one function: its statements in C."""

    def __init__(self):
        self.lines, self.meets = [], False
        self.label, self.targets = None, {}  # the last label, the targets of a table of jumps
        self.plain = set()  # names of registers without %, of what is written by hand

    # -- operands --------------------------------------------------------------------------------

    def assign(self, name, dtype, value):
        """Writes a value of that type to a register, which may be wider."""
        if name == "_":
            return ""
        wide_type = dtype if is_float(dtype) else "s64" if dtype[0] == "s" else "u64"
        cast = "" if is_float(dtype) else "!!" if dtype == "pred" else f"({C_TYPES[dtype]})"
        return f"{variable(name)}.{wide_type} = {cast}({value});"

    def address(self, text):
        base, offset = re.match(r"(.+?)([+-]-?\d+)?$", text.strip()[1:-1]).groups()
        return f"({read(base, 'u64')} {(offset or '').replace('+-', '-')})"

    # -- instructions ----------------------------------------------------------------------------

    def instruction(self, op, text):
        """C of an instruction."""
        name, *mods = op.split(".")
        dtype, a = mods[-1] if mods else "", operands(text)
        if name in PLAIN:
            return PLAIN[name]
        if "cc" in mods or name in ("addc", "subc", "madc"):
            return self._carry(name, mods, a)
        ways = [f"{mod}.{dtype[:1]}" for mod in mods]
        for form in (*(f"{name}.{way}" for way in (*ways, *mods, dtype[:1])), name):
            if form in FORMS and not (name == "setp" and LOGIC.keys() & set(mods)):
                return self._write_form(FORMS[form], name, mods, a)
        handler = getattr(self, f"do_{name}", None)
        if handler is None:
            raise Untranslated(op)
        return handler(mods, dtype, a)

    def _write_form(self, form, name, mods, a):
        dtype, bits = mods[-1], 8 * size_of(mods[-1])
        wide = f"{dtype[0]}{2 * bits}"
        to = wide if "wide" in mods else RESULTS.get(name, dtype)
        words = {"kind": dtype, "bits": bits, "f": "f" if dtype == "f32" else ""}
        words |= {"u": C_TYPES.get(f"u{bits}"), "c2": C_TYPES.get(wide)}
        values = [Operand(x, dtype, wide) for x in a[1:]]
        return self.assign(a[0], to, self._flush(to, mods, form.format(*values, **words)))

    def _carry(self, name, mods, a):
        """C of an instruction that takes a carry (addc), or leaves one (.cc)."""
        dtype = f"u{8 * size_of(mods[-1])}"
        bits, wide = int(dtype[1:]), C_TYPES[f"u{2 * int(dtype[1:])}"]
        values = [f"({wide}){read(x, dtype)}" for x in a[1:]]
        if name.startswith("mad"):
            product = f"{values[0]} * {values[1]}"
            part = f"({product}) >> {bits}" if "hi" in mods else f"({C_TYPES[dtype]})({product})"
            values = [f"({wide})({part})", values[2]]
        sign = "-" if name.startswith("sub") else "+"
        carry = f" {sign} T->carry" if name.endswith("c") else ""
        left = f" T->carry = (sum >> {bits}) & 1;" if "cc" in mods else ""
        to = self.assign(a[0], dtype, f"({C_TYPES[dtype]})sum")
        return f"{{ {wide} sum = {values[0]} {sign} {values[1]}{carry}; {to}{left} }}"

    def do_bra(self, mods, dtype, a):
        return f"goto {a[0].replace('$', '_S_')};"

    def do_brx(self, mods, dtype, a):
        jumps = enumerate(self.targets[a[1]])
        cases = " ".join(f"case {n}: goto {to.replace('$', '_S_')};" for n, to in jumps)
        return f"switch ({read(a[0], 'u32')}) {{ {cases} }}"

    def do_bar(self, mods, dtype, a):
        if mods[0] not in ("sync", "warp"):
            raise Untranslated("bar." + ".".join(mods))
        if mods[0] == "warp":
            return ";"
        self.meets = True
        return "emu_barrier(T);"

    do_barrier = do_bar

    def do_mov(self, mods, dtype, a):
        if a[0].startswith("{"):
            elements = operands(a[0][1:-1])
            w = int(dtype[1:]) // len(elements)
            pieces = (
                self.assign(p, f"b{w}", f"(uint{w}_t)(whole >> {w * n})")
                for n, p in enumerate(elements)
            )
            return f"{{ uint64_t whole = {read(a[1], dtype)}; {' '.join(pieces)} }}"
        if a[1].startswith("{"):
            elements = operands(a[1][1:-1])
            w = int(dtype[1:]) // len(elements)
            values = [f"((uint64_t){read(p, f'b{w}')} << {w * n})" for n, p in enumerate(elements)]
            return self.assign(a[0], dtype, f"({C_TYPES[dtype]})({' | '.join(values)})")
        return self.assign(a[0], dtype, read(a[1], dtype))

    @staticmethod
    def _space(mods):
        """Name of a space of memory in the record of races; None if it belongs to one thread."""
        if "param" in mods or "local" in mods:
            return None
        return "SHARED_SPACE" if "shared" in mods else "0"

    def do_ld(self, mods, dtype, a):
        vector = any(m in ("v2", "v4") for m in mods)
        registers, c_type = operands(a[0][1:-1]) if vector else [a[0]], C_TYPES[dtype]
        out, space = f"{{ uint64_t a = {self.address(a[1])}; ", self._space(mods)
        if space:
            size = f"{len(registers)} * sizeof({c_type})"
            out += f"emu_aligned(T, a, {size}); emu_read(T, a, {size}, {space}); "
        for n, register in enumerate(registers):
            out += self.assign(register, dtype, f"(({c_type} *)a)[{n}]") + " "
        return out + "}"

    do_ldu = do_ld

    def do_st(self, mods, dtype, a):
        vector = any(m in ("v2", "v4") for m in mods)
        registers, c_type = operands(a[1][1:-1]) if vector else [a[1]], C_TYPES[dtype]
        out, space = f"{{ uint64_t a = {self.address(a[0])}; ", self._space(mods)
        if space:
            out += f"emu_aligned(T, a, {len(registers)} * sizeof({c_type})); "
        for n, register in enumerate(registers):
            value, element = read(register, dtype), f"(({c_type} *)a)[{n}]"
            if space:
                same = f"!memcmp(&new, (void *)(a + {n} * sizeof new), sizeof new)"
                out += f"{{ {c_type} new = {value}; "
                out += f"emu_wrote(T, a + {n} * sizeof new, sizeof new, {same}, {space}); "
                out += f"{element} = new; }} "
            else:
                out += f"{element} = {value}; "
        return out + "}"

    def do_atom(self, mods, dtype, a, first=1):
        which, c_type = next(m for m in mods if m in ATOMIC), C_TYPES[dtype]
        new_value = ATOMIC[which].format(*(read(x, dtype) for x in a[first + 1 :]))
        out = f"{{ {c_type} *a = ({c_type} *){self.address(a[first])}; "
        is_sum = int(which == "add" and is_float(dtype))
        out += "emu_aligned(T, (uint64_t)a, sizeof *a); "
        out += f"emu_atomic(T, (uint64_t)a, sizeof *a, {is_sum}); "
        out += f"{c_type} old = *a; *a = {new_value}; "
        return out + (self.assign(a[0], dtype, "old") if first else "") + " }"

    def do_red(self, mods, dtype, a):
        return self.do_atom(mods, dtype, a, first=0)

    def do_cvt(self, mods, dtype, a):
        to, source = mods[-2], mods[-1]
        x = self._flush(source, mods, read(a[1], source))
        rounding = next((ROUNDING[m] for m in mods if m in ROUNDING), "")
        if is_float(source) and not is_float(to):
            return self.assign(a[0], to, f"sat_{to}({rounding}((double){x}))")
        if is_float(source):
            value = f"({C_TYPES[to]}){rounding}({x})"
            return self.assign(a[0], to, self._flush(to, mods, value))
        return self.assign(a[0], to, f"({C_TYPES[to]}){x}")

    @staticmethod
    def _flush(dtype, mods, value):
        return f"ftz({value})" if dtype == "f32" and "ftz" in mods else value

    # -- statements ------------------------------------------------------------------------------

    def add(self, statement):
        """One statement of PTX, without what ends it."""
        s = " ".join(statement.split())
        if self.plain and not s.startswith(".reg"):
            s = re.sub(r"(?<![\w%.$])[A-Za-z]\w*", self._mark, s)
        if not s or s.startswith((".callprototype", ".pragma", ".loc ", ".file ")):
            return
        if s in "{}":
            self.lines.append(s)
        elif s.startswith(".branchtargets"):
            self.targets[self.label] = operands(s.removeprefix(".branchtargets"))
        elif s.endswith(":"):
            self.label = s[:-1].strip()
            self.lines.append(f"{s[:-1].strip().replace('$', '_S_')}:;")
        elif s.startswith(".reg"):
            self.lines.append(self._registers(s))
        elif s.startswith((".local", ".shared")):
            name, size = re.match(r"\.\w+ (?:\.align \d+ )?\.b8\s+([\w$]+)\[(\d+)\]", s).groups()
            still = "static " if s.startswith(".shared") else ""
            self.lines.append(f"{still}_Alignas(16) uint8_t {name}[{size}];")
        elif s.startswith(".param"):
            dtype, name, count = PARAMETER.match(s).groups()
            self.lines.append(f"_Alignas(16) uint8_t {name}[{size_of(dtype) * int(count or 1)}];")
        else:
            self._add_guarded(s)

    def _mark(self, match):
        return f"%{match[0]}" if match[0] in self.plain else match[0]

    def _registers(self, s):
        names = []
        for declared in re.match(r"\.reg \.\w+\s+(.*)$", s)[1].split(","):
            name, count = re.match(r"(%?\w+)(?:<(\d+)>)?$", declared.strip()).groups()
            names += [f"{name}{n}" for n in range(int(count))] if count else [name]
        self.plain.update(name for name in names if not name.startswith("%"))
        variables = (variable(n if n.startswith("%") else f"%{n}") for n in names)
        return "Register " + ", ".join(f"{n} = {{0}}" for n in variables) + ";"

    def _add_guarded(self, s):
        guard = ""
        if match := re.match(r"@(!?)(%\w+) (.*)$", s):
            guard, s = f"if ({match[1]}{variable(match[2])}.pred) ", match[3]
        if s.startswith("call"):
            out = self._call(s)
        else:
            out = self.instruction(*re.match(r"([\w.]+)\s*(.*)$", s).groups())
        self.lines.append(f"{guard}{{ {out} }}" if guard else out)

    def _call(self, s):
        form = r"call(?:\.uni)?\s*(?:\(([^)]*)\),\s*)?([%\w$.]+)(?:,\s*\(([^)]*)\))?"
        returned, callee, arguments = re.match(form, s).groups()
        listed = ",".join(x for x in (returned, arguments) if x)
        names = ["T", *(x.strip() for x in listed.split(",") if x.strip())]
        if callee.startswith("%"):
            types = ", ".join(["Thread *", *["uint8_t *"] * (len(names) - 1)])
            callee = f"((void (*)({types})){variable(callee)}.u64)"
        return f"{callee}({', '.join(names)});"


def statements(body):
    """The statements of a body: between semicolons, labels, braces of blocks."""
    statement, depth = "", 0
    for char in body:
        if char in "{}" and depth == 0 and (char == "}" or not statement.strip()):
            yield from (statement, char)
            statement = ""
        elif char == ";":
            yield statement
            statement = ""
        elif char == ":" and re.match(r"\s*[\w$]+\s*$", statement):
            yield statement + ":"
            statement = ""
        else:
            depth += (char == "{") - (char == "}")
            statement += char
