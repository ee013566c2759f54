"""What each part of a scene costs: pairs of scenes, one with the part and one without it.

Each pair is the same grains for the same steps, in two processes that are timed in turn, round
after round; the result is the median of the ratios within a round, and their scatter.
"""

import math
import statistics
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from dusttaichi.errors import DustError
from dusttaichi.scene.numerics import PRESETS
from dusttaichi.studies.bench import sample as bench_sample
from dusttaichi.studies.bench.plan import prepare
from dusttaichi.studies.bench.table import Column, Table, csv_text, digits
from dusttaichi.studies.bench.timing import Timed, check_file, machine, seconds_a_step

GRAINS, QUICK_GRAINS = 11_000, 1_000
FILLING_FACTOR = 0.35
FEW, COPIES = 60, 100  # grains of a small scene, and how many of them make a batch
ROUNDS, QUICK_ROUNDS = 31, 15
# of a timed stretch, a twelfth of a second: what else the machine does changes more slowly
GRAIN_STEPS = 1_000_000
LEAST_STEPS = 100


@dataclass(frozen=True)
class Variant:
    """A scene: what is set in that of the benchmark, and how it is built: see
    task.Benchmark.build_part."""

    settings: dict = field(default_factory=dict)
    built: dict = field(default_factory=dict)
    small: bool = False
    base: object = None  # a Scene in place of that of the benchmark, with a sample of its own

    def scene(self, grains):
        """The Scene of a sample of so many grains."""
        scene = self.base
        if scene is None:
            grains = FEW if self.small else grains
            scene = bench_sample.bench_scene(grains, threads=1, precision=DEFAULT_PRECISION)
        for path, value in self.settings.items():
            scene = scene.with_value(path, value)
        return scene


@dataclass(frozen=True)
class Part:
    """A row of the table: `name` is in `has` and not in `lacks`; what the other has instead."""

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
    Part("unlike grains", "all alike", Variant(built={"polydisperse": True}), FULL),
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
    Part(
        f"one scene of {FEW} grains",
        f"{COPIES} of them as a batch",
        Variant(OPEN.settings, small=True),
        Variant(OPEN.settings, {"copies": COPIES}, small=True),
    ),
    Part("nothing (the same scene twice)", "", FULL, FULL),
)


@dataclass(frozen=True)
class PartRow:
    """has, lacks: time a step over the number of contacts between grains [ns], medians.

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
        """What the part costs, of the time with it [%]."""
        return 100.0 * (1.0 - self.ratio)


COLUMNS = (
    Column(("part",), "part", write=str, words=True),
    Column(("in its", "place"), "instead", write=str, words=True),
    Column(("with, ns", "a contact"), "has", "ns", digits(1)),
    Column(("without, ns", "a contact"), "lacks", "ns", digits(1)),
    Column(("without", "over with"), "ratio", "1", digits(3)),
    Column(("scatter of", "the ratio"), "scatter", "1", digits(3)),
    Column(("cost,", "% of with"), "share", "%", digits(1)),
)


@dataclass(frozen=True)
class PartsTable(Table):
    """speed: PartRow each; nothing on start."""

    @property
    def _parts(self):
        return [("What each part costs", COLUMNS, self.speed)]

    def csv(self) -> str:
        """One line a part; machine and notes are lines that begin with #."""
        rows = [
            [
                f"{v:.6g}" if isinstance(v, float) else v
                for v in (getattr(row, c.name) for c in COLUMNS)
            ]
            for row in self.speed
        ]
        return csv_text(self, COLUMNS, rows)


def main(
    grains: int | None = None,
    parts=PARTS,
    steps: int | None = None,
    rounds: int | None = None,
    *,
    out: str | Path | None = None,
    quick: bool = False,
    log: Callable[[str], None] = lambda line: None,
) -> PartsTable:
    """Measure every part; some ten minutes, `quick` three. Returns a PartsTable.

    grains: of the sample, 11 000, quick 1000. steps: of a timed stretch. rounds: 31, quick 15.
    out: CSV file to write, after every part. log: called with a line on what goes on. A part that
    the build refuses becomes a note. Ctrl-C ends the measurement with what there is.
    """
    grains = grains or (QUICK_GRAINS if quick else GRAINS)
    rounds = rounds or (QUICK_ROUNDS if quick else ROUNDS)
    if min(grains, rounds, steps or 1) < 1:
        raise DustError("grains, steps and rounds must be at least 1")
    check_file(out)
    rows, notes, here = [], [], machine()

    def table():
        return PartsTable(tuple(rows), (), here, (*_notes(grains, rounds), *notes))

    try:
        recipes = [bench_sample.Recipe(n, FILLING_FACTOR) for n in (grains, FEW)]
        for recipe in recipes:
            prepare(recipe, log)
        paths = [str(recipe.path) for recipe in recipes]
        for number, part in enumerate(parts, start=1):
            against = f" against {part.instead}" if part.instead else ""
            log(f"{number} of {len(parts)}: {part.name}{against}")
            try:
                rows.append(measure_pair(part, grains, paths, steps=steps, rounds=rounds))
            except DustError as error:
                reason = " ".join(str(error).split())
                notes.append(f"{part.name} against {part.instead}: refused: {reason}")
            if out is not None:
                table().to_csv(out)
    except KeyboardInterrupt:
        notes.append(f"Interrupted after {len(rows)} of {len(parts)} parts.")
    return table()


def _notes(grains, rounds):
    return (
        f"Time: contacts, grains, walls, search at its rate, ledger every 1000 steps, one thread; "
        f"per contact of two grains; medians of {rounds} rounds, in each of which both are timed. "
        "Scatter: half of the range of the middle half of the rounds.",
        f"Scene: {grains} grains, filling factor {FILLING_FACTOR:g}, silicate, rolling 8, sliding "
        "2.5, viscous damping, box with its top wall at 1 cm/s; grains start at 1 cm/s rms.",
    )


def measure_pair(part, grains, paths, *, steps=None, rounds=ROUNDS, per_step=False) -> PartRow:
    """Both variants in processes of their own, timed in turn; which is first changes.

    paths: files of the samples of `grains` and of FEW; None twice where the scene has its own.
    per_step: times in place of times over the number of contacts.
    """
    with Timed() as one, Timed() as other:
        pair = list(zip((one, other), (part.has, part.lacks), strict=True))
        lengths = []
        for process, variant in pair:
            path = paths[variant.small]
            process.ask(
                "build_part", scene=variant.scene(grains).to_yaml(), path=path, **variant.built
            )
            moved = (FEW if variant.small else grains) * variant.built.get("copies", 1)
            lengths.append(steps or max(LEAST_STEPS, GRAIN_STEPS // moved))
            process.ask("time", steps=max(lengths[-1] // 5, 1))  # kernels loaded, grains warm
        found = ([], [])
        for number in range(rounds):
            for which in (0, 1) if number % 2 == 0 else (1, 0):
                timing = pair[which][0].ask("time", steps=lengths[which])
                if not timing["contacts"] and not per_step:
                    raise DustError("there are no contacts to take the time by")
                over = 1 if per_step else timing["contacts"]
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
