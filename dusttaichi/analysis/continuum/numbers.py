"""The few numbers that tell how a run of the continuum went, and their rows of the final table."""

import numpy as np

from dusttaichi.analysis.continuum import laboratory
from dusttaichi.analysis.continuum.filling import axis_profile, compacted, cumulated_volume
from dusttaichi.analysis.continuum.intrusion import intrusion
from dusttaichi.analysis.continuum.particles import read_particles
from dusttaichi.analysis.continuum.pieces import (
    bounce,
    collide,
    pieces,
    velocities_at_start,
)
from dusttaichi.analysis.frame import frame_count
from dusttaichi.analysis.ledger import ledger
from dusttaichi.errors import DustError

NAMES = (
    "particles", "impact_speed", "momentum_per_area", "stopping_time", "depth",
    "stopping_time_weightless", "depth_weightless", "sine_rms", "rebound",
    "stopping_time_law", "depth_law", "bead_filling_factor", "largest_filling_factor",
    "compacted_volume", "compacted_mass", "pieces", "largest_piece", "sticking_mass",
    "dust_restitution", "largest_rebound", "numerical_dissipation",
)  # fmt: skip

NUMERICAL = ("viscosity", "grid", "artificial")
"""Channels of the ledger that are of the method, not of the material."""

UNITS = {
    "impact_speed": "m/s", "momentum_per_area": "kg/(m s)", "stopping_time": "s", "depth": "m",
    "stopping_time_weightless": "s", "depth_weightless": "m", "stopping_time_law": "s",
    "depth_law": "m", "sine_rms": "m", "rebound": "m/s",
}  # fmt: skip
"""Of NAMES; what is not here is a pure number."""


def numbers(run):
    """The numbers of a Run of the continuum as a dict by NAMES (SI; None where it has none).

    impact_speed, momentum_per_area (of a sphere); stopping_time, depth: of the first stop;
    *_weightless: with g t^2 / 2 taken away, beside the laws G09 eqs 12 and 13 of a sphere
    (*_law); sine_rms [m]; rebound [m/s]; bead_filling_factor: median within 0.3 mm below the bead;
    compacted_volume: denser than 0.22, in volumes of the bead. largest_filling_factor,
    compacted_mass (share that is denser than at the start by a twentieth) of any run with
    snapshots. pieces, largest_piece, sticking_mass (shares of the mass), dust_restitution and
    largest_rebound of bodies of dust that fly. numerical_dissipation: share of NUMERICAL in the
    energy lost.
    """
    found = dict.fromkeys(NAMES)
    if not run.is_continuum:
        return found
    found["particles"] = int(run.attrs["particles"])
    shares = ledger(run).shares
    if any(shares.values()):
        found["numerical_dissipation"] = sum(shares.get(channel, 0.0) for channel in NUMERICAL)
    if len(run.series.time) and "largest_filling_factor" in run.series:
        found["largest_filling_factor"] = float(run.series.largest_filling_factor.max())
    if run.tree is None or not _snapshots(run):
        return found
    first, last = read_particles(run, 0), read_particles(run, -1)
    if first.is_dust.any():
        found["compacted_mass"] = compacted(last, first)
    return found | (_impact(run) if run.intrudes else _flight(run))


SETTINGS = {
    "material_p_m": "material.compressive.p_m",
    "shear_exponent": "material.shear.exponent",
    "bulk_modulus": "material.bulk_modulus",
    "spacing": "numerics.spacing",
    "viscosity_contact": "numerics.viscosity.contact",
    "contact": "numerics.contact",
}  # column -> key of the scene


def settings(run):
    """What the scene of a Run of the continuum says of SETTINGS, as it is written, or ""."""
    found = {}
    for name, path in SETTINGS.items():
        here = run.scene
        for key in path.split("."):
            here = here.get(key, "") if isinstance(here, dict) else ""
        found[name] = str(here)
    return found


def _snapshots(run):
    try:
        return frame_count(run)
    except DustError:
        return 0


def _impact(run):
    way = intrusion(run)
    found = {
        "impact_speed": way.speed,
        "momentum_per_area": way.momentum,
        "rebound": way.rebound if way.stop else None,
        "bead_filling_factor": _number(axis_profile(run).nearest),
        "compacted_volume": cumulated_volume(run).above(laboratory.LEAST_COMPARED),
    }
    for name, stop in (("", way.stop), ("_weightless", way.without_gravity)):
        if stop is not None:
            found |= {f"stopping_time{name}": stop.time, f"depth{name}": stop.depth}
    if way.stop is not None:
        found["sine_rms"] = (way.without_gravity or way.stop).rms
    density = way.mass / (np.pi / 4.0 * way.diameter**2)
    mass = way.mass
    if way.dimension == 2:
        mass = laboratory.sphere_mass(way.diameter, density)
    if way.speed > 0.0:
        found["depth_law"] = laboratory.depth(mass, way.speed)
        found["stopping_time_law"] = laboratory.stopping_time(mass, way.speed)
    return found


def _flight(run):
    """Of bodies of dust that fly at a wall or at each other."""
    start = velocities_at_start(run)
    if not any(np.linalg.norm(velocity) > 0.0 for velocity in start.values()):
        return {}
    parts = pieces(run)
    found = {
        "pieces": len(parts.mass),
        "largest_piece": parts.largest_share,
        "sticking_mass": parts.sticking_share if parts.walled else None,
    }
    if len(start) == 1:
        back = bounce(run)
        found |= {"dust_restitution": back.coefficient, "largest_rebound": back.rebound}
    elif len(start) == 2:
        found["dust_restitution"] = collide(run)
    return found


def _number(value):
    return value if np.isfinite(value) else None


def rows(n, row):
    """Add the rows of these numbers to a table; row(what, value, text, laboratory)."""
    if n["particles"] is None:
        return
    row("impact speed", n["impact_speed"], "{:.4g} m/s".format)
    row("momentum over cross-section of a sphere", n["momentum_per_area"], "{:.3g} kg/(m s)".format)
    for key, what, scale, unit, equation in (
        ("stopping_time", "stopping time", 1e3, "ms", 13),
        ("depth", "depth", 1e3, "mm", 12),
    ):
        law, weightless = n[f"{key}_law"], n[f"{key}_weightless"]
        beside = "" if law is None else f"{law * scale:.3g} {unit} (G09 eq {equation})"
        plain = n[key]
        text = (
            "not reached: the run ended before" if plain is None else f"{plain * scale:.3f} {unit}"
        )
        row(what, text if n["impact_speed"] is not None else None, str)
        row(
            "… with g t^2/2 taken away",
            weightless,
            lambda v, scale=scale, unit=unit: f"{v * scale:.3f} {unit}",
            beside,
        )
    row("rms from the sine", n["sine_rms"], lambda v: f"{v * 1e6:.1f} um", "2.5-28 um (G09)")
    row("fastest rebound", n["rebound"], "{:.4f} m/s".format)
    row(
        "filling factor within 0.3 mm below",
        n["bead_filling_factor"],
        "{:.3f}".format,
        f"{laboratory.MOST_FREQUENT} (G09 Fig 11)",
    )
    low, high = laboratory.COMPACTED
    row(
        "volume denser than 0.22, in bead volumes",
        n["compacted_volume"],
        "{:.2f}".format,
        f"{low}-{high} compacted (G09)",
    )
    row("largest filling factor", n["largest_filling_factor"], "{:.3f}".format)
    row("mass compacted by a twentieth or more", n["compacted_mass"], "{:.1%}".format)
    if n["pieces"] is not None:
        share = f"{n['largest_piece']:.1%} of the mass in the largest"
        row("pieces", n["pieces"], lambda v: f"{v}, {share}" if v > 1 else "1")
        row("mass that sticks to a wall", n["sticking_mass"], "{:.1%}".format)
    row("coefficient of restitution", n["dust_restitution"], "{:.4f}".format)
    row("largest rebound of the centre of mass", n["largest_rebound"], "{:.3f} v0".format)
    row("numerical dissipation", n["numerical_dissipation"], "{:.1%} of the energy lost".format)
    row("particles", n["particles"], "{:,}".format)
