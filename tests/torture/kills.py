"""Kills at random moments of the runs below. Each goes on by --resume until it ends, with
the same bits as a whole.

A run is a process that forks from this one, so that what it imports is there already; a kill is
SIGKILL, SIGTERM or SIGINT. Runs that have come to their end begin anew.
"""

import os
import random
import shutil
import signal
import tempfile
import time
from pathlib import Path

import toy
from bits import assert_same_bits
from tally import fork, run_forked

from dusttaichi.analysis import open_run
from dusttaichi.errors import DustError, Interrupted
from dusttaichi.running import execute
from dusttaichi.scene import from_yaml
from dusttaichi.studies import study_engine as engine
from dusttaichi.studies import sweep_study as sweep

SIGNALS = (signal.SIGKILL, signal.SIGKILL, signal.SIGTERM, signal.SIGINT)


def run(count, seed, tally):
    """So many kills."""
    toy.prepare()
    toy.with_parts(True)
    with tempfile.TemporaryDirectory() as folder:
        for name, fraction in SHARES.items():
            _chains(name, max(1, round(fraction * count)), Path(folder), seed, tally)


def _go(name, directory, options):
    """One run, whole or on from where it is."""
    source = directory.parents[1] / "source"
    if "FILE" in SCENES[name] and not source.exists():
        execute(from_yaml(SOURCE), source)
    scene = from_yaml(SCENES[name].replace("FILE", str(source)))
    try:
        if name == "replicas":
            engine.run(sweep.replicas(scene, directory), **options)
        else:
            execute(scene, directory, **options)
    except DustError as error:
        if "Another run is writing" in str(error):  # the process that joins its parts: a moment
            time.sleep(1.0)
            raise Interrupted("by the joining of parts") from None
        raise


def _chains(name, kills, folder, seed, tally):
    """So many kills of runs of a kind, each chain of them compared with the whole run."""
    uninterrupted, began = folder / name / "whole" / "run", time.monotonic()
    status, output = run_forked(folder / "told", lambda: _go(name, uninterrupted, {}))
    if status:
        raise RuntimeError(f"the whole run of {name} fails: {output}")
    lasts = time.monotonic() - began
    kills_left, chain = kills, 0
    while kills_left > 0:
        chain += 1
        rng = random.Random(f"{seed} {name} {chain}")
        kills_made, problem = _chain(
            name, uninterrupted, folder, limit=kills_left, lasts=lasts, rng=rng
        )
        for kill in range(1, kills_made + 1):
            last = kill == kills_made
            location = f"{name}, chain {chain}, kill {kill}"
            tally.case(name, problem if last else None, location)
        kills_left -= kills_made
        print(f"  {name}: {kills - kills_left} of {kills}", flush=True)


def _chain(name, expected, folder, *, limit, lasts, rng):
    """(kills of one run until its end, what went wrong or None)."""
    directory = folder / name / "chain" / "run"
    kills = 0
    try:
        while True:
            delay = rng.uniform(0.0, 0.6 * lasts) if kills < limit else None
            alone = (lambda: os.setpgid(0, 0), lambda: _go(name, directory, {"resume": True}))
            child = fork(folder / "told", *alone)
            is_done, problem = _end(child, delay, rng.choice(SIGNALS), folder / "told")
            kills += not is_done
            if problem is None and not is_done:
                problem = _unreadable(directory)
            if problem:
                return max(kills, 1), problem
            if is_done:
                _compare(expected, directory, name)
                return kills, None
    except AssertionError as error:
        return max(kills, 1), str(error)
    finally:
        shutil.rmtree(directory.parent, ignore_errors=True)


def _end(child, delay, number, log):
    """(True where the run came to its end, what went wrong or None)."""
    until = time.monotonic() + (1e6 if delay is None else delay)
    while time.monotonic() < until:
        process_id, status = os.waitpid(child, os.WNOHANG)
        if process_id and os.waitstatus_to_exitcode(status) == 130:
            return False, None
        if process_id:
            return True, log.read_text() if os.waitstatus_to_exitcode(status) else None
        time.sleep(0.002)
    os.kill(child, number)
    code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    if code == 0:
        return True, None  # it was at its end already
    return False, None if code in (130, -number) else f"code {code}: {log.read_text()}"


def _unreadable(directory):
    """Why what is on disk after a kill cannot be read, or None."""
    for result in directory.rglob("result.nc"):
        try:
            open_run(result).close()
        except DustError as error:
            return str(error)
    return None


def _compare(expected, directory, name):
    for result in sorted(expected.rglob("result.nc")):
        assert_same_bits(result, directory / result.relative_to(expected))


GRAINS = """
name: grains
material: silicate_s12
interaction: {rolling: on}
sample: {kind: bcca, grains: 64, seed: 2}
boundary: {kind: open}
stop: {steps: 40000}
numerics: {threads: 1}
output: {series: {steps: 500}, snapshots: {steps: 2000}, checkpoint: 0.1 s}
"""
PLAIN = toy.plain(steps=4000, series=50, checkpoint="20 ms")
STAGES = PLAIN.replace(
    "stop: {steps: 4000}",
    """stages:
  - {name: swing, stop: {time: 15 us}}
  - {name: on, stop: {steps: 1250}, output: {series: {time: 1 us}}}
  - {name: rest, stop: {steps: 1250}}""",
)
CONTINUUM = """
name: continuum
method: continuum
dimension: 2
material: dust_g09
sample:
  kind: impact
  target: {kind: block, size: [2 mm, 1 mm]}
  projectile: {kind: rigid, shape: sphere, diameter: 0.6 mm, density: 2540 kg/m^3}
  speed: 0.65 m/s
gravity: 9.81 m/s^2
boundary:
  kind: faces
  bottom: {layer: 0.45 mm}
  x_min: {layer: 0.56 mm}
  x_max: {layer: 0.56 mm}
numerics: {spacing: 0.1 mm, threads: 1}
stop: {steps: 1000}
output: {series: {steps: 50}, snapshots: {steps: 250}, checkpoint: 0.1 s}
"""
# a rigid sphere, with all that a snapshot may hold, in single precision
SPHERE = """
name: sphere
material: silicate_s12
interaction: {rolling: {modifier: 8}, sliding: {modifier: 2.5}, damping: viscoelastic}
sample: {kind: rbd, grains: 60, seed: 3}
sphere: {radius: 3 um, gap: 10 nm, velocity: [0 m/s, 0 m/s, -1 m/s]}
gravity: {acceleration: [0 m/s^2, 0 m/s^2, -1000 m/s^2]}
boundary: {kind: box, omit: [top]}
stop: {steps: 12000}
numerics: {time_step: 0.3 ns, threads: 1, precision: f64}
output:
  series: {steps: 150}
  snapshots: {steps: 600}
  variables: [orientation, loss, grain_loss, sliding_force, rolling_moment, twisting_moment, -spin]
  precision: f32
  checkpoint: 0.1 s
"""
CAKE = """
name: cake
material: silicate_s12
interaction: {rolling: {modifier: 8}, sliding: {modifier: 2.5}, damping: viscoelastic}
sample: {kind: rbd, grains: 60, seed: 3}
boundary: {kind: BOUNDARY}
stop: {steps: 12000}
numerics: {time_step: 0.2 ns, threads: 1}
output: {series: {steps: 150}, snapshots: {steps: 600}, checkpoint: 0.1 s}
"""
# a cell that leans, two of whose axes are held under a stress
LEANING = CAKE.replace(
    "BOUNDARY",
    "periodic, stress: [-20 kPa, -20 kPa, free], strain_rate: [3e4 s^-1, 3e4 s^-1, -5e4 s^-1], "
    "shear_rate: 1e5 s^-1",
)
SOURCE = CAKE.replace("BOUNDARY", "box, wall_speed: 1 m/s").replace("12000", "1200")
# goes on with another run: its walls and their load, its box and its time
KEPT = CAKE.replace("BOUNDARY", "box, pressure: 50 kPa, wall_speed: 1 m/s").replace(
    "{kind: rbd, grains: 60, seed: 3}", "{kind: explicit, file: FILE, keep: [walls, box, time]}"
)
SCENES = {"plain": PLAIN, "stages": STAGES, "replicas": GRAINS + "replicas: 2\n", "grains": GRAINS}
SCENES |= {"continuum": CONTINUUM, "sphere": SPHERE, "leaning cell": LEANING, "kept sample": KEPT}
SHARES = dict.fromkeys(SCENES, 0.1) | {"plain": 0.2, "stages": 0.3}
