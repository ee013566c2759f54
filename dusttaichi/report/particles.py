"""Snapshots of a run as the 3-D viewer of a page takes them: grains, or a continuum's particles."""

import numpy as np
import xarray as xr

from dusttaichi.analysis.continuum.particles import DUST, ELASTIC, HELD, RIGID, WALL
from dusttaichi.analysis.fragments import fragments_of
from dusttaichi.analysis.frame import read_frame
from dusttaichi.names import AXES
from dusttaichi.physics.contact import constants
from dusttaichi.physics.contact.jkr_curve import scaled_radius
from dusttaichi.physics.contact.registry import DEFAULT
from dusttaichi.plots import style
from dusttaichi.report.packing import packed, quantised

MOST = 600_000  # particles times snapshots in a page: some 25 MB with their contacts
LENGTHS = ((1e-1, "m"), (1e-4, "mm"), (0.0, "µm"))  # of the largest extent
SCALE = {"m": 1.0, "mm": 1e-3, "µm": 1e-6}
FRAGMENTS = 7  # that have a class of their own; smaller ones share the last
ROLES = {
    DUST: "dust",
    RIGID: "rigid body",
    HELD: "held dust",
    WALL: "wall",
    ELASTIC: "elastic body",
}
SPHERE_END = 6  # after the walls: the end of a contact with the rigid sphere
OUTLIERS = 99.0  # percentile of a skew quantity at which its colours end


def particles(run, most=MOST):
    """The viewer's data of a Run, None where it kept no snapshots; most: particles times snapshots.

    count, frames; said: a line for each snapshot; position (frames, count, 3), radius; quantities:
    what may colour; pairs: contacts of all snapshots one after another, of which those with walls
    end at `count` plus the number of the wall; room, periodic: faces;
    tilt: how much further along x the upper faces of a cell stand; sphere: radius and centres of
    a rigid one among the grains.
    """
    frames = run.snapshots
    if frames is None or not {"radius", "role"} & set(frames.variables):
        return None  # no particles that the viewer knows
    frames = frames.isel(snapshot=chosen(frames, most)).load()
    x = frames.position.values
    radius = radii(run, frames)
    extent = float(np.nanmax(np.ptp(x.reshape(-1, 3), axis=0))) + 2.0 * float(np.max(radius))
    unit = next(name for least, name in LENGTHS if extent >= least)
    scale = SCALE[unit]
    rows = x.shape[0]
    grains = "radius" in frames
    pairs, more = _contacts(run, frames) if grains else (None, [])
    about = [*more, *_quantities(run, frames, radius / scale, unit)]
    kept_radius = np.broadcast_to(radius, (1, x.shape[1])) if radius.ndim == 1 else radius
    return {
        "count": x.shape[1],
        "frames": rows,
        "word": "grains" if grains else "particles",
        "length_unit": unit,
        "view": "front" if int(run.attrs.get("dimension", 3)) == 2 else "oblique",
        "said": said(run, frames),
        "position": quantised(x / scale, rows),
        "radius": packed((kept_radius / scale).astype("f4")),
        "largest_radius": float(np.max(radius) / scale),
        "quantities": about,
        "pairs": pairs,
        "room": _room(frames, scale),
        "tilt": (frames.tilt.values / scale).tolist() if "tilt" in frames else None,
        "sphere": _sphere(run, frames, scale),
        "periodic": [axis in run.attrs.get("periodic_axes", "").split() for axis in AXES],
    }


def chosen(frames, most=MOST):
    """Numbers of the snapshots that a page has room for, evenly, from the last to the first."""
    count, size = frames.sizes["snapshot"], frames.position.shape[1]
    most = max(most // max(size, 1), 1)
    return np.unique(np.linspace(count - 1, 0, min(count, most)).round().astype(int))


def radii(run, frames):
    """Radii that spheres are drawn with [m]: of grains (count,), or of particles (frames, count),
    half of the edge of the cube (in two dimensions of the square) that each of them fills."""
    if "radius" in frames:
        return frames.radius.values
    dimension = int(run.attrs.get("dimension", 3))
    volume = np.asarray(frames.mass.values / frames.density.values)
    return np.atleast_2d(0.5 * volume ** (1.0 / dimension))


def said(run, frames):
    """A line for each snapshot: time, filling factor and pressure where the series has them, and
    the shear of what is sheared."""
    series, lines = run.series, []
    factor, unit = style.scaled(float(frames.snapshot_time.values[-1]) or 1.0, style.TIMES)
    steps, pressure = series.step.values, _pressure(series)
    for time, step in zip(frames.snapshot_time.values, frames.step.values, strict=True):
        words = [f"t = {time * factor:.4g} {unit}"]
        if len(steps):
            number = int(np.argmin(np.abs(steps - step)))
            now = series.isel(time=number)
            if "filling_factor" in series and np.isfinite(now.filling_factor):
                words.append(f"φ = {float(now.filling_factor):.3f}")
            if pressure is not None and np.isfinite(pressure[number]):
                scale, pascal = style.scaled(abs(pressure[number]), style.PRESSURES)
                words.append(f"P = {pressure[number] * scale:.3g} {pascal}")
            if "shear_strain" in series:
                words.append(f"γ = {float(now.shear_strain):.3g}")
        lines.append(", ".join(words))
    return lines


def _pressure(series):
    """Pressure over the series [Pa], (times,): on the top wall, or the mean one of a cell without
    walls; None where neither is known or all is 0."""
    if "stress" in series:
        found = (
            -np.trace(series.stress.transpose("time", "xyz", "axis").values, axis1=1, axis2=2) / 3
        )
    elif "pressure" in series:
        found = series.pressure.sel(wall="top").values
    else:
        return None
    return found if np.nanmax(np.abs(found), initial=0.0) > 0.0 else None


def _number(label, unit, values, rows):
    """A quantity that is a number; its colours end at a percentile where few are far out."""
    values = np.atleast_2d(values)
    finite = values[np.isfinite(values)]
    if not len(finite):
        return None
    low, high = float(finite.min()), float(finite.max())
    edge = float(np.percentile(finite, OUTLIERS))
    high = edge if edge > low and high > 3.0 * abs(edge) else high
    data = quantised(values, len(values) if len(values) == rows else 1)
    return {"label": label, "unit": unit, "kind": "number", "range": [low, high], "data": data}


def _class(label, values, names, rows):
    values = np.atleast_2d(values)
    data = packed(values.astype("u2"), len(values) if len(values) == rows else 1)
    names = {int(k): str(name) for k, name in names.items()}
    return {"label": label, "unit": "", "kind": "class", "names": names, "data": data}


def _quantities(run, frames, radius, unit):
    """What particles of either method may be coloured by, beside what contacts tell."""
    rows, x = frames.sizes["snapshot"], frames.position.values
    found = []
    if "density" in frames:
        found += _of_continuum(run, frames, rows)
    if "velocity" in frames:
        speed = np.linalg.norm(frames.velocity.values, axis=-1)
        largest = float(np.nanmax(speed, initial=0.0))
        factor, name = style.scaled(largest, ((1.0, "m/s"), (1e-2, "cm/s"), (1e-3, "mm/s")))
        found.append(_number("speed", name, speed * factor, rows))
    found.append(_number("height", unit, x[..., 2] / SCALE[unit], rows))
    if np.ptp(radius) > 1e-6 * np.max(radius) and "radius" in frames:
        found.append(_number("radius", unit, radius, rows))
    if "material" in frames:
        names = dict(enumerate(str(run.attrs.get("materials", "")).replace(",", " ").split()))
        found.append(_class("material", frames.material.values, names, rows))
    if "body" in frames and frames.body.dtype.kind in "iu":  # no names
        bodies = frames.body.values
        names = {n + 1: f"body {n}" if n >= 0 else "fixed" for n in np.unique(bodies)}
        found.append(_class("body", bodies + 1, names, rows))
    return [quantity for quantity in found if quantity is not None]


def _of_continuum(run, frames, rows):
    density, role = frames.density.values, np.broadcast_to(frames.role.values, frames.density.shape)
    dust, stressed = np.isin(role, (DUST, HELD)), np.isin(role, (DUST, HELD, ELASTIC))
    found = []
    solid = run.attrs.get("solid_density")
    if "solid_density" in frames:
        solid = frames.solid_density.values
    phi = None if solid is None else density / np.asarray(solid, dtype=float)
    if phi is not None:
        found.append(_number("filling factor φ", "", np.where(dust, phi, np.nan), rows))
    else:
        found.append(_number("density", "kg/m³", np.where(dust, density, np.nan), rows))
    if "pressure" in frames:
        values = np.where(stressed, frames.pressure.values, np.nan)
        top = float(np.nanmax(np.abs(values), initial=0.0))
        factor, unit = style.scaled(top, style.PRESSURES)
        found.append(_number("pressure", unit, values * factor, rows))
    found.append(_class("role", frames.role.values, ROLES, rows))
    return found


def _room(frames, scale):
    if "box" not in frames:
        return None
    faces = frames.box.values / scale
    return [[round(v, 6) if np.isfinite(v) else None for v in row] for row in faces.tolist()]


def _sphere(run, frames, scale):
    if "sphere_position" not in frames:
        return None
    centres = np.round(frames.sphere_position.values / scale, 6).tolist()
    return {"radius": float(run.attrs["sphere_radius"]) / scale, "centres": centres}


# -- contacts of grains --------------------------------------------------------------------------


def _contacts(run, frames):
    """(the contacts of all snapshots, quantities that follow from them); (None, []) without."""
    if "contacts" not in run.tree.children or "contact_count" not in frames:
        return None, []
    count, rows = frames.position.shape[1], frames.sizes["snapshot"]
    steps = run.tree["snapshots"].step.values
    numbers = [int(np.flatnonzero(steps == step)[-1]) for step in frames.step.values]
    ends, forces, coordination, labels, load = [], [], [], [], []
    for number in numbers:
        frame = read_frame(run, number)
        pairs = frame.pairs
        order = np.lexsort((pairs[:, 1], pairs[:, 0]))
        force = normal_force(run, frame, frame.contacts)
        others, press = _on_walls(run, frame, force is not None)
        ends.append(np.concatenate([pairs[order], others]))
        coordination.append(frame.coordination)
        labels.append(np.minimum(fragments_of(frame, frame.radius**3).label, FRAGMENTS))
        if force is not None:
            forces.append(np.concatenate([force[order], press]))
            grains, shares = np.append(pairs.T.ravel(), others[:, 0]), [force, force, press]
            load.append(np.bincount(grains, np.abs(np.concatenate(shares)), minlength=count))
    quantities = [
        _number("coordination number", "", np.array(coordination), rows),
        _class("fragment", np.array(labels), _fragment_names(labels), rows),
    ]
    contacts = {"counts": [len(e) for e in ends], "force": None}
    contacts["ends"] = packed(np.concatenate(ends).astype("u4")) if ends else None
    if forces:
        everything = np.concatenate(forces)
        contacts["force"] = quantised(everything * 1e9)
        squeezed = np.abs(everything) if len(everything) else np.ones(1)
        contacts["largest"] = float(np.percentile(squeezed, OUTLIERS)) * 1e9 or 1.0
        quantities.append(_number("sum of contact forces", "nN", 1e9 * np.array(load), rows))
    if run.collides:
        body = np.zeros(count, int)
        body[run.bodies()[1]] = 1
        quantities.append(_class("body", body, {0: "target", 1: "projectile"}, rows))
    return contacts, quantities


def _on_walls(run, frame, forces):
    """Contacts of grains with walls and the rigid sphere, (n, 2): grain, and the number of grains
    plus that of the wall, 6 for the sphere; normal forces [N], (n,). None that lacks a force where
    `forces` are wanted."""
    count, found = len(frame.radius), [(np.zeros((0, 2), int), np.zeros(0))]
    groups = [frame.wall_contacts]
    if "sphere_contacts" in run.tree.children:
        groups.append(run.contacts(frame.number, "sphere_contacts"))
    for own in groups:
        if own is None or (forces and "normal_force" not in own):
            continue
        wall = own.wall.values if "wall" in own else np.full(len(own.grain), SPHERE_END)
        press = own.normal_force.values if forces else np.zeros(len(own.grain))
        found.append((np.stack([own.grain.values, count + wall], axis=1), press))
    ends, press = zip(*found, strict=True)
    return np.concatenate(ends).astype(int), np.concatenate(press)


def _fragment_names(labels):
    last = int(max(label.max() for label in labels))
    names = {n: "largest" if n == 0 else f"no. {n + 1}" for n in range(min(last + 1, FRAGMENTS))}
    return names | ({FRAGMENTS: "smaller"} if last >= FRAGMENTS else {})


def normal_force(run, frame, contacts: xr.Dataset):
    """Normal force of each contact of a Frame [N], positive where grains push each other apart.

    As the result has it; where it has none, from the overlap by S12 eqs 2 and 3, damping left out.
    None where that takes several materials or another law.
    """
    if "normal_force" in contacts:
        return contacts.normal_force.values.astype(float)
    material = run.material
    normal = run.scene.get("interaction", {}).get("normal", {})
    if normal.get("law", DEFAULT["normal"]) != DEFAULT["normal"]:
        return None
    if material is None or run.scene.get("materials"):
        return None
    i, j = frame.pairs.T
    R = constants.reduced_radius(frame.radius[i], frame.radius[j])
    gamma, E_star = material.surface_energy, constants.reduced_modulus(material)
    a0 = constants.equilibrium_contact_radius(gamma, R, E_star)
    s = scaled_radius(contacts.overlap.values / constants.equilibrium_overlap(a0, R))
    return 4.0 * constants.pull_off_force(gamma, R) * (s**6 - s**3)
