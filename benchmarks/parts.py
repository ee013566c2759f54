"""Cost of each part of a scene of grains (`python -m benchmarks parts [FILE]`).

Pairs of scenes, one with the part and one without it, run the same steps with the same grains in
two processes, which are timed in turn, round after round. The result is the median of the ratios of
a round, with their scatter.
"""

import math
import statistics
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import yaml

from benchmarks import sample as bench_sample
from benchmarks.table import Column, RowTable, digits
from benchmarks.timing import TASK, check_file, prepare, seconds_a_step
from dusttaichi import method
from dusttaichi.errors import DustError
from dusttaichi.physics.contact import registry
from dusttaichi.scene.drive import SPEEDS
from dusttaichi.scene.grains import GrainsScene
from dusttaichi.scene.numerics import PRESETS
from dusttaichi.studies.bench import Timed, machine

GRAINS, QUICK_GRAINS = 11_000, 1_000
FILLING_FACTOR = 0.35
ROUNDS, QUICK_ROUNDS = 31, 15
# of a measurement, a twelfth of a second: other load of the machine changes more slowly
GRAIN_STEPS = 1_000_000
LEAST_STEPS = 100


@dataclass(frozen=True)
class Variant:
    """A scene: changes of that of the benchmark; built: arguments of task.Benchmark.build_part."""

    settings: dict = field(default_factory=dict)
    built: dict = field(default_factory=dict)
    base: object = None  # a Scene in place of that of the benchmark, with a sample of its own

    def scene(self, grains):
        """The Scene with a sample of `grains` grains."""
        scene = self.base
        if scene is None:
            scene = bench_sample.bench_scene(grains, threads=1, precision=DEFAULT_PRECISION)
        for path, value in self.settings.items():
            scene = scene.with_value(path, value)
        return scene


@dataclass(frozen=True)
class Part:
    """A row of the table: the part `name` is in `has`, `instead` in `lacks`."""

    name: str
    instead: str
    has: Variant
    lacks: Variant


def _off(*effects):
    return {f"interaction.{effect}": "off" for effect in effects}


DEFAULT_PRECISION = PRESETS["balanced"]["precision"]
FULL = Variant()
OPEN = Variant({"boundary": {"kind": "open"}})
_FACES = {"boundary": {"kind": "periodic"}, "output.stress": False}
PERIODIC = Variant(_FACES)
STRESS = Variant({**_FACES, "output.stress": True})
NO_DAMPING = {"interaction.damping": "none"}
PARTS = (
    Part("walls", "open boundary", FULL, OPEN),
    Part("rolling", "off", FULL, Variant(_off("rolling"))),
    Part("sliding", "off", FULL, Variant(_off("sliding"))),
    Part("twisting", "off", FULL, Variant(_off("twisting"))),
    Part("viscous damping", "none", FULL, Variant(NO_DAMPING)),
    Part("viscoelastic damping", "viscous", Variant({"interaction.damping": "viscoelastic"}), FULL),
    Part(
        "rolling, sliding, twisting and damping",
        "adhesion only",
        FULL,
        Variant(_off("rolling", "sliding", "twisting") | NO_DAMPING),
    ),
    Part("asperities", "off", Variant({"interaction.asperities": {"volume": "0.0336 nm"}}), FULL),
    Part("energy ledger", "losses not summed", FULL, Variant(built={"ledger": False})),
    Part("polydisperse grains", "equal grains", Variant(built={"polydisperse": True}), FULL),
    Part("periodic faces", "open boundary", PERIODIC, OPEN),
    Part("stress", "not summed", STRESS, PERIODIC),
    Part("orientations", "not followed", Variant({"output.variables": ["orientation"]}), FULL),
    Part(
        "push with a force",
        "none",
        Variant({**OPEN.settings, "push": [{"face": "top", "force": ["0 N"] * 3}]}),
        OPEN,
    ),
    Part("precision f64", "mixed", Variant({"numerics.precision": "f64"}), FULL),
    Part("precision f32", "mixed", Variant({"numerics.precision": "f32"}), FULL),
    Part("3 Newton steps", "1", Variant({"numerics.newton_steps": 3}), FULL),
    Part("2 Newton steps", "1", Variant({"numerics.newton_steps": 2}), FULL),
    Part("1 Newton step", "none", FULL, Variant({"numerics.newton_steps": 0})),
    Part("nothing (the same scene twice)", "", FULL, FULL),
)


EFFECTS = tuple(kind for kind in registry.EFFECTS if kind not in ("normal", "damping"))
# the measured steps contain no stage and no end
PLAIN = {
    "stages": [],
    "stop": {"steps": 1},
    "output": {"series": {"steps": 1000}, "profiles": "off", "contacts": False},
}


def parts_of(scene) -> list[Part]:
    """Optional parts of a scene, each with the scene without it. Raises DustError."""
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
    base = type(scene).from_dict(data)
    full = Variant(base=base)

    def part(name, settings, **built):
        return Part(name, "", full, Variant(settings, built, base=base))

    found = [
        part(name, {f"interaction.{name}": "off"})
        for name in EFFECTS
        if getattr(scene.interaction, name) is not None
    ]
    if scene.interaction.damping.model != "none":
        found.append(part("damping", {"interaction.damping": "none"}))
    if scene.boundary.kind != "open":
        name = "periodic faces" if scene.boundary.kind == "periodic" else "walls"
        name += " and stress" if stress else ""
        found.append(part(name, {"boundary": {"kind": "open"}, "output.stress": False}))
    if stress:
        found.append(part("stress", {"output.stress": False}))
    if scene.push:
        found.append(part("pushes", {"push": []}))
    found.append(part("energy ledger", {}, ledger=False))
    return [*found, Part("noise: the scene with all", "", full, full)]


@dataclass(frozen=True)
class PartRow:
    """has, lacks: time of a step, of the benchmark's scene over its contacts [ns], medians.

    ratio: lacks over has, median of the rounds; scatter: half of the range that holds the middle
    half of them. share: what the part costs, of the time with it [%].
    """

    name: str
    instead: str
    has: float
    lacks: float
    ratio: float
    scatter: float

    @property
    def part(self):
        """The name, as the heading of its column."""
        return self.name

    @property
    def share(self):
        """Share of the part in the time with it [%]."""
        return 100.0 * (1.0 - self.ratio)


def _columns(per):
    return (
        Column(("part",), "part", words=True),
        Column(("in its", "place"), "instead", words=True),
        Column(("with, ns", per), "has", "ns", digits(1)),
        Column(("without, ns", per), "lacks", "ns", digits(1)),
        Column(("without", "over with"), "ratio", "1", digits(3)),
        Column(("scatter of", "the ratio"), "scatter", "1", digits(3)),
        Column(("cost,", "% of with"), "share", "%", digits(1)),
    )


def main(
    scene=None,
    parts=None,
    *,
    grains: int | None = None,
    steps: int | None = None,
    rounds: int | None = None,
    out: str | Path | None = None,
    quick: bool = False,
    log: Callable[[str], None] = lambda line: None,
) -> RowTable:
    """Measure every part; about ten minutes, `quick` three. Returns a RowTable of PartRows.

    scene: a Scene of grains, timed at its start without each of its parts, half a minute each; by
    default that of the benchmark with the `parts` of PARTS. grains: of the sample of the benchmark,
    11 000, quick 1000. steps: of a measurement. rounds: 31, quick 15. out: CSV file, written after
    every part. log: called with lines on the progress. A part that the build refuses becomes a
    note. Ctrl-C ends the measurement with the parts so far. Raises DustError for a scene without
    known parts.
    """
    rounds = rounds or (QUICK_ROUNDS if quick else ROUNDS)
    if scene is None:
        grains, parts = grains or (QUICK_GRAINS if quick else GRAINS), parts or PARTS
    else:
        grains, parts = method.of(scene).preview(scene).size, parts_of(scene)
    if min(grains, rounds, steps or 1) < 1:
        raise DustError("grains, steps and rounds must be at least 1")
    check_file(out)
    rows, notes, here = [], [], machine()

    def table():
        columns = _columns("a contact" if scene is None else "a step")
        further = (*_notes(scene, grains, rounds), *notes)
        return RowTable(here, further, "What each part costs", columns, tuple(rows))

    try:
        path = None if scene is not None else _prepared(grains, log)
        for number, part in enumerate(parts, start=1):
            against = f" against {part.instead}" if part.instead else ""
            log(f"{number} of {len(parts)}: {part.name}{against}")
            try:
                rows.append(measure_pair(part, grains, path, steps=steps, rounds=rounds))
            except DustError as error:
                reason = " ".join(str(error).split())
                notes.append(f"{part.name}{against}: refused: {reason}")
            if out is not None:
                table().to_csv(out)
    except KeyboardInterrupt:
        notes.append(f"Interrupted after {len(rows)} of {len(parts)} parts.")
    return table()


def _prepared(grains, log):
    """File of the sample of that many grains."""
    recipe = bench_sample.Recipe(grains, FILLING_FACTOR)
    prepare(recipe, log)
    return str(recipe.path)


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


def measure_pair(part, grains, path, *, steps=None, rounds=ROUNDS) -> PartRow:
    """Both variants in processes of their own, timed in turn; which is first changes.

    path: file of the sample of `grains`; None where the scene has its own, and then times are of a
    step in place of over the number of contacts.
    """
    with Timed(TASK) as one, Timed(TASK) as other:
        pair = list(zip((one, other), (part.has, part.lacks), strict=True))
        lengths = []
        for process, variant in pair:
            process.ask(
                "build_part", scene=variant.scene(grains).to_yaml(), path=path, **variant.built
            )
            lengths.append(steps or max(LEAST_STEPS, GRAIN_STEPS // grains))
            process.ask("time", steps=max(lengths[-1] // 5, 1))  # kernels loaded, grains warm
        found = ([], [])
        for number in range(rounds):
            for which in (0, 1) if number % 2 == 0 else (1, 0):
                timing = pair[which][0].ask("time", steps=lengths[which])
                over = 1 if path is None else timing["contacts"]
                if not over:
                    raise DustError("there are no contacts to take the time by")
                found[which].append(1e9 * seconds_a_step(timing) / over)
    ratios = [b / a for a, b in zip(*found, strict=True)]
    low, _, high = statistics.quantiles(ratios, n=4) if rounds > 1 else [math.nan] * 3
    return PartRow(
        name=part.name,
        instead=part.instead,
        has=statistics.median(found[0]),
        lacks=statistics.median(found[1]),
        ratio=statistics.median(ratios),
        scatter=0.5 * (high - low),
    )
