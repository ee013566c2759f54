"""The quick part of the tortures; `python tests/torture KIND` does the rest."""

import sys
from pathlib import Path

from tally import Tally

sys.path[:0] = [str(Path(__file__).parents[1] / "running")]


def test_mutated_scenes():
    import mutate

    mutate.run(40, 7, tally := Tally())
    assert not tally.failures


def test_damaged_files(toys):
    import damage

    damage.run(10, 7, tally := Tally())
    assert not tally.failures
