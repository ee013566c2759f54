"""What is measured of a stretch of a trajectory, to be compared with the same at another step."""

import numpy as np

from dusttaichi import geometry, units
from dusttaichi.grains import record
from dusttaichi.names import AXES, WALLS

TOP = WALLS.index("top")


def ends(sim, plates):
    """What averages over a stretch are taken from, at one end of it, beside the sums."""
    out = {}
    if sim.box is not None:
        out = {"force": sim.wall_forces(), "areas": sim.domain.wall_areas(sim.step)}
    if plates is not None:
        out["shadow"] = geometry.union_area(sim.grain_state()[0][:, :2], sim.radii)
    return out


def compared(sim, window, moments, plates):
    """Name -> number [SI] of a stretch, see analysis.error_bar.QUANTITIES.

    window: Window of sums and ends. moments: Measurements on the way. plates: Plates or None.
    """
    before, after, span = window
    contacts = np.mean([m.parts["contacts"] for m in moments])
    out = {"coordination_number": 2.0 * contacts / sim.grains}
    if sim.box is not None:
        # the force of a step acts half before and half after it
        ends = 0.5 * sim.dt * (before["force"] - after["force"])
        mean = (after["impulse"] - before["impulse"] + ends) / span
        inward = np.sum(mean * sim.box.normal, axis=1)
        wall = TOP if sim.box.present[TOP] else int(np.argmax(sim.box.present))
        areas = 0.5 * (before["areas"] + after["areas"])
        if plates is not None:
            areas[:] = 0.5 * (before["shadow"] + after["shadow"])
            out["filling_factor"] = sim.volume / (after["shadow"] * after["lengths"][2])
        if np.isfinite(areas[wall]):
            out["pressure"] = inward[wall] / areas[wall] * units.PRESSURE
        else:
            out["wall_force"] = inward[wall] * units.FORCE
    if sim.layout.stress:
        mean = record.stress(sim, *window)
        for n, axis in enumerate(AXES):
            out[f"stress_{axis}{axis}"] = mean[n, n] * units.PRESSURE
    return out
