"""Runs that cost nothing: the spring of tests/run/spring.py, with and without stages."""

import spring

from dusttaichi import method
from dusttaichi.results import pieces, writer
from dusttaichi.run import execute, loop
from dusttaichi.scene import from_yaml

PLAIN = """
name: spring
method: spring
stiffness: 4.0
boundary: {kind: open}
stop: {steps: 200}
numerics: {time_step: 10 ns}
output: {series: {steps: 5}, snapshots: {steps: 20}, checkpoint: 1 us}
"""
STAGED = """
name: spring
method: spring
boundary: {kind: open}
stages:
  - {name: swing, stop: {time: 1 us}}
  - {name: on, stop: {steps: 100}, output: {series: {time: 0.1 us}}}
numerics: {time_step: 10 ns}
output: {series: {steps: 10}, snapshots: {steps: 20}, checkpoint: 1 us}
"""
SCENES = {"plain": PLAIN, "staged": STAGED}


def prepare():
    """The method is known, and the run looks at the clock every twenty steps."""
    method.register(spring.METHOD)
    loop.BURST_SECONDS = 0.0


def with_parts(small):
    """Whether a result has many parts, or is one file throughout."""
    writer.PIECE = 30_000 if small else 10**9


JOIN = pieces.join


def join_here(here=True):
    """Parts are joined in this process, not in one of its own: a second less each time."""
    pieces.join = (lambda path, lock=None: pieces._put_together(path)) if here else JOIN


def go(name, directory, **how):
    """Run one of the scenes into a directory."""
    return execute(from_yaml(SCENES[name]), directory, **how)
