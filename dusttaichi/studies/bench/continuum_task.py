"""What a worker process does for the benchmark of the continuum: it builds a scene and times it."""

import time

import numpy as np

_held = {}


def _neighbours(sim):
    """Neighbours that a particle has within reach of the kernel, on average over those that have
    any (what is rigid or held has none); images beyond faces count."""
    first = sim.lists["first"].to_numpy(sim.n + 1)
    entry = sim.lists["entry"].to_numpy()[: first[-1]]
    x = sim.tables["x"].to_numpy()
    here = np.repeat(x[: sim.n], np.diff(first), axis=0)
    apart = np.linalg.norm(here - x[entry], axis=1)
    some = max(1, np.count_nonzero(np.diff(first)))
    return np.count_nonzero(apart < 2.0 * sim.numbers["h"]) / some


def build(scene):
    """Build a scene (YAML) and make a few steps. Answers particles, neighbours, search [s]."""
    from dusttaichi import method
    from dusttaichi.scene import from_yaml

    scene = from_yaml(scene)
    motion = method.of(scene).build(scene, method.make_sample(scene))
    motion.advance(1)
    began = time.process_time()
    motion.sim.search.now()
    search = time.process_time() - began
    _held["motion"] = motion
    found = {"particles": motion.size, "neighbours": _neighbours(motion.sim)}
    return found | {"search": search}


def timed(steps):
    """Time of real clock and of the processor [s] a step of the method, over whole beats."""
    motion = _held["motion"]
    began, real, used = motion.sim.substeps, time.perf_counter(), time.process_time()
    while motion.sim.substeps - began < steps:
        motion.advance(1)
    done = motion.sim.substeps - began
    return {
        "real": (time.perf_counter() - real) / done,
        "used": (time.process_time() - used) / done,
    }


def answer(parent, *, do, **arguments):
    """The dict that build or timed answers. do: its name."""
    return {"build": build, "timed": timed}[do](**arguments)
