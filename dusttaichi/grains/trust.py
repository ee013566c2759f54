"""Guards: stop a run whose numbers can no longer be trusted, with what, which grain, when, why."""

import numpy as np

from dusttaichi.errors import GuardStop
from dusttaichi.grains.record import total_energy, turnover
from dusttaichi.names import WALLS

LARGEST_OVERLAP = 0.1  # of the radius: JKR is a law for small strains
BETWEEN = 3000, 1_000_000  # steps between two looks: this many, of small samples this many a grain
FIRST = (10, 30, 100, 300, 1000)  # looks after the start: what is unstable shows at once


def next_look(step, first, grains):
    """The next step after `step` at which a run that began at step `first` is looked at.

    Fixed by the scene alone, so that a guard stops a run at the same step on any machine; a look
    costs as much as the steps of some thousand grains.
    """
    every = max(BETWEEN[0], BETWEEN[1] // grains)
    early = [first + n for n in FIRST if first + n > step]
    return min([*early[:1], first + ((step - first) // every + 1) * every])


def check(sim, m, start, tolerance=0.01):
    """Raise GuardStop if the measurement `m` shows a run that has gone wrong.

    start: the measurement at step 0. tolerance: residual of the ledger allowed, a share of the
    energy that has gone through the system or is bound in its contacts.
    """
    when = f"At {sim.time:.6g} us (step {sim.step})"
    if not np.isfinite(total_energy(m)) or not np.isfinite(m["loss"]).all():
        raise GuardStop(
            f"{when} the energy is not a number{_culprit(sim)}: the step is too long for what "
            "happens. Try a smaller numerics.time_step or a lower speed."
        )
    if m["largest_strain"] > LARGEST_OVERLAP:
        raise GuardStop(
            f"{when} a contact{_deepest(sim)} overlaps by {m['largest_strain']:.3g} of the "
            f"(smaller) radius, more than {LARGEST_OVERLAP:g}: adhesive elastic contacts mean "
            "nothing there. Try a lower wall speed, an earlier stop, or a smaller "
            "numerics.time_step."
        )
    _inside(sim, when)
    residual, through = turnover(sim, m, start)
    if abs(residual) > tolerance * through:
        raise GuardStop(
            f"{when} the energy ledger is open by {abs(residual) / through:.2%} of the energy that "
            f"has gone through the system, more than {tolerance:.2%}: the step does not resolve "
            "the motion. Try a smaller numerics.time_step."
        )
    lost = m["loss"] + m["loss_wall"]
    worst = int(np.argmin(lost))
    if lost[worst] < -tolerance * through:
        raise GuardStop(
            f"{when} the losses by {sim.layout.channels[worst]} are negative, "
            f"{-lost[worst] / through:.2%} of the energy that has gone through the system: the "
            "step is so long that it makes energy. Try a smaller numerics.time_step."
        )


def _culprit(sim):
    x, v, _ = sim.grain_state()
    bad = np.flatnonzero(~np.isfinite(x).all(axis=1) | ~np.isfinite(v).all(axis=1))
    return f" (grain {bad[0]} first of {len(bad)})" if len(bad) else ""


def _deepest(sim):
    pairs = sim.contact_state()
    if len(pairs["overlap"]) == 0:
        return " with a wall"
    radii = np.broadcast_to(sim.radii, sim.grains)
    k = int(
        np.argmax(pairs["overlap"] / np.minimum(radii[pairs["grain_i"]], radii[pairs["grain_j"]]))
    )
    return f" (grains {pairs['grain_i'][k]} and {pairs['grain_j'][k]} the deepest)"


def _inside(sim, when):
    if sim.box is None:
        return
    distance = sim.wall_distances()
    distance[:, sim.box.present == 0] = np.inf
    worst = np.unravel_index(np.argmin(distance), distance.shape)
    if distance[worst] < 0.0:
        raise GuardStop(
            f"{when} the centre of grain {worst[0]} has gone through the wall {WALLS[worst[1]]}. "
            "Try a lower speed or a smaller numerics.time_step."
        )
