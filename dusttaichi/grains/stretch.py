"""What is measured of a stretch of a trajectory, to be compared with the same at another step."""

import numpy as np

from dusttaichi import geometry, units
from dusttaichi.grains import record
from dusttaichi.names import AXES, WALLS

LOOKS = 20  # at what is averaged over the moments of a stretch
TOP = WALLS.index("top")


def measure_stretch(sim, steps, finer, plates, advance):
    """Advance `sim` by `steps` times `finer` steps; returns name -> number [SI], see
    analysis.error_bar.QUANTITIES.

    Forces are averaged over all steps, energies and counts over LOOKS moments, which are the same
    for any `finer`. plates: record.Plates or None. advance: called with numbers of steps.
    """
    before, at_first = _moment(sim, plates), sim.measure()
    moments, m, done = [], at_first, 0
    for step in np.unique(np.linspace(0, steps, LOOKS + 1).round().astype(int))[1:]:
        advance(int(step - done) * finer)
        done = int(step)
        m = sim.measure()
        moments.append((m["kinetic_translation"] + m["kinetic_rotation"], m["contacts"]))
    kinetic, contacts = np.mean(moments, axis=0)
    span = steps * finer * sim.dt
    values = {
        "kinetic_energy": kinetic * units.ENERGY,
        "coordination_number": 2.0 * contacts / sim.grains,
    }
    return (
        values
        | _energies(sim, at_first, m)
        | _forces(sim, before, _moment(sim, plates), span, plates)
    )


def _energies(sim, first, last):
    """What has been lost, done and left over in the stretch."""
    lost = {
        name: last["loss"][n] + last["loss_wall"][n] - first["loss"][n] - first["loss_wall"][n]
        for n, name in enumerate(sim.layout.channels)
    }
    works = ("wall_work", "face_work", "push_work")
    work, losses = sum(last[name] - first[name] for name in works), sum(lost.values())
    from_zero = {
        "loss": np.array([losses]),
        "loss_wall": np.zeros(1),
        "wall_work": work,
        "face_work": 0.0,
        "push_work": 0.0,
    }
    _, relative = record.ledger(last | from_zero, first)
    out = {f"loss_{name}": value * units.ENERGY for name, value in lost.items()}
    out["losses"] = losses * units.ENERGY
    out["energy_end"] = record.total_energy(last) * units.ENERGY
    out["residual"] = relative
    if sim.box is not None or sim.cell is not None or sim.push.works:
        out["work"] = work * units.ENERGY
    return out


def _moment(sim, plates):
    """What averages over a stretch are taken from, at one end of it."""
    out = {"lengths": sim.lengths()}
    if sim.box is not None:
        out |= {
            "force": sim._wall_force(),
            "impulse": sim.impulses(),
            "areas": record.wall_areas(sim),
        }
    if plates is not None:
        out["shadow"] = geometry.union_area(sim.grain_state()[0][:, :2], sim.radii)
    if sim.layout.stress:
        out["flux"] = sim.momentum_flux()
    return out


def _forces(sim, before, after, span, plates):
    out = {}
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
        mean = record.stress(sim, before["flux"], span, before["lengths"], after["lengths"])
        for n, axis in enumerate(AXES):
            out[f"stress_{axis}{axis}"] = mean[n, n] * units.PRESSURE
    return out
