"""Snapshots of a run for the 3-D viewer: grains, or particles of a continuum."""

import numpy as np

from dusttaichi.analysis.cycles import cell_pressure
from dusttaichi.plots import style
from dusttaichi.report.contacts import BODY, COORDINATION, DISSIPATED, contacts_of
from dusttaichi.report.packing import class_quantity, number_quantity, packed, quantised
from dusttaichi.report.selection import MOST_SHOWN, select_particles
from dusttaichi.results.roles import DUST, ELASTIC, FIXED, RIGID, WALL

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


def particles(run, most=MOST):
    """Data of a Run for the viewer, None without snapshots; most: particles times snapshots.

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
    frames = frames.isel(snapshot=chosen(frames, most))
    selection = select_particles(frames, flat)
    frames = selection.read(frames)
    x = frames.position.values
    radius = radii(run, frames)
    extent = float(np.nanmax(np.ptp(x.reshape(-1, 3), axis=0))) + 2.0 * float(np.max(radius))
    unit = next(name for least, name in LENGTHS if extent >= least)
    scale = SCALE[unit]
    rows = x.shape[0]
    grains = "radius" in frames
    pairs, more = contacts_of(run, frames, selection) if grains else (None, [])
    quantities = [*more, *_quantities(run, frames, radius / scale, unit)]
    radius_rows = np.broadcast_to(radius, (1, x.shape[1])) if radius.ndim == 1 else radius
    about = [selection.text] if selection.text else []
    return {
        "count": x.shape[1],
        "frames": rows,
        "word": "grains" if grains else "particles",
        "length_unit": unit,
        "view": "front" if flat else "oblique",
        "said": [", ".join([text, *about]) for text in frame_texts(run, frames)],
        "position": quantised(x / scale, rows),
        "radius": packed((radius_rows / scale).astype("f4")),
        "largest_radius": float(np.max(radius) / scale),
        "quantities": quantities,
        "colour": first_colour(run, [quantity["label"] for quantity in quantities]),
        "pairs": pairs,
        "room": _faces(frames, scale),
        "tilt": (frames.tilt.values / scale).tolist() if "tilt" in frames else None,
        "sphere": _sphere(run, frames, scale),
        "periodic": [axis in run.attrs.get("periodic_axes", "").split() for axis in "xyz"],
    }


def first_colour(run, labels):
    """Number of the initial colouring: energy dissipated if requested, else body or coordination.

    By body for a collision, by coordination number with contacts, else the first one.
    """
    wanted = (ALL_DISSIPATED, DISSIPATED, BODY if run.collides else COORDINATION)
    return next((labels.index(label) for label in wanted if label in labels), 0)


def chosen(frames, most=MOST):
    """Numbers of the snapshots in a report, evenly from the last to the first."""
    count, size = frames.sizes["snapshot"], min(frames.position.shape[1], MOST_SHOWN)
    most = max(most // max(size, 1), 1)
    return np.unique(np.linspace(count - 1, 0, min(count, most)).round().astype(int))


def radii(run, frames):
    """Radii of the drawn spheres [m]: of grains (count,), or of particles (frames, count).

    A particle has half of the edge of the cube (in two dimensions the square) of its volume.
    """
    if "radius" in frames:
        return frames.radius.values
    dimension = int(run.attrs.get("dimension", 3))
    volume = np.asarray(frames.mass.values / frames.density.values)
    return np.atleast_2d(0.5 * volume ** (1.0 / dimension))


def frame_texts(run, frames):
    """A line for each snapshot: time, filling factor, pressure and shear strain, if recorded."""
    series, lines = run.series, []
    factor, unit = style.choose_unit(float(frames.snapshot_time.values[-1]) or 1.0, style.TIMES)
    steps, pressure = series.step.values, _pressure(series)
    for time, step in zip(frames.snapshot_time.values, frames.step.values, strict=True):
        words = [f"t = {time * factor:.4g} {unit}"]
        if len(steps):
            number = int(np.argmin(np.abs(steps - step)))
            now = series.isel(time=number)
            if "filling_factor" in series and np.isfinite(now.filling_factor):
                words.append(f"φ = {float(now.filling_factor):.3f}")
            if pressure is not None and np.isfinite(pressure[number]):
                scale, pascal = style.choose_unit(abs(pressure[number]), style.PRESSURES)
                words.append(f"P = {pressure[number] * scale:.3g} {pascal}")
            if "shear_strain" in series:
                words.append(f"γ = {float(now.shear_strain):.3g}")
        lines.append(", ".join(words))
    return lines


def _pressure(series):
    """Pressure over the series [Pa], (times,): of the cell, or on the top wall.

    None where neither is recorded or all are 0.
    """
    if "stress" in series:
        pressure = cell_pressure(series)
    elif "pressure" in series:
        pressure = series.pressure.sel(wall="top").values
    else:
        return None
    return pressure if np.nanmax(np.abs(pressure), initial=0.0) > 0.0 else None


def _quantities(run, frames, radius, unit):
    """Quantities of the particles of any method, without those by contacts."""
    rows, x = frames.sizes["snapshot"], frames.position.values
    found = []
    if "grain_loss" in frames:
        found += dissipated_by_channel(frames.grain_loss, rows)
    if "density" in frames:
        found += _of_continuum(run, frames, rows)
    if "velocity" in frames:
        speed = np.linalg.norm(frames.velocity.values, axis=-1)
        largest = float(np.nanmax(speed, initial=0.0))
        factor, name = style.choose_unit(largest, ((1.0, "m/s"), (1e-2, "cm/s"), (1e-3, "mm/s")))
        found.append(number_quantity("speed", name, speed * factor, rows))
    found.append(number_quantity("height", unit, x[..., 2] / SCALE[unit], rows))
    if np.ptp(radius) > 1e-6 * np.max(radius) and "radius" in frames:
        found.append(number_quantity("radius", unit, radius, rows))
    if "material" in frames:
        names = dict(enumerate(str(run.attrs.get("materials", "")).replace(",", " ").split()))
        found.append(class_quantity("material", frames.material.values, names, rows))
    if "body" in frames and frames.body.dtype.kind in "iu":  # no names
        bodies = frames.body.values
        names = {n + 1: f"body {n}" if n >= 0 else "fixed" for n in np.unique(bodies)}
        found.append(class_quantity("body", bodies + 1, names, rows))
    return [quantity for quantity in found if quantity is not None]


def dissipated_by_channel(loss, rows):
    """Energy dissipated at each grain since the start: in all, and by each channel that has any.

    loss [J]: (snapshots, grains, channels).
    """
    whole = loss.sum("channel").values
    factor, unit = style.choose_unit(float(np.max(whole, initial=0.0)), style.ENERGIES)
    found = [number_quantity(ALL_DISSIPATED, unit, factor * whole, rows)]
    for name in loss.channel.values:
        own = loss.sel(channel=name).values
        if np.any(own):
            found.append(number_quantity(f"dissipated by {name}", unit, factor * own, rows))
    return found


def _of_continuum(run, frames, rows):
    density, role = frames.density.values, np.broadcast_to(frames.role.values, frames.density.shape)
    dust, stressed = np.isin(role, (DUST, FIXED)), np.isin(role, (DUST, FIXED, ELASTIC))
    found = []
    solid = run.attrs.get("solid_density")
    if "solid_density" in frames:
        solid = frames.solid_density.values
    phi = None if solid is None else density / np.asarray(solid, dtype=float)
    if phi is not None:
        found.append(number_quantity("filling factor φ", "", np.where(dust, phi, np.nan), rows))
    else:
        found.append(number_quantity("density", "kg/m³", np.where(dust, density, np.nan), rows))
    if "pressure" in frames:
        values = np.where(stressed, frames.pressure.values, np.nan)
        top = float(np.nanmax(np.abs(values), initial=0.0))
        factor, unit = style.choose_unit(top, style.PRESSURES)
        found.append(number_quantity("pressure", unit, values * factor, rows))
    found.append(class_quantity("role", frames.role.values, ROLES, rows))
    return found


def _faces(frames, scale):
    if "box" not in frames:
        return None
    faces = frames.box.values / scale
    return [[round(v, 6) if np.isfinite(v) else None for v in row] for row in faces.tolist()]


def _sphere(run, frames, scale):
    if "sphere_position" not in frames:
        return None
    centres = np.round(frames.sphere_position.values / scale, 6).tolist()
    return {"radius": float(run.attrs["sphere_radius"]) / scale, "centres": centres}
