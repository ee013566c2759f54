"""What writing costs at 100 000 grains and 240 000 contacts: flushes, checkpoints, the joining.

    python tests/torture/writing.py --frames 20

Processor time, that of the joining process included, and the steps of a lattice of as many grains
and contacts between the frames, so that a busy machine slows down both alike. A frame every 1000
steps is flushed by itself, which is the dearest way, and a checkpoint comes with every sixth.
"""

import argparse
import os
import resource
import sys
import tempfile
from pathlib import Path

import numpy as np

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE.parent), str(HERE.parents[1])]
os.environ["PYTHONPATH"] = os.pathsep.join([str(HERE.parents[1]), os.environ.get("PYTHONPATH", "")])

import synthetic  # noqa: E402

from dusttaichi.run import checkpoint  # noqa: E402

GRAINS, CONTACTS = 100_000, 240_000
BETWEEN = 40  # steps between two frames
STEPS = """
name: steps
material: silicate_s12
sample: {kind: lattice, structure: sc, grains: 100000}
boundary: {kind: open}
stop: {steps: 100000}
numerics: {threads: 1}
output: {series: {steps: 1000}}
"""


def spent():
    """Processor time of this process and of those that it has waited for [s]."""
    own, others = (
        resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)
    )
    return own.ru_utime + own.ru_stime + others.ru_utime + others.ru_stime


def cost_of(what, *arguments):
    """Processor time of a call [s]."""
    before = spent()
    what(*arguments)
    return spent() - before


def frame(step, rng):
    """The records of a snapshot, whose numbers are as hard to compress as those of a run."""
    records = synthetic.snapshot_records(step, GRAINS, CONTACTS)
    for group in records.values():
        for name, values in group.items():
            if getattr(values, "size", 0) > 100 and values.dtype.kind == "f":
                group[name] = rng.standard_normal(values.shape)
    return records


def lattice():
    """A simulation of so many grains, compiled."""
    from dusttaichi.method import make_sample, of
    from dusttaichi.scene import from_yaml

    scene = from_yaml(STEPS)
    sim = of(scene).build(scene, make_sample(scene))
    sim.advance(BETWEEN)
    return sim


def measured(frames, folder):
    """Medians of (flush of a frame, state of a checkpoint, joining of a frame, 1000 steps) [s],
    and bytes of a frame."""
    rng, sim = np.random.default_rng(1), lattice()
    flushes, states, steps = [], [], []
    state = {name: rng.standard_normal((GRAINS, 3)) for name in "xvwqab"}
    state |= {"history": rng.standard_normal((CONTACTS, 8))}
    path = folder / "result.nc"
    with synthetic.writer(path, GRAINS) as writer:
        for step in range(frames):
            steps.append(1000 / BETWEEN * cost_of(sim.advance, BETWEEN))
            writer.append("series", synthetic.series_record(step))
            for group, record in frame(step, rng).items():
                writer.append(group, record)
            flushes.append(cost_of(writer.flush))
            states.append(cost_of(checkpoint.save, folder / "checkpoint.bin", state, {}))
        size = sum(part.stat().st_size for part in (folder / "result.parts").iterdir()) / frames
        joining = cost_of(writer.join) / frames
    return np.median(flushes), np.median(states), joining, np.median(steps), size


def main():
    """Entry point."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--frames", type=int, default=20)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        flush, state, joining, step, size = measured(given.frames, Path(folder))
    print(f"a frame: {size / 1e6:.0f} MB; flush {flush:.3f} s, joining {joining:.3f} s a frame")
    print(f"state of a checkpoint: {state:.3f} s, at every sixth frame")
    shares = [100 * cost / step for cost in (flush + state / 6, flush + joining + state / 6)]
    print(f"1000 steps: {step:.2f} s; writing takes {shares[0]:.1f} % of that, {shares[1]:.1f} %")
    print("with the joining")


if __name__ == "__main__":
    main()
