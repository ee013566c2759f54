"""A real GPU beside the CPU of its machine: `python tests/gpu/card.py WHAT... [FILE]`.

results: every case of cases.py in a process of its own, against the CPU and twice, and the stored
states. grains, continuum: seconds of a step of both, with what their first step takes. Prints
lines; writes all of it as JSON to FILE.
"""

import json
import os
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import cases
import numpy as np
import stored_states

from benchmarks import continuum
from benchmarks import sample as bench
from dusttaichi import method, samples

DENSE = 0.35  # filling factor of the sample that is repeated
GRAINS = (1_000, 11_000, 100_000, 1_000_000)
CONTINUUM = ((2, 40_000), (3, 28_000), (3, 500_000))  # dimension, particles
SPAN = 2.0  # s, of a measurement
CHILDREN = 6  # processes that use the card at once


# -- in a process of its own -----------------------------------------------------------------------


def result(name):
    """How a case differs from the CPU, and whether a second run repeats its bits."""
    began = time.perf_counter()
    first, searches = cases.run(name, "cuda")
    numbers, took = cases.numbers(first), time.perf_counter() - began
    repeated_numbers = cases.numbers(cases.run(name, "cuda")[0])
    expected, allowed, expected_searches = cases.compute_expected(name)
    deviations = {
        key: float(np.abs(numbers[key] - a).max(initial=0.0) / (allowed[key] + 1e-300))
        for key, a in expected.items()
    }
    worst = max(deviations, key=deviations.get)
    return {
        "name": name,
        "share": deviations[worst],
        "worst": worst,
        "searches": [searches, expected_searches],
        "repeats": all(
            np.array_equal(a, repeated_numbers[key], equal_nan=True) for key, a in numbers.items()
        ),
        "first": took,
    }


def compare_stored(name):
    """How a stored state differs."""
    engine, _ = stored_states.move_scene(stored_states.scene(name, "cuda"))
    difference = stored_states.difference(
        stored_states.state(engine), stored_states.read_stored()[name]
    )
    allowed = stored_states.tolerance(name)
    return {"name": f"stored: {name}", "share": difference / allowed, "worst": "state"}


def _grains(number, precision, backend, threads):
    """Motion of copies of the dense sample."""
    scene = bench.bench_scene(number, threads=threads, precision=precision)
    scene = scene.with_value("numerics.backend", backend)
    positions = bench.tile_sample(bench.Recipe(number, DENSE))
    return method.find_method(scene).build(scene, samples.Sample.at_rest(positions))


def _continuum(dimension, number, backend, threads):
    scene = continuum.scene_of(dimension, number, threads).with_value("numerics.backend", backend)
    return method.find_method(scene).build(scene, method.make_sample(scene))


def time_steps(scene_kind, number, detail, backend, threads):
    """Seconds of a step of a scene, of its start, and its search."""
    number, threads = int(number), int(threads)
    began = time.perf_counter()
    if scene_kind == "grains":
        engine = _grains(number, detail, backend, threads)
    else:
        engine = _continuum(int(detail), number, backend, threads)
    steps = _count_made(engine, 1)
    first = time.perf_counter() - began
    searches_before = engine.search.count
    span, steps_made, calls = 0.0, 0, 1
    while span < SPAN:
        began = time.perf_counter()
        steps = _count_made(engine, calls)
        duration = time.perf_counter() - began
        # the first calls compile what a search needs
        span, steps_made = (span + duration, steps_made + steps) if calls > 1 else (0.0, 0)
        searches_before = searches_before if calls > 1 else engine.search.count
        calls = max(2, round(calls * min(10.0, 0.25 * SPAN / duration)))
    phases = engine.measure().parts
    return {
        "kind": scene_kind,
        "size": engine.size,
        "detail": detail,
        "backend": backend,
        "threads": threads,
        "contacts": phases.get("contacts"),
        "first": first,
        "step": span / steps_made,
        "searches": (engine.search.count - searches_before) / steps_made,
    }


def _count_made(engine, calls):
    """Steps that some calls have made."""
    steps_before = cases._steps(engine)
    engine.advance(calls)
    return cases._steps(engine) - steps_before


# -- here ------------------------------------------------------------------------------------------


def _child(task, *arguments):
    command = [sys.executable, __file__, "child", task, *map(str, arguments)]
    root = Path(__file__).parents[2]
    path = f"{root}:{os.environ.get('PYTHONPATH', '')}"
    ran = subprocess.run(
        command, env=os.environ | {"PYTHONPATH": path}, capture_output=True, text=True
    )
    if ran.returncode:
        return {"name": " ".join(map(str, arguments)), "error": (ran.stdout + ran.stderr)[-3000:]}
    return json.loads(ran.stdout.splitlines()[-1])


def results():
    """Rows of all cases and stored states."""
    tasks = [("result", name) for name in cases.NAMES]
    tasks += [("stored", name) for name in stored_states.CHANGES]
    with ThreadPoolExecutor(CHILDREN) as pool:
        rows = list(pool.map(lambda task: _child(*task), tasks))
    for row in rows:
        if "error" in row:
            print(f"{row['name']}: FAILED\n{row['error']}", flush=True)
            continue
        verdict = "agrees" if row["share"] <= 1.0 else "DIFFERS"
        remark = "" if row.get("repeats", True) else "; a second run has OTHER BITS"
        print(
            f"{row['name']}: {verdict}, {row['share']:.2g} of the tolerance ({row['worst']})"
            f"{remark}",
            flush=True,
        )
    return rows


def speed(scenes):
    """Rows of the seconds of a step on the card, on one thread and on all."""
    cores = len(os.sched_getaffinity(0))
    devices, rows = [("cuda", 1), ("cpu", 1), ("cpu", cores)], []
    for scene_kind, number, detail in scenes:
        for backend, threads in devices:
            if backend == "cpu" and threads == 1 and number > 100_000:
                continue
            rows.append(_child("timed", scene_kind, number, detail, backend, threads))
            row = rows[-1]
            if "error" in row:
                print(f"{row['name']}: FAILED\n{row['error']}", flush=True)
                continue
            print(
                f"{scene_kind} {detail} {row['size']} {backend} {threads}: "
                f"{1e6 * row['step']:.1f} us a step, "
                f"{row['size'] / row['step']:.3g} particle-steps a second, "
                f"{row['searches']:.2g} searches a step; first step {row['first']:.1f} s",
                flush=True,
            )
    return rows


def main(*arguments):
    if arguments and arguments[0] == "child":
        run = {"result": result, "stored": compare_stored, "timed": time_steps}[arguments[1]]
        print(json.dumps(run(*arguments[2:])))
        return
    actions = {
        "results": results,
        "grains": lambda: speed([("grains", n, p) for n in GRAINS for p in ("mixed", "f64")]),
        "continuum": lambda: speed([("continuum", n, d) for d, n in CONTINUUM]),
    }
    out = {name: make() for name, make in actions.items() if name in arguments}
    if arguments and arguments[-1].endswith(".json"):
        Path(arguments[-1]).write_text(json.dumps(out, indent=1), encoding="utf-8")


if __name__ == "__main__":
    main(*sys.argv[1:])
