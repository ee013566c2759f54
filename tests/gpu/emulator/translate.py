"""`python translate.py MOD.ptx`: translates the PTX of kernels (of LLVM's NVPTX) to C and
compiles it to MOD.so, which has run_NAME(parameters, blocks, threads) for each kernel.

Compiled modules are cached by their hash in EMULATOR_CACHE. With EMULATOR_RACES=1 reads and writes
are recorded (threads.h).
"""

import hashlib
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

from instructions import C_TYPES, PARAMETER, Body, operands, statements

HERE = Path(__file__).parent
TOOLS = ("translate.py", "instructions.py", "threads.h")
FLAGS = ("-w", "-ffp-contract=off", "-fno-strict-aliasing", "-fno-builtin-fmin", "-shared", "-fPIC")


class Module:
    """A PTX module: functions, kernels and tables of constants, in C."""

    HEAD = re.compile(
        r"\s*(?:\.visible |\.extern |\.weak )*\.(entry|func)\s*(\([^)]*\))?\s*([\w$.]+)"
        r"\s*\(([^)]*)\)([^;{]*)"
    )
    TABLE = re.compile(
        r"\s*((?:\.visible |\.extern |\.weak )*)\.(global|const|shared)\s+(?:\.align (\d+) )?"
        r"\.(\w+)\s+([\w$]+)((?:\[\d*\])*)(?:\s*=\s*(\{[^}]*\}|[^;]*))?;"
    )
    OTHER = re.compile(r"\s*\.(version|target|address_size)[^\n]*\n")

    def __init__(self, text):
        text = re.sub(r"/\*.*?\*/", "", re.sub(r"//[^\n]*", "", text), flags=re.S)
        self.tables, self.signatures, self.bodies, self.kernels = [], {}, {}, []
        offset = 0
        while text[offset:].strip():
            offset = self._next(text, offset)

    def _next(self, text, offset):
        if match := self.HEAD.match(text, offset):
            return self._function(match, text, match.end())
        if match := self.TABLE.match(text, offset):
            self._table(*match.groups()[1:])
            return match.end()
        if match := self.OTHER.match(text, offset):
            return match.end()
        raise SystemExit("cannot parse: " + text[offset : offset + 200])

    def _table(self, space, align, dtype, name, lengths, values):
        count = 1
        for length in re.findall(r"\[(\d*)\]", lengths):
            count *= int(length or 1)
        initialiser = (
            "" if not values else f" = {values if values[0] == '{' else '{' + values + '}'}"
        )
        self.tables.append(f"static _Alignas(16) {C_TYPES[dtype]} {name}[{count}]{initialiser};")

    def _function(self, match, text, offset):
        directive, returned, name, parameters = match.groups()[:4]
        listed = operands(parameters)
        if returned:
            listed = [*operands(returned[1:-1]), *listed]
        names = [PARAMETER.match(" ".join(p.split())).group(2) for p in listed]
        self.signatures[name] = ", ".join(["Thread *T", *(f"uint8_t *{n}" for n in names)])
        if text[offset] == ";":
            return offset + 1
        end, depth = offset, 0
        while True:
            depth += (text[end] == "{") - (text[end] == "}")
            if depth == 0:
                break
            end += 1
        body = Body()
        for statement in statements(text[offset + 1 : end]):
            body.add(statement)
        self.bodies[name] = body
        if directive == "entry":
            self.kernels.append((name, len(names)))
        return end + 1

    def source(self):
        """The module in C."""
        out = ['#include "threads.h"', *self.tables]
        out += [f"static void {name}({s});" for name, s in self.signatures.items()]
        out += [
            f'static void {name}({s}) {{ emu_stop("{name}"); }}'
            for name, s in self.signatures.items()
            if name not in self.bodies
        ]
        for name, body in self.bodies.items():
            lines = "\n  ".join(body.lines)
            out.append(f"static void {name}({self.signatures[name]}) {{\n  {lines}\n}}")
        meets = int(any(body.meets for body in self.bodies.values()))
        for name, count in self.kernels:
            arguments = ", ".join(["T", *(f"(uint8_t *)params[{n}]" for n in range(count))])
            out.append(
                f"static void one_{name}(Thread *T, void **params) {{ {name}({arguments}); }}"
            )
            out.append(
                f"void run_{name}(void **params, unsigned blocks, unsigned threads) "
                f'{{ emu_run("{name}", one_{name}, params, blocks, threads, {meets}); }}'
            )
        return "\n".join(out) + "\n"


def main(path):
    path, races = Path(path), os.environ.get("EMULATOR_RACES") == "1"
    library, text = path.with_suffix(".so"), path.read_text()
    tools = [(HERE / name).read_text() for name in TOOLS]
    key = hashlib.sha256("".join([text, *tools, str(races)]).encode()).hexdigest()[:24]
    stored = Path(os.environ["EMULATOR_CACHE"]) / f"{key}.so"
    if not stored.exists():
        source = path.with_suffix(".c")
        source.write_text(Module(text).source())
        flags = [*FLAGS, "-I", str(HERE), *(["-DRACES"] if races else [])]
        flags += ["-mfma"] if os.uname().machine == "x86_64" else []
        subprocess.run(["gcc", "-O0", *flags, "-o", library, source, "-lm"], check=True)
        stored.parent.mkdir(parents=True, exist_ok=True)
        complete = stored.with_suffix(f".{os.getpid()}")
        shutil.copy(library, complete)
        complete.replace(stored)
        return
    shutil.copy(stored, library)


if __name__ == "__main__":
    main(sys.argv[1])
