"""Cost of each part of a scene of grains (`python -m benchmarks parts [FILE]`).

Pairs of scenes, one with the part and one without it, run the same steps with the same grains in
two processes, which are timed in turn, round after round. The result is the median of the ratios of
a round, with their scatter.
"""

import math
import statistics
from dataclasses import dataclass
from pathlib import Path

import yaml

from benchmarks import sample as bench_sample
from benchmarks.table import Column, Table, check_file
from dusttaichi import method
from dusttaichi.errors import DustError
from dusttaichi.grains.grain_scene import GrainsScene
from dusttaichi.physics.contact import effect_registry
from dusttaichi.scene.drive import SPEEDS
from dusttaichi.scene.numerics import PRESETS
from dusttaichi.studies.machine_speed import Timed, machine

GRAINS, QUICK_GRAINS = 11_000, 1_000
FILLING_FACTOR = 0.35
ROUNDS, QUICK_ROUNDS = 31, 15
# of a measurement, a twelfth of a second: other load of the machine changes more slowly
GRAIN_STEPS = 1_000_000
LEAST_STEPS = 100


BUILT = ("ledger", "polydisperse")  # arguments of task.Benchmark.build in place of keys
PRECISION = PRESETS["balanced"]["precision"]


@dataclass(frozen=True)
class Part:
    """A row of the table: the part `name` of a scene, against `instead`.

    with_part, without_part: changes of the scene, path -> value; or BUILT.
    """

    name: str
    instead: str
    with_part: dict
    without_part: dict


def _off(*effects):
    return {f"interaction.{effect}": "off" for effect in effects}


FULL = {}
OPEN = {"boundary": {"kind": "open"}}
PERIODIC = {"boundary": {"kind": "periodic"}, "output.stress": False}
NO_DAMPING = {"interaction.damping": "none"}
PUSH = [{"face": "top", "force": ["0 N"] * 3}]
PARTS = (
    Part("walls", "open boundary", FULL, OPEN),
    Part("rolling", "off", FULL, _off("rolling")),
    Part("sliding", "off", FULL, _off("sliding")),
    Part("twisting", "off", FULL, _off("twisting")),
    Part("viscous damping", "none", FULL, NO_DAMPING),
    Part("viscoelastic damping", "viscous", {"interaction.damping": "viscoelastic"}, FULL),
    Part(
        "rolling, sliding, twisting and damping",
        "adhesion only",
        FULL,
        _off("rolling", "sliding", "twisting") | NO_DAMPING,
    ),
    Part("asperities", "off", {"interaction.asperities": {"volume": "0.0336 nm"}}, FULL),
    Part("energy ledger", "losses not summed", FULL, {"ledger": False}),
    Part("polydisperse grains", "equal grains", {"polydisperse": True}, FULL),
    Part("periodic faces", "open boundary", PERIODIC, OPEN),
    Part("stress", "not summed", PERIODIC | {"output.stress": True}, PERIODIC),
    Part("orientations", "not followed", {"output.variables": ["orientation"]}, FULL),
    Part("push with a force", "none", OPEN | {"push": PUSH}, OPEN),
    Part("precision f64", "mixed", {"numerics.precision": "f64"}, FULL),
    Part("precision f32", "mixed", {"numerics.precision": "f32"}, FULL),
    Part("3 Newton steps", "1", {"numerics.newton_steps": 3}, FULL),
    Part("2 Newton steps", "1", {"numerics.newton_steps": 2}, FULL),
    Part("1 Newton step", "none", FULL, {"numerics.newton_steps": 0}),
    Part("nothing (the same scene twice)", "", FULL, FULL),
)


EFFECTS = tuple(effect for effect in effect_registry.EFFECTS if effect not in ("normal", "damping"))
# the measured steps contain no stage and no end
PLAIN = {
    "stages": [],
    "stop": {"steps": 1},
    "output": {"series": {"steps": 1000}, "profiles": "off", "contacts": False},
}


def parts_of(scene):
    """(a scene of grains at rest, its optional Parts). Raises DustError for another method."""
    if not isinstance(scene, GrainsScene):
        raise DustError(
            f"only parts of scenes of grains can be timed, not of the method {scene.method}; see "
            "python -m benchmarks continuum for the step of the continuum."
        )
    stress = scene.output.stress
    # without moving walls, which would compress the sample during a long measurement
    still = [key for key in SPEEDS if getattr(scene.boundary, key, None)]
    data = yaml.safe_load(scene.to_yaml())
    data |= {**PLAIN, "output": PLAIN["output"] | {"stress": stress}}
    data["boundary"] = {k: v for k, v in data["boundary"].items() if k not in still}
    data["numerics"]["threads"] = 1  # several are slow where other programs use the cores
    without = {name: _off(name) for name in EFFECTS if getattr(scene.interaction, name) is not None}
    if scene.interaction.damping.model != "none":
        without["damping"] = NO_DAMPING
    if scene.boundary.kind != "open":
        name = "periodic faces" if scene.boundary.kind == "periodic" else "walls"
        name += " and stress" if stress else ""
        without[name] = OPEN | {"output.stress": False}
    if stress:
        without["stress"] = {"output.stress": False}
    if scene.push:
        without["pushes"] = {"push": []}
    without |= {"energy ledger": {"ledger": False}, "noise: the scene with all": FULL}
    optional_parts = [Part(name, "", FULL, changes) for name, changes in without.items()]
    return type(scene).from_dict(data), optional_parts


def _columns(per):
    front = Column("part", "part"), Column("instead", "in its place")
    return front, (
        Column("has", f"with, ns {per}", "ns", 1),
        Column("lacks", f"without, ns {per}", "ns", 1),
        Column("ratio", "without over with", "1", 3),
        Column("scatter", "scatter of the ratio", "1", 3),
        Column("share", "cost, % of with", "%", 1),
    )


def main(
    scene=None,
    parts=PARTS,
    *,
    grains: int | None = None,
    steps: int | None = None,
    rounds: int | None = None,
    out: str | Path | None = None,
    quick: bool = False,
    log=lambda line: None,
) -> Table:
    """Measure every part; about ten minutes, `quick` three.

    scene: a Scene of grains, timed at its start without each of its parts, half a minute each; by
    default that of the benchmark with the `parts`. grains: of the sample of the benchmark, 11 000,
    quick 1000. steps: of a measurement. rounds: 31, quick 15. out: CSV file, written after every
    part. log: called with lines on the progress. A part that the build refuses becomes a note.
    Ctrl-C ends the measurement with the parts so far. Raises DustError for a scene without known
    parts.
    """
    rounds = rounds or (QUICK_ROUNDS if quick else ROUNDS)
    check_file(out)
    path, per = None, "a contact" if scene is None else "a step"
    if scene is None:
        grains = grains or (QUICK_GRAINS if quick else GRAINS)
        recipe = bench_sample.Recipe(grains, FILLING_FACTOR)
        bench_sample.prepare(recipe, log)
        path, base = (
            str(recipe.path),
            bench_sample.bench_scene(grains, threads=1, precision=PRECISION),
        )
    else:
        grains, (base, parts) = method.find_method(scene).preview(scene).size, parts_of(scene)
    steps = steps or max(LEAST_STEPS, GRAIN_STEPS // grains)
    rows, notes = [], [*_notes(scene, grains, rounds)]
    table = Table(machine(), rows, [("What each part costs", *_columns(per))], notes)
    try:
        for number, part in enumerate(parts, start=1):
            against = f" against {part.instead}" if part.instead else ""
            log(f"{number} of {len(parts)}: {part.name}{against}")
            try:
                rows.append(measure_pair(part, base, path, steps=steps, rounds=rounds))
            except DustError as error:
                reason = " ".join(str(error).split())
                notes.append(f"{part.name}{against}: refused: {reason}")
            if out is not None:
                table.to_csv(out)
    except KeyboardInterrupt:
        notes.append(f"Interrupted after {len(rows)} of {len(parts)} parts.")
    return table


def _notes(scene, grains, rounds):
    per = "per contact of two grains" if scene is None else "per step"
    return (
        "Time: contacts, grains, walls, search at its rate, ledger every 1000 steps, one thread; "
        f"{per}; medians of {rounds} rounds, in each of which both are timed. "
        "Scatter: half of the range of the middle half of the rounds.",
        f"Scene: {grains} grains, filling factor {FILLING_FACTOR:g}, silicate, rolling 8, sliding "
        "2.5, viscous damping, box with its top wall at 1 cm/s; grains start at 1 cm/s rms."
        if scene is None
        else f"Scene: {scene.name}, {grains} grains, at its start, walls and faces at rest.",
    )


def variant(scene, changes):
    """Arguments of task.Benchmark.build for the scene with the changes of a Part."""
    built = {name: value for name, value in changes.items() if name in BUILT}
    keys = {path: value for path, value in changes.items() if path not in BUILT}
    return {"scene": scene.with_values(keys).to_yaml(), **built}


def measure_pair(part, scene, path, *, steps, rounds) -> dict:
    """Row of a Part: both variants in processes of their own, timed in turn; which is first
    changes.

    path: file of the sample; None where the scene has its own, and then times are of a step in
    place of over the number of contacts. ratio: without over with, median of the rounds; scatter:
    half of the range that holds the middle half of them. share: cost of the part, of the time with
    it [%].
    """
    with Timed(bench_sample.TASK) as with_part, Timed(bench_sample.TASK) as without_part:
        for process, changes in ((with_part, part.with_part), (without_part, part.without_part)):
            process.call("build", path=path, **variant(scene, changes))
            process.call("time", steps=max(steps // 5, 1))  # kernels loaded, grains warm
        times_by_process = {with_part: [], without_part: []}
        for number in range(rounds):
            for process in (
                (with_part, without_part) if number % 2 == 0 else (without_part, with_part)
            ):
                timing = process.call("time", steps=steps)
                over = 1 if path is None else timing["contacts"]
                if not over:
                    raise DustError("there are no contacts to take the time by")
                times_by_process[process].append(1e9 * timing["seconds"] / over)
    times_with, times_without = times_by_process.values()
    ratios = [b / a for a, b in zip(times_with, times_without, strict=True)]
    low, _, high = statistics.quantiles(ratios, n=4) if rounds > 1 else [math.nan] * 3
    ratio = statistics.median(ratios)
    return {
        "part": part.name,
        "instead": part.instead,
        "has": statistics.median(times_with),
        "lacks": statistics.median(times_without),
        "ratio": ratio,
        "scatter": 0.5 * (high - low),
        "share": 100.0 * (1.0 - ratio),
    }
