"""A rigid sphere that penetrates grains, and the wave of a push."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from dusttaichi.analysis.arrival import fit_sound_speed, measure_arrival
from dusttaichi.analysis.numbers.number_registry import Family, Observable, quiet, uncertainty
from dusttaichi.analysis.penetration import measure_penetration

if TYPE_CHECKING:
    from dusttaichi.analysis.run import Run


def _measure(run: Run) -> dict[str, float]:
    """Depth and time of the stop, or the largest depth; the largest upward force.

    The force is averaged between two records.
    """
    motion = measure_penetration(run)
    force, stop = {"sphere_force": float(motion.force.max())}, motion.stop
    if "speed" in run.scene.get("sphere", {}) or stop is None:
        return force | {"sphere_largest_depth": float(motion.depth.max())}
    return force | {"sphere_depth": stop.depth, "sphere_stopping_time": stop.time}


def _format_stop(value: float, n: Mapping[str, Any]) -> str:
    return f"{value * 1e6:.4g} µm, where it stops after {n['sphere_stopping_time'] * 1e6:.4g} µs"


SPHERE = Family(
    name="sphere",
    title="penetration of a sphere",
    order=70,
    applies=lambda run: run.has_sphere,
    measure=_measure,
    optional=True,  # it flies, or there is no dust below it
    numbers=(
        Observable(name="sphere_depth", title="depth of the sphere", unit="m", text=_format_stop,
                   column=("sphere depth µm", "{:.4g}", 1e-6), figure="sphere"),
        quiet("sphere_stopping_time", "stopping time of the sphere", "s", figure="sphere"),
        Observable(name="sphere_largest_depth", title="largest depth of the sphere", unit="m",
                   text=lambda v, n: f"{v * 1e6:.4g} µm",
                   column=("largest sphere depth µm", "{:.4g}", 1e-6), figure="sphere"),
        Observable(name="sphere_force", title="largest force on the sphere", unit="N",
                   text=lambda v, n: f"{v * 1e6:.4g} µN",
                   column=("largest force on the sphere µN", "{:.4g}", 1e-6), figure="sphere"),
    ),
)  # fmt: skip


SOUND = Family(
    name="sound",
    title="a push",
    order=80,
    applies=lambda run: bool(run.pushes),
    measure=lambda run: fit_sound_speed(measure_arrival(run)),
    optional=True,  # too few snapshots, or the wave has not arrived
    numbers=(
        Observable(name="sound_speed", title="speed of sound", unit="m/s", value="speed",
                   error="sound_speed_sigma", column=("sound m/s", "{:.4g}", 1), trade_rank=4,
                   figure="sound_speed"),
        uncertainty("sound_speed_sigma", "m/s", value="sigma", column=("± m/s", "{:.1g}", 1)),
    ),
)  # fmt: skip
FAMILIES = (SPHERE, SOUND)
