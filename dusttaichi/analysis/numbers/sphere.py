"""A rigid sphere that goes into grains: its depth, and the largest force on it."""

from dusttaichi.analysis.numbers.registry import Family, Observable, quiet
from dusttaichi.analysis.sphere import penetration
from dusttaichi.errors import DustError


def _measure(run):
    """Depth and time of its stop, or how deep it has come; the largest force upwards, a mean
    between two records."""
    try:
        way = penetration(run)
    except DustError:  # it flies, or there is no dust below it
        return {}
    found = {"sphere_force": float(way.force.max())}
    if "speed" in run.scene.get("sphere", {}) or way.stop is None:
        return found | {"sphere_largest_depth": float(way.depth.max())}
    return found | {"sphere_depth": way.stop.depth, "sphere_stopping_time": way.stop.time}


def _stop(value, n):
    return f"{value * 1e6:.4g} µm, where it stops after {n['sphere_stopping_time'] * 1e6:.4g} µs"


SPHERE = Family(
    name="sphere",
    title="a sphere that goes into grains",
    place=70,
    applies=lambda run: run.has_sphere,
    measure=_measure,
    numbers=(
        Observable(name="sphere_depth", title="depth of the sphere", unit="m", text=_stop,
                   column=("sphere depth um", "{:.4g}", 1e-6), figure="sphere"),
        quiet("sphere_stopping_time", "stopping time of the sphere", "s", figure="sphere"),
        Observable(name="sphere_largest_depth", title="largest depth of the sphere", unit="m",
                   text=lambda v, n: f"{v * 1e6:.4g} µm",
                   column=("sphere so far um", "{:.4g}", 1e-6), figure="sphere"),
        Observable(name="sphere_force", title="largest force on the sphere", unit="N",
                   text=lambda v, n: f"{v * 1e6:.4g} µN",
                   column=("force on it uN", "{:.4g}", 1e-6), figure="sphere"),
    ),
)  # fmt: skip
FAMILIES = (SPHERE,)
