"""Collisions a second against the number side by side (`python -m benchmarks collisions`).

One process, and two at the same time as `dust collide` has on two cores, make the same collisions,
whose samples are made before the clock starts; in turn with them each advances one large collision
of as many grains, as many steps from its start on. Contacts form under compression, and the time of
a step follows them: both are compared by grain and by contact. Processor time, which other programs
affect less than wall time.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack

from benchmarks.table import Column, Table, check_file
from dusttaichi.errors import DustError
from dusttaichi.studies.machine_speed import Timed, machine

TASK = "benchmarks.collisions:answer"
SCENE = """
name: collisions
material: ice_t19
interaction: {{damping: {{model: scaled, coefficient: 0.01}}}}
sample:
  kind: collision
  target: {{kind: pca, grains: {grains}, seed: 1}}
  projectile: {{kind: pca, grains: {grains}, seed: 1001}}
  speed: 30 m/s
boundary: {{kind: open}}
stop: {{time: 0.1 us}}
numerics: {{threads: 1}}
"""
SIZES = (16, 64, 500)  # grains of a body
QUICK = (16,)
PROCESSES = (1, 2)
ABREAST = (1, 10, 100)
MOST = 20_000  # grains side by side
LEAST = 5  # collisions that are timed
SAMPLED = 100  # steps between two counts of the contacts of a large collision
FRONT = (Column("grains", "grains of both"), Column("processes", "processes"))
NUMBERS = (
    Column("abreast", "side by side"),
    Column("rate", "collisions a second of processor time", "1/s", 1),
    Column("gain", "over one by one", "1", 2),
    Column("step", "step of a grain", "ns", 0),
    Column("large", "in one large collision", "ns", 0),
    Column("efficiency", "efficiency", "1", 2),
    Column("contacts", "contacts of a grain", "1", 2),
    Column("large_contacts", "in one large collision", "1", 2),
    Column("by_contact", "efficiency by contact", "1", 2),
)
NOTE = (
    "Of collisions that touch head-on, without their samples; of two processes the sum of both. "
    "Least time of the repetitions. The large collision has as many grains as those side by side "
    "and makes as many steps; the efficiency is its time for the step of a grain over theirs, by "
    "contact that for the step of a contact. Contacts of a grain: mean over the steps."
)


def main(*, out=None, quick=False, repetitions=3, log=print) -> Table:
    """Measure every number side by side of every size; out: CSV file. log: called with lines."""
    check_file(out)
    rows, table = [], None
    for grains in QUICK if quick else SIZES:
        for processes in PROCESSES:
            one_by_one = None
            for abreast, least in _measure(grains, processes, repetitions, log).items():
                rate = sum(count / seconds for count, seconds, *_ in least)
                one_by_one = one_by_one or rate
                step, contacts, large, large_contacts = (
                    sum(n[k] for n in least) / processes for k in range(2, 6)
                )
                row = {"grains": 2 * grains, "processes": processes, "abreast": abreast}
                row |= {"rate": rate, "gain": rate / one_by_one, "step": step * 1e9}
                row |= {"large": large * 1e9, "efficiency": large / step, "contacts": contacts}
                by_contact = (large / large_contacts) / (step / contacts)
                rows.append(row | {"large_contacts": large_contacts, "by_contact": by_contact})
            table = Table(machine(), rows, (("Collisions side by side", FRONT, NUMBERS),), (NOTE,))
            if out is not None:
                table.to_csv(out)
    return table


def _measure(grains, processes, repetitions, log):
    """Number side by side -> of each process collisions, seconds, and numbers of a grain.

    The latter are time of a step [s] and contacts, side by side and in a large collision; the least
    of the repetitions.
    """
    times = {min(number, MOST // (2 * grains)): [] for number in ABREAST}
    with ExitStack() as stack:
        batches, large = (
            [stack.enter_context(Timed(TASK)) for _ in range(processes)] for _ in range(2)
        )
        pool = stack.enter_context(ThreadPoolExecutor(processes))

        def ask(timed, do, **arguments):
            return list(pool.map(lambda process: process.call(do, **arguments), timed))

        ask(batches, "prepare", grains=grains, count=max(LEAST, *times))
        for number in times:  # kernels
            ask(batches, "make", abreast=number, count=number)
        for _ in range(repetitions):
            for number in times:
                answers = ask(batches, "make", abreast=number, count=max(LEAST, number))
                steps = round(answers[0]["steps"])
                large_answers = ask(large, "advance", grains=grains * number, steps=steps)
                times[number].append(
                    [
                        (a["seconds"], *(n[key] for n in (a, b) for key in ("step", "contacts")))
                        for a, b in zip(answers, large_answers, strict=True)
                    ]
                )
                log(f"{2 * grains} grains, {number} side by side: {times[number][-1]}")
    return {
        number: [
            (max(LEAST, number), *(min(values) for values in zip(*process, strict=True)))
            for process in zip(*rounds, strict=True)
        ]
        for number, rounds in times.items()
    }


PREPARED: list = []
LARGE_SAMPLES: dict = {}  # grains of a body -> scene, sample


def answer(parent, *, do, **arguments):
    """Task of the process: `prepare` collisions, `make` some, or `advance` a large one."""
    return {"prepare": _prepare, "make": _make, "advance": _advance}[do](**arguments)


def _prepare(grains, count):
    from dusttaichi import samples
    from dusttaichi.scene import from_yaml
    from dusttaichi.studies.collide_course import Collision

    class CountedCollision(Collision):
        """A collision with the sum of its contacts over its steps."""

        def begin(self, look):
            self.contact_steps, self.counted_until = 0, 0
            super().begin(look)

        def resume(self, look):
            steps, self.counted_until = self.step - self.counted_until, self.step
            self.contact_steps += self.measurement.parts["contacts"] * steps
            return super().resume(look)

    base = from_yaml(SCENE.format(grains=grains))
    for number in range(count):
        seeds = {"sample.target.seed": 1 + number, "sample.projectile.seed": 1001 + number}
        scene = base.with_values(seeds)
        PREPARED.append(CountedCollision(number, scene, samples.make(scene)))


def _make(abreast, count):
    import time

    from dusttaichi.studies.collide_batch import make_collisions

    errors, began = [], time.process_time()
    make_collisions(
        PREPARED[:count],
        lambda label, row, *error: errors.extend(error),
        **{"abreast": abreast, "room": 10**9},
    )
    seconds = time.process_time() - began
    if errors:
        raise DustError(str(errors[0]))
    made = PREPARED[:count]
    steps = sum(collision.counted_until * len(collision.sample) for collision in made)
    contacts = sum(collision.contact_steps for collision in made) / steps
    mean_steps = sum(collision.counted_until for collision in made) / count
    return {"seconds": seconds, "step": seconds / steps, "steps": mean_steps, "contacts": contacts}


def _advance(grains, steps):
    import time

    from dusttaichi import samples
    from dusttaichi.grains.build import make
    from dusttaichi.scene import from_yaml

    if grains not in LARGE_SAMPLES:
        scene = from_yaml(SCENE.format(grains=grains))
        LARGE_SAMPLES[grains] = scene, samples.make(scene)
    engine, seconds, contact_steps = make(*LARGE_SAMPLES[grains]), 0.0, 0
    while engine.step < steps:
        chunk, began = min(SAMPLED, steps - engine.step), time.process_time()
        engine.advance(chunk)
        seconds += time.process_time() - began
        contact_steps += engine.measure().parts["contacts"] * chunk
    return {"step": seconds / steps / engine.size, "contacts": contact_steps / steps / engine.size}
