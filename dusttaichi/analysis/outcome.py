"""Outcome of a collision, in the terms of the field (Güttler 2010, Wada 2013).

Target and projectile are the heavier and the lighter body, f = (M_largest - M_target)/M_projectile
the growth efficiency. `DEFINITIONS` has the outcomes of bodies that have touched; bodies that have
not are "not met yet", or "passed by", where each moves on as a fragment of its own.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dusttaichi.analysis.fragments import compute_growth_efficiency, find_fragments
from dusttaichi.analysis.frame import read_grain_masses
from dusttaichi.analysis.restitution import UNTOUCHED, compute_relative_motion
from dusttaichi.physics.geometry import are_in_same_fragment

if TYPE_CHECKING:
    from dusttaichi.analysis.fragments import Bodies, Body, FragmentMasses, Fragments
    from dusttaichi.analysis.run import Run


WHOLE = 0.95  #: Share of the mass of a body from which it counts as whole.
HALF = 0.5  #: Share of the target's mass below which the largest fragment means fragmentation.
PAGE = "docs/studies/outcomes.md"  #: Page that defines outcomes and threshold speeds.
DEFINITIONS = {
    "sticking": "a single fragment remains",
    "growth": "a fragment has over half of each body's mass and is heavier than the target, f > 0",
    "mass transfer": "no fragment has over half of each body's mass, it is not bouncing, and the "
    "largest fragment is heavier than the target, f > 0",
    "bouncing": "no fragment has over half of each body's mass, and each body keeps at least "
    f"{WHOLE:.0%} of its mass in a fragment of at most 1/{WHOLE:g} of it",
    "erosion": "neither bouncing nor f > 0: the largest fragment has at least "
    f"{HALF:.0%} of the target's mass",
    "fragmentation": f"the same with less than {HALF:.0%} of the target's mass",
}
"""Outcome of two bodies that have touched -> its definition."""
DEFINED = {"outcome", "growth efficiency"}  # headings of columns that the page defines

NOT_MET, PASSED = "not met yet", "passed by"


def format_definition_line(headings: Iterable[str]) -> str:
    """Line that links a table to the definitions, "" for one without a column of DEFINED."""
    names = [name for name in headings if name in DEFINED]
    return f"{' and '.join(names)}: defined in {PAGE}" if names else ""


def determine_outcome(run: Run, fragments: Fragments, bodies: Bodies) -> str:
    """Name of the outcome, of the Fragments of the last snapshot and two bodies (grain numbers)."""
    masses = read_grain_masses(run)
    return explain_missing_contact(run, fragments, bodies, masses) or classify_outcome(
        fragments, masses, bodies
    )


def classify_outcome(fragments: FragmentMasses, masses: NDArray[np.float64], bodies: Bodies) -> str:
    """Name of the outcome of two bodies (grain numbers) that have touched.

    fragments: those afterwards. masses: of the grains [kg], (N,).
    """
    if len(fragments) == 1:
        return "sticking"
    target = max(masses[body].sum() for body in bodies)
    grown = compute_growth_efficiency(fragments, masses, bodies) > 0.0
    if are_in_same_fragment(fragments.label, masses, bodies):
        return "growth" if grown else _name_erosion(fragments, target)
    if all(_is_intact(fragments, masses, body) for body in bodies):
        return "bouncing"
    return "mass transfer" if grown else _name_erosion(fragments, target)


def explain_missing_contact(
    run: Run, fragments: Fragments, bodies: Bodies, masses: NDArray[np.float64]
) -> str:
    """NOT_MET or PASSED for bodies that have not touched until the last snapshot, else ""."""
    if len(fragments) != 2 or are_in_same_fragment(fragments.label, masses, bodies):
        return ""
    start, end = (
        compute_relative_motion(run, 0, bodies, masses),
        compute_relative_motion(run, -1, bodies, masses),
    )
    if not np.linalg.norm(end[1] - start[1]) <= UNTOUCHED * np.linalg.norm(start[1]):
        return ""
    return NOT_MET if end[0] @ end[1] < 0.0 else PASSED


def has_settled(run: Run) -> bool:
    """True where the last two snapshots have the same fragments, by number and largest mass."""
    if run.snapshot_count < 3:  # too few to compare
        return True
    last, previous = find_fragments(run, -1), find_fragments(run, -2)
    return len(last) == len(previous) and bool(
        np.isclose(last.mass[0], previous.mass[0], rtol=1e-6, atol=0.0)
    )


def _name_erosion(fragments: FragmentMasses, target: float) -> str:
    return "erosion" if fragments.mass[0] >= HALF * target else "fragmentation"


def _is_intact(fragments: FragmentMasses, masses: NDArray[np.float64], body: Body) -> bool:
    """True where a body is a separate fragment that has lost and gained little mass."""
    body_mass_by_fragment = np.bincount(
        fragments.label[body], masses[body], minlength=len(fragments)
    )
    largest, mass = int(np.argmax(body_mass_by_fragment)), masses[body].sum()
    is_kept = body_mass_by_fragment[largest] >= WHOLE * mass
    return bool(is_kept and fragments.mass[largest] <= mass / WHOLE)
