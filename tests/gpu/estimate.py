"""Estimates of a step on a GPU from the kernels that Taichi generates, not measured on a GPU.

`python tests/gpu/estimate.py` generates the kernels of two scenes, counts the instructions of a
step, finds its registers with ptxas, and divides the bytes and operations of a step by the rates of
a device. `--host` measures the CPU time of the host for a step with launches that do nothing.
"""

import re
import sys
import tempfile
from pathlib import Path

import emulated
from test_emulated import registers

PAIRS = 2.5  # listed pairs a grain, as in the densest sample of `dust bench`
# bytes a second of memory; instructions a second in single and in double precision, half of the
# operations that data sheets have, where a multiplication with an addition is two
DEVICES = {"H200": (4.8e12, 33e12, 17e12), "RTX 4090": (1.0e12, 41e12, 0.65e12)}
KERNELS = ("touch", "kick_and_drift")
ARITHMETIC = "add sub mul fma div rcp sqrt rsqrt min max neg abs setp selp ex2 lg2 cvt".split()


def kernel_of(name):
    """Name without the additions of Taichi: touch of touch_c48_0_kernel_0_range_for."""
    return re.sub(r"_c\d+_.*", "", name)


def instructions(text, entry):
    """Kind -> count of the static instructions of a kernel."""
    begin = text.index("{", text.index(f".entry {entry}("))
    body = text[begin : text.index("\n}", begin)]
    found = dict.fromkeys(("f64", "f32", "loads", "stores", "all"), 0)
    for op in re.findall(r"^\s*(?:@!?%p\d+ )?([a-z]\w*(?:\.\w+)*)\s", body, flags=re.M):
        name, *mods = op.split(".")
        found["all"] += 1
        apart = {"param", "local", "shared"} & set(mods)
        found["loads"] += name == "ld" and not apart
        found["stores"] += name == "st" and not apart
        if name in ARITHMETIC and mods:
            for kind in ("f64", "f32"):
                found[kind] += kind in mods
    return found


def of_modules(folder):
    """Kernel of a step -> (instructions, registers); the longest one of each name."""
    out, used = {}, registers(folder)
    for module in sorted(folder.glob("*.ptx")):
        text = module.read_text()
        for entry in re.findall(r"\.entry (\w+)\(", text):
            name = kernel_of(entry)
            if name in KERNELS:
                found = instructions(text, entry)
                if name not in out or found["all"] > out[name][0]["all"]:
                    out[name] = found, used[entry][0]
    return out


def estimate(name):
    """Lines of the table of a case."""
    with tempfile.TemporaryDirectory() as folder:
        output, _ = emulated.start(["-c", LAUNCH, name, "1"], Path(folder))
        found = of_modules(Path(folder))
    pair, grain = map(float, output.split()[:2])
    moved = PAIRS * pair + grain
    lines = []
    for kernel in KERNELS:
        counted, used = found[kernel]
        lines.append(
            f"| {name} | `{kernel}` | {used} | {counted['f64']} | {counted['f32']} "
            f"| {counted['loads']}/{counted['stores']} |"
        )
    work = {
        kind: PAIRS * found["touch"][0][kind] + found["kick_and_drift"][0][kind]
        for kind in ("f32", "f64")
    }
    for device, (memory, single, double) in DEVICES.items():
        by_memory, by_work = memory / moved, 1.0 / (work["f32"] / single + work["f64"] / double)
        lines.append(
            f"{name}, {device}: {moved:.0f} B a grain-step; memory allows {by_memory:.1e} "
            f"grain-steps a second, arithmetic {by_work:.1e}"
        )
    return lines


# launches that do nothing; prints bytes of a pair and a grain, and us of the host for a step
LAUNCH = """
import ctypes, sys, time
import cases
from benchmarks.traffic import traffic
from dusttaichi.compute.launching import LOOK
motion, _ = cases.run(sys.argv[1], "cuda", steps=0)
sim, steps = motion.sim, int(sys.argv[2])
arguments = (sim.step, 0, 1, cases.step_arguments(sim), sim.walls_argument)
advance = sim.kernels.advance
advance(1, *arguments)
ctypes.CDLL("libcuda.so.1").emulator_pause()
best = 1e9
for _ in range(7 if steps > 1 else 1):
    began = time.process_time()
    for _ in range(-(-steps // LOOK)):
        advance.launch(min(LOOK, steps))
    best = min(best, time.process_time() - began)
moved = {name: a + b for name, (a, b, _) in traffic(sim).items() if name != "sum"}
pair = sum(moved.pop(name) for name in ("history", "loads", "lists"))
grain = sum(moved.values()) * sim.state.pair_count / sim.grains
print(pair, grain, best / steps * 1e6)
"""


def host_cost(name):
    """CPU time of the host for a step [us], launches that do nothing."""
    with tempfile.TemporaryDirectory() as folder:
        output, _ = emulated.start(["-c", LAUNCH, name, "3200"], Path(folder))
    return float(output.split()[2])


def main():
    if "--host" in sys.argv:
        for name in ("box_mixed", "sheared_mixed"):
            print(f"{name}: {host_cost(name):.1f} us of the host for a step", flush=True)
        return
    for name in ("box_f64", "box_mixed"):
        print("\n".join(estimate(name)), flush=True)


if __name__ == "__main__":
    main()
