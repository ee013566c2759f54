"""A scene as text, and ways to change one of its blocks: what the tests of scenes share."""

from pathlib import Path

from dusttaichi.scene import Scene, from_yaml

CONFIGS = Path(__file__).parent.parent / "configs"

BASE = """\
name: cake
material: silicate_s12
interaction: {rolling: on}
sample: {kind: rbd, grains: 100}
boundary: {kind: box, wall_speed: 1 cm/s}
stop: {filling_factor: 0.55}
numerics: {time_step: auto}
output: {snapshots: off}
"""
LINE = {text.split(":")[0]: number for number, text in enumerate(BASE.splitlines(), start=1)}


def edited(block: str, text: str) -> str:
    """BASE with the line of one block replaced."""
    return "".join(
        f"{text}\n" if line.startswith(f"{block}:") else line
        for line in BASE.splitlines(keepends=True)
    )


def scene(**blocks: str) -> Scene:
    text = BASE
    for block, value in blocks.items():
        text = text.replace(BASE.splitlines()[LINE[block] - 1], f"{block}: {value}")
    return from_yaml(text)


OPEN = {"boundary": "{kind: open}", "stop": "{steps: 10}"}
POSITIONS = "positions: [[0 m, 0 m, 0 m], [1.2 um, 0 m, 0 m]]"

FULL = {
    "material": "{base: ice_t19, name: my ice, radius: 0.123456789012345678 um}",
    "interaction": "{rolling: off, twisting: {modifier: 0.1}, damping: none, "
    "shear_modulus: printed}",
    "sample": f"{{kind: explicit, {POSITIONS}, velocities: [[1 m/s, 0 m/s, 0 m/s], [0 m/s, 0 m/s, "
    "-1e-17 m/s]]}",
    "boundary": "{kind: box, size: [40 um, 40 um, 3.3333333333333335 um], omit: [bottom]}",
    "stop": "{pressure: 1 kPa, time: 0.1 ms, steps: 1e6}",
    "numerics": "{time_step: 0.3 ns, precision: f64, backend: cuda, threads: 2, skin: 0.1}",
    "output": "{directory: elsewhere, series: {steps: 7}, profiles: {time: 1 us}, snapshots: off, "
    "contacts: false, window: 100, checkpoint: 5 s}",
}
