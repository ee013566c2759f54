"""Snapshots of a run for the 3-D viewer: grains, or particles of a continuum."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dusttaichi.analysis.cycles import compute_pressure
from dusttaichi.plots import style
from dusttaichi.report.packing import (
    make_class_quantity,
    make_number_quantity,
    pack_array,
    quantise,
)
from dusttaichi.report.selection import MOST_SHOWN, select_particles
from dusttaichi.report.viewer_contacts import BODY, COORDINATION, DISSIPATED, collect_contacts
from dusttaichi.results.datasets import take_records
from dusttaichi.results.roles import DUST, ELASTIC, FIXED, RIGID, WALL

if TYPE_CHECKING:
    import xarray as xr

    from dusttaichi.analysis.run import Run
    from dusttaichi.report.packing import Content

ALL_DISSIPATED = "energy dissipated since the start"
MOST = 600_000  # particles times snapshots in a report: some 25 MB with their contacts
NOT_SHOWN = ("spin", "orientation", "deviator")  # variables of snapshots, which take time to read
LENGTHS = ((1e-1, "m"), (1e-4, "mm"), (0.0, "µm"))  # of the largest extent
SCALE = {"m": 1.0, "mm": 1e-3, "µm": 1e-6}
ROLES = {
    DUST: "dust",
    RIGID: "rigid body",
    FIXED: "fixed dust",
    WALL: "wall",
    ELASTIC: "elastic body",
}


def collect_particles(run: Run, max_points: int = MOST) -> Content | None:
    """Data of a Run for the viewer, None without snapshots.

    max_points: largest number of particles times snapshots.

    count, frames; said: a line for each snapshot; position (frames, count, 3), radius; quantities:
    for colours; colour: number of the initial one; pairs: contacts of all snapshots in order, those
    with walls end at `count` plus the number of the wall; room, periodic: faces; tilt: offset of
    the upper faces of a cell along x; sphere: radius and centres of a rigid sphere.
    """
    frames = run.snapshots
    if frames is None or not {"radius", "role"} & set(frames.variables):
        return None  # no particles known to the viewer
    flat = int(run.attrs.get("dimension", 3)) == 2
    frames = frames[[name for name in frames.variables if name not in NOT_SHOWN]]
    frames = take_records(frames, "snapshot", choose_snapshots(frames, max_points))
    selection = select_particles(frames, flat)
    frames = selection.read(frames)
    x = frames.position.values
    radius = compute_radii(run, frames)
    extent = float(np.nanmax(np.ptp(x.reshape(-1, 3), axis=0))) + 2.0 * float(np.max(radius))
    unit = next(name for least, name in LENGTHS if extent >= least)
    scale = SCALE[unit]
    rows = x.shape[0]
    grains = "radius" in frames
    pairs, contact_quantities = collect_contacts(run, frames, selection) if grains else (None, [])
    available = [*contact_quantities, *_list_quantities(run, frames, radius / scale, unit)]
    quantities = [quantity for quantity in available if quantity is not None]
    radius_rows = np.broadcast_to(radius, (1, x.shape[1])) if radius.ndim == 1 else radius
    selection_text = [selection.text] if selection.text else []
    return {
        "count": x.shape[1],
        "frames": rows,
        "word": "grains" if grains else "particles",
        "length_unit": unit,
        "view": "front" if flat else "oblique",
        "said": [", ".join([text, *selection_text]) for text in describe_snapshots(run, frames)],
        "position": quantise(x / scale, rows),
        "radius": pack_array((radius_rows / scale).astype("f4")),
        "largest_radius": float(np.max(radius) / scale),
        "quantities": quantities,
        "colour": choose_colour(run, [quantity["label"] for quantity in quantities]),
        "pairs": pairs,
        "room": _list_faces(frames, scale),
        "tilt": (frames.tilt.values / scale).tolist() if "tilt" in frames else None,
        "sphere": _get_sphere(run, frames, scale),
        "periodic": [axis in run.attrs.get("periodic_axes", "").split() for axis in "xyz"],
    }


def choose_colour(run: Run, labels: Sequence[str]) -> int:
    """Choose the number of the initial colouring.

    By the energy dissipated if it is recorded; else by body for a collision, by coordination
    number with contacts, else the first one.
    """
    preferred_labels = (ALL_DISSIPATED, DISSIPATED, BODY if run.collides else COORDINATION)
    return next((labels.index(label) for label in preferred_labels if label in labels), 0)


def choose_snapshots(frames: xr.Dataset, max_points: int = MOST) -> NDArray[np.intp]:
    """Choose the numbers of the snapshots in a report, evenly from the last to the first."""
    count, size = frames.sizes["snapshot"], min(frames.position.shape[1], MOST_SHOWN)
    max_points = max(max_points // max(size, 1), 1)
    return np.unique(np.linspace(count - 1, 0, min(count, max_points)).round().astype(int))


def compute_radii(run: Run, frames: xr.Dataset) -> NDArray[np.float64]:
    """Radii of the drawn spheres [m]: of grains (count,), or of particles (frames, count).

    A particle has half of the edge of the cube (in two dimensions the square) of its volume.
    """
    if "radius" in frames:
        radius: NDArray[np.float64] = frames.radius.values
        return radius
    dimension = int(run.attrs.get("dimension", 3))
    volume = np.asarray(frames.mass.values / frames.density.values)
    return np.atleast_2d(0.5 * volume ** (1.0 / dimension))


def describe_snapshots(run: Run, frames: xr.Dataset) -> list[str]:
    """Describe each snapshot: time, filling factor, pressure and shear strain, if recorded."""
    series, lines = run.series, []
    factor, unit = style.choose_unit(float(frames.snapshot_time.values[-1]) or 1.0, style.TIMES)
    steps, pressure = series.step.values, _get_pressure(series)
    for time, step in zip(frames.snapshot_time.values, frames.step.values, strict=True):
        words = [f"t = {time * factor:.4g} {unit}"]
        if len(steps):
            number = int(np.argmin(np.abs(steps - step)))
            if "filling_factor" in series:
                filling_factor = float(series.filling_factor.values[number])
                words += [f"φ = {filling_factor:.3f}"] if np.isfinite(filling_factor) else []
            if pressure is not None and np.isfinite(pressure[number]):
                scale, pascal = style.choose_unit(abs(pressure[number]), style.PRESSURES)
                words.append(f"P = {pressure[number] * scale:.3g} {pascal}")
            if "shear_strain" in series:
                words.append(f"γ = {float(series.shear_strain.values[number]):.3g}")
        lines.append(", ".join(words))
    return lines


def _get_pressure(series: xr.Dataset) -> NDArray[np.float64] | None:
    """Pressure over the series [Pa], (times,): on the top wall, as in the table, else of the cell.

    None where neither is recorded or all are 0.
    """
    if not {"pressure", "stress"} & set(series):
        return None
    pressure = compute_pressure(series)
    return pressure if np.nanmax(np.abs(pressure), initial=0.0) > 0.0 else None


def _list_quantities(
    run: Run, frames: xr.Dataset, radius: NDArray[np.float64], unit: str
) -> list[Content | None]:
    """Quantities of the particles of any method, without those by contacts."""
    rows, x = frames.sizes["snapshot"], frames.position.values
    quantities: list[Content | None] = []
    if "grain_loss" in frames:
        quantities += list_dissipation(frames.grain_loss, rows)
    if "density" in frames:
        quantities += _list_continuum_quantities(run, frames, rows)
    if "velocity" in frames:
        speed = np.linalg.norm(frames.velocity.values, axis=-1)
        largest = float(np.nanmax(speed, initial=0.0))
        factor, name = style.choose_unit(largest, ((1.0, "m/s"), (1e-2, "cm/s"), (1e-3, "mm/s")))
        quantities.append(make_number_quantity("speed", name, speed * factor, rows))
    quantities.append(make_number_quantity("height", unit, x[..., 2] / SCALE[unit], rows))
    if np.ptp(radius) > 1e-6 * np.max(radius) and "radius" in frames:
        quantities.append(make_number_quantity("radius", unit, radius, rows))
    if "material" in frames:
        names = dict(enumerate(str(run.attrs.get("materials", "")).replace(",", " ").split()))
        quantities.append(make_class_quantity("material", frames.material.values, names, rows))
    if "body" in frames and frames.body.dtype.kind in "iu":  # no names
        bodies = frames.body.values
        names = {n + 1: f"body {n}" if n >= 0 else "fixed" for n in np.unique(bodies)}
        quantities.append(make_class_quantity("body", bodies + 1, names, rows))
    return quantities


def list_dissipation(loss: xr.DataArray, rows: int) -> list[Content | None]:
    """List the energy dissipated at each grain since the start: in total and by channel.

    loss [J]: (snapshots, grains, channels).
    """
    total = loss.sum("channel").values
    factor, unit = style.choose_unit(float(np.max(total, initial=0.0)), style.ENERGIES)
    quantities = [make_number_quantity(ALL_DISSIPATED, unit, factor * total, rows)]
    for name in loss.channel.values:
        channel_loss = loss.sel(channel=name).values
        if np.any(channel_loss):
            quantities.append(
                make_number_quantity(f"dissipated by {name}", unit, factor * channel_loss, rows)
            )
    return quantities


def _list_continuum_quantities(run: Run, frames: xr.Dataset, rows: int) -> list[Content | None]:
    density, role = frames.density.values, np.broadcast_to(frames.role.values, frames.density.shape)
    dust, stressed = np.isin(role, (DUST, FIXED)), np.isin(role, (DUST, FIXED, ELASTIC))
    quantities = []
    solid = run.attrs.get("solid_density")
    if "solid_density" in frames:
        solid = frames.solid_density.values
    phi = None if solid is None else density / np.asarray(solid, dtype=float)
    if phi is not None:
        quantities.append(
            make_number_quantity("filling factor φ", "", np.where(dust, phi, np.nan), rows)
        )
    else:
        quantities.append(
            make_number_quantity("density", "kg/m³", np.where(dust, density, np.nan), rows)
        )
    if "pressure" in frames:
        values = np.where(stressed, frames.pressure.values, np.nan)
        top = float(np.nanmax(np.abs(values), initial=0.0))
        factor, unit = style.choose_unit(top, style.PRESSURES)
        quantities.append(make_number_quantity("pressure", unit, values * factor, rows))
    quantities.append(make_class_quantity("role", frames.role.values, ROLES, rows))
    return quantities


def _list_faces(frames: xr.Dataset, scale: float) -> list[list[float | None]] | None:
    if "box" not in frames:
        return None
    faces = frames.box.values / scale
    return [[round(v, 6) if np.isfinite(v) else None for v in row] for row in faces.tolist()]


def _get_sphere(run: Run, frames: xr.Dataset, scale: float) -> Content | None:
    if "sphere_position" not in frames:
        return None
    centres = np.round(frames.sphere_position.values / scale, 6).tolist()
    return {"radius": float(run.attrs["sphere_radius"]) / scale, "centres": centres}
