"""Cost of a scene against its size (`python -m benchmarks size`).

Each phase of each size is a process of its own: `dust check`, the sample, the run with its build,
steps and output, `dust plot` and `dust report`. Numbers are processor time, which other programs
affect less than wall time, and the largest resident memory. Kinds of samples follow, each up to
the size at which it takes too long.
"""

import math
import tempfile
from pathlib import Path

from benchmarks.continuum import scene_of
from benchmarks.table import Column, Table, check_file
from dusttaichi.errors import DustError
from dusttaichi.scene import Scene, load, quantities
from dusttaichi.studies.machine_speed import Timed, machine

TASK = "benchmarks.size_task:answer"
GRAINS = (1_000, 10_000, 100_000, 1_000_000, 10_000_000)
CONTINUUM = (10_000, 100_000, 1_000_000)  # particles of the bed, about, in three dimensions
QUICK = 10_000  # largest size with --quick
ALL_PHASES = 1_000_000  # largest size that is run, drawn and reported
STEPS = 60  # of a run of grains; of a continuum, output steps of some nine time steps each
PARTICLE_STEPS = 1_000_000  # of a run of a continuum, about: fewer output steps of larger ones
LONGEST = 30.0  # s of a sample, from which on no larger one of its kind is made
SCENE = "omni_static"
SHORT = 0.05  # s: of a shorter time no growth is given

PHASES = ("check", "sample", "build", "steps", "output", "files", "figures", "report")
FRONT = (
    Column("method", "method"),
    Column("kind", "sample"),
    Column("particles", "particles"),
    Column("run_steps", "steps of the run"),
)
SECONDS = (
    *(Column(phase, f"{phase}, s", "s", 2) for phase in PHASES),
    Column("exponent", "sample, exponent", "1", 2),
)
PEAKS = tuple(
    Column(f"{phase}_peak", f"{phase}, MB", "MB", 0)
    for phase in ("check", "sample", "run", "figures", "report")
)

LIST = "explicit, a text file"
SIZES = {"kind": "list", "radii": ["0.5 um", "0.6 um"]}
KINDS = {  # name -> block of the sample of n grains
    "rbd": lambda n: {"kind": "rbd", "grains": n},
    "pca": lambda n: {"kind": "pca", "grains": n},
    "pca, a box": lambda n: {"kind": "pca", "grains": n, "shape": "box"},
    "pca, two sizes": lambda n: {"kind": "pca", "grains": n, "sizes": SIZES},
    "bcca, 2^k grains": lambda n: {"kind": "bcca", "grains": 2 ** round(math.log2(n))},
    "bcca, two sizes": lambda n: {"kind": "bcca", "grains": n, "sizes": SIZES},
    "space_filling": lambda n: {"kind": "space_filling", "grains": n},
    "random_packing": lambda n: {"kind": "random_packing", "grains": n},
    "random_packing, 0.3": lambda n: {
        "kind": "random_packing",
        "grains": n,
        "filling_factor": 0.3,
    },
    "lattice": lambda n: {"kind": "lattice", "structure": "fcc", "grains": n},
    "cutout of rbd": lambda n: {
        "kind": "cutout",
        "of": {"kind": "rbd", "grains": 2 * n},
        "grains": n,
    },
    LIST: lambda n: {"kind": "rbd", "grains": n},  # written to a file that is read
}
VOLUME = 1e-9  # m^3, of each of the bodies
BODIES = {
    "block": {"kind": "block", "size": ["1 mm", "1 mm", "1 mm"]},
    "sphere": {"kind": "sphere", "diameter": "1.24 mm"},
    "block, glass": {"kind": "block", "size": ["1 mm", "1 mm", "1 mm"], "lattice": "glass"},
    "block, filling factor of a length": {
        "kind": "block",
        "size": ["1 mm", "1 mm", "1 mm"],
        "filling_factor": {"sigma": 0.01, "length": "20 um"},
    },
}


def main(
    *,
    out: str | Path | None = None,
    quick: bool = False,
    sizes=None,
    kinds: bool = True,
    scenes: bool = True,
    method: str | None = None,
    log=print,
) -> Table:
    """Measure every phase of every size, then kinds of samples.

    sizes: numbers of particles instead of all. kinds, scenes: whether to measure those. method: of
    the scenes, "grains" or "continuum", instead of both. out: CSV file, written after every size.
    log: called with lines on the progress.
    """
    check_file(out)
    rows, notes = [], []
    hardware = machine()
    sizes = sizes or sorted({*GRAINS, *CONTINUUM})
    sizes = [n for n in sizes if not quick or n <= QUICK]

    def done(row):
        rows.append(row)
        table = Table(hardware, rows, _blocks(), (NOTE, *notes))
        if out is not None:
            table.to_csv(out)
        return table

    table = Table(hardware, rows, _blocks(), (NOTE,))
    methods = ("grains", "continuum") if method is None else (method,)
    for name in methods if scenes else ():
        numbers = GRAINS if name == "grains" else CONTINUUM
        for n in (n for n in sizes if n >= numbers[0] and n <= numbers[-1]):
            log(f"{name}, {n:,} particles")
            table = done(_phases(name, n, notes, log))
    for name in methods if kinds else ():
        for kind in KINDS if name == "grains" else BODIES:
            for row in _of_kind(name, kind, sizes, notes, log):
                table = done(row)
    return table


NOTE = (
    "Processor time of a process for each phase, beyond the start of Python. Run: on one thread, "
    "with frames at start and end. Build: first contacts or forces, of grains the first step, and "
    "kernels, from the cache where they are. Files: of the processes that write them beside the "
    "run. Exponent: growth of the time of the sample since the size before; for N log N about 1.1. "
    "Memory: the largest resident one of a process."
)


def _blocks():
    return [("Processor time", FRONT, SECONDS), ("Largest memory", FRONT, PEAKS)]


def _phases(method, n, notes, log) -> dict:
    """Row of a size: seconds and largest memory of each phase."""
    scene = _scene(method, n)
    row = {"method": method, "kind": scene.sample.kind, "particles": n}
    row["run_steps"] = scene.stop.steps
    with tempfile.TemporaryDirectory() as folder:
        file, run = Path(folder, "scene.yaml"), Path(folder, "run")
        file.write_text(scene.to_yaml(), encoding="utf-8")
        tasks = {"check": {"do": "command", "phase": "check", "arguments": ["check", str(file)]}}
        tasks["sample"] = {"do": "sample", "scene": scene.to_yaml()}
        if n <= ALL_PHASES:
            tasks["run"] = {"do": "run", "scene": scene.to_yaml(), "directory": str(run)}
            for phase, name in (("figures", "plot"), ("report", "report")):
                tasks[phase] = {"do": "command", "phase": phase, "arguments": [name, str(run)]}
        for phase, task in tasks.items():
            try:
                row |= _measure(phase, task)
                log(f"  {phase}: {row.get(phase, row.get('steps')):.2f} s")
            except DustError as error:
                notes.append(f"{method}, {n:,}, {phase}: {error}")
                break
    return row


def _measure(phase, task) -> dict:
    """Numbers of a task in a process of its own."""
    with Timed(TASK) as process:
        answer = process.call(**task)
    peak = answer.pop("peak") / 1e6
    return answer | {f"{phase}_peak": peak}


def _scene(method, n) -> Scene:
    if method == "continuum":
        steps = max(3, min(STEPS, PARTICLE_STEPS // n))
        return scene_of(3, n, 1).with_value("stop.steps", steps)
    scene = load(SCENE).with_value("sample.grains", n).with_value("numerics.threads", 1)
    return scene.with_value("stop", {"steps": STEPS})


def _of_kind(method, name, sizes, notes, log):
    """Rows of a kind of sample, up to the size that takes too long or is refused."""
    previous = None
    for n in sizes:
        if n > ALL_PHASES:
            return
        log(f"{name}, {n:,} particles")
        with tempfile.TemporaryDirectory() as folder:
            task = {"do": "sample", "scene": _scene_of_kind(method, name, n).to_yaml()}
            if name == LIST:
                task["file"] = str(Path(folder, "grains.txt"))
            try:
                row = _measure("sample", task)
            except DustError as error:
                notes.append(f"{name}, {n:,}: {error}")
                return
        row |= {"method": method, "kind": name}
        if previous is not None and previous["sample"] > SHORT:
            growth = row["particles"] / previous["particles"]
            if growth > 2.0:
                row["exponent"] = math.log(row["sample"] / previous["sample"], growth)
        previous = row
        yield row
        if row["sample"] > LONGEST:
            notes.append(f"{name}: larger ones are left out, since they take too long.")
            return


def _scene_of_kind(method, name, n) -> Scene:
    if method == "grains":
        block = {"name": "size", "material": "silicate_s12", "sample": KINDS[name](n)}
        return Scene.from_dict(block | {"boundary": {"kind": "open"}, "stop": {"steps": 1}})
    spacing = (2**0.5 * VOLUME / n) ** (1.0 / 3.0)
    block = {"name": "size", "method": "continuum", "dimension": 3, "material": "dust_g09"}
    block |= {"sample": BODIES[name], "numerics": {"spacing": quantities.format(spacing, "length")}}
    return Scene.from_dict(block | {"stop": {"steps": 1}})
