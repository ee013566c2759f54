"""One snapshot of a run: grains, contacts and the cell around them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from dusttaichi.errors import DustError
from dusttaichi.physics import geometry
from dusttaichi.physics.contact import constants
from dusttaichi.physics.contact.effect_registry import DEFAULT
from dusttaichi.physics.contact.jkr_curve import scaled_radius
from dusttaichi.physics.contact.material_interface import reduced_modulus
from dusttaichi.physics.contact.parts import pair_parts, wall_parts
from dusttaichi.physics.geometry import AXES, Floats
from dusttaichi.results.datasets import take_record
from dusttaichi.results.integrity import check_ends
from dusttaichi.scene import quantities

if TYPE_CHECKING:
    from dusttaichi.analysis.run import Run


# inward unit vectors of the walls, in the order of geometry.WALLS
INWARD = np.repeat(np.eye(3), 2, axis=0) * np.tile([1.0, -1.0], 3)[:, None]


class Forces(NamedTuple):
    """Forces of the contacts of a snapshot."""

    total: Floats  #: Sums over contacts and walls of each grain [N], (N, 3).
    pairs: dict[str, Floats]  #: Parts of the contacts (physics.contact.parts).
    walls: dict[str, Floats] | None  #: Parts of the wall contacts, None without walls.


@dataclass(frozen=True)
class Frame:
    """One snapshot in SI: N grains, C contacts between them."""

    number: int  #: Number of the snapshot, from 0.
    time: float  #: [s].
    step: int  #: Number of the step.
    position: Floats  #: [m], (N, 3).
    velocity: Floats  #: [m/s], (N, 3).
    spin: Floats  #: Angular velocity [rad/s], (N, 3).
    radius: Floats  #: [m], (N,).
    #: Lower and upper coordinate of the walls or periodic faces of each axis [m], (3, 2); NaN where
    #: there is none.
    cell: Floats
    periodic: NDArray[np.bool_]  #: (3,) bool.
    #: xr.Dataset with grain_i, grain_j, overlap ... (C,); None for a result without them.
    contacts: xr.Dataset | None
    #: Centre and radius of a rigid sphere among the grains [m], (4,), or None.
    sphere: Floats | None = None
    tilt: float = 0.0  #: Offset along x of the image above a sheared cell [m].
    wall_contacts: xr.Dataset | None = None  #: The same of walls.
    material: NDArray[np.integer] | None = None  #: (N,) int, 0 of a single material.
    #: Unit quaternions, (N, 4); None where they were not requested.
    orientation: Floats | None = None

    @property
    def pairs(self) -> NDArray[np.int64]:
        """Grains in contact, (C, 2) int.

        Raises
        ------
        DustError
            The result has no contacts.
        """
        contacts = self.require_contacts()
        ends = (contacts.grain_i.values, contacts.grain_j.values)
        return np.stack(ends, axis=1).astype(np.int64)

    def require_contacts(self) -> xr.Dataset:
        """The `contacts`.

        Raises
        ------
        DustError
            The result has none.
        """
        if self.contacts is None:
            raise DustError("The snapshots have no contacts: set output: contacts: true.")
        return self.contacts

    def require_wall_contacts(self) -> xr.Dataset:
        """The `wall_contacts`.

        Raises
        ------
        DustError
            The result has none.
        """
        if self.wall_contacts is None:
            raise DustError("The snapshots have no contacts with walls.")
        return self.wall_contacts

    @property
    def coordination(self) -> NDArray[np.intp]:
        """Number of grains that each grain touches, (N,) int, walls not counted."""
        return np.bincount(self.pairs.ravel(), minlength=len(self.radius))

    @property
    def forces(self) -> Forces | None:
        """Forces and parts of the contacts; None for a result without forces."""
        if self.contacts is None or "force" not in self.contacts:
            return None
        (i, j), total = self.pairs.T, np.zeros((len(self.radius), 3))
        load = [self.contacts[k].values.astype(float) for k in ("force", "torque_i", "torque_j")]
        np.add.at(total, i, load[0])
        np.add.at(total, j, -load[0])
        branch = self.nearest(self.position[i] - self.position[j])
        normal = branch / np.linalg.norm(branch, axis=1)[:, None]
        pairs, walls = pair_parts(normal, load, (self.radius[i], self.radius[j])), None
        if self.wall_contacts is not None:
            grain, wall = (self.wall_contacts[k].values.astype(int) for k in ("grain", "wall"))
            load = [self.wall_contacts[k].values.astype(float) for k in ("force", "torque")]
            np.add.at(total, grain, load[0])
            walls = wall_parts(self.wall_normals, load, self.radius[grain])
        return Forces(total, pairs, walls)

    @property
    def rolling(self) -> Floats:
        """Lengths of the rolling displacements R (n1 + n2) of the contacts [m], (C,)."""
        reach = constants.reduced_radius(*self.radius[self.pairs.T])
        contacts = self.require_contacts()
        pointers = contacts.pointer_i.values + contacts.pointer_j.values
        lengths: Floats = reach * np.linalg.norm(pointers, axis=1)
        return lengths

    @property
    def wall_points(self) -> Floats:
        """Points on the walls of the wall contacts [m], (W, 3)."""
        contacts = self.require_wall_contacts()
        grain, wall = (contacts[k].values.astype(int) for k in ("grain", "wall"))
        points: Floats = self.position[grain]
        flat = wall < len(INWARD)
        rows = np.flatnonzero(flat)
        points[rows, wall[rows] // 2] = self.cell.ravel()[wall[rows]]
        distance = self.radius[grain] - contacts.overlap.values
        points[~flat] -= (distance[:, None] * self.wall_normals)[~flat]
        return points

    @property
    def wall_normals(self) -> Floats:
        """Unit normals of the walls at the wall contacts, into the room, (W, 3)."""
        contacts = self.require_wall_contacts()
        grain, wall = (contacts[k].values.astype(int) for k in ("grain", "wall"))
        # of a surface by the foot point, which is a thousandth of a radius from the nearest one
        away = self.position[grain] - contacts.foot.values
        curved = away / np.maximum(np.linalg.norm(away, axis=1, keepdims=True), 1e-300)
        flat = INWARD[np.minimum(wall, len(INWARD) - 1)]
        normals: Floats = np.where((wall < len(INWARD))[:, None], flat, curved)
        return normals

    @property
    def edges(self) -> Floats:
        """Edges of the cell [m], (3,); not a number where one of its two faces is missing."""
        return self.cell[:, 1] - self.cell[:, 0]

    @property
    def period(self) -> Floats:
        """Edges of the cell along periodic axes [m], (3,); infinite along the others."""
        return np.where(self.periodic, self.edges, np.inf)

    @property
    def top(self) -> float:
        """Height of the uppermost point of the grains [m]."""
        return float(np.max(self.position[:, 2] + self.radius))

    @property
    def floor(self) -> float:
        """Height of the floor [m]: of the lower wall, else of the lowest point of the grains."""
        low = self.cell[2, 0]
        return float(low if np.isfinite(low) else np.min(self.position[:, 2] - self.radius))

    def filling_below(self, axis: Floats, reach: float, edges: Floats) -> Floats:
        """Filling factor in slices of an upright cylinder, by the volume of the grains in it.

        Parameters
        ----------
        axis
            x and y of the axis of the cylinder [m], (2,).
        reach
            Radius of the cylinder [m].
        edges
            Falling heights of the edges of the slices [m], (slices + 1,).

        Returns
        -------
        array
            (slices,).
        """
        centre = np.append(axis, 0.0)
        x = self.nearest(self.position - centre) + centre
        volume = [
            geometry.cylinder_volume(x, self.radius, axis, reach, low=low, high=high)
            for low, high in zip(edges[1:], edges[:-1], strict=True)
        ]
        return np.array(volume) / (np.pi * reach**2 * -np.diff(edges))

    def nearest(self, vectors: ArrayLike) -> Floats:
        """Differences of positions [m], (..., 3), to the nearest image along periodic axes."""
        return geometry.nearest_image(vectors, self.period, self.tilt)


def count_frames(run: Run) -> int:
    """Number of snapshots of a run.

    Raises
    ------
    DustError
        There are none.
    """
    return int(read_snapshots(run).sizes["snapshot"])


def read_snapshots(run: Run) -> xr.DataTree:
    """The group /snapshots of the file of a run, with those of all its stages.

    Raises
    ------
    DustError
        There are none.
    """
    group = None if run.tree is None else run.tree.children.get("snapshots")
    if group is None or not group.sizes.get("snapshot", 0):
        raise DustError(f"{run.path} has no snapshots: set output: snapshots in the scene.")
    return group


def resolve_snapshot(run: Run, snapshot: int) -> int:
    """Number of a snapshot from 0; from the end if negative. Raises DustError without it."""
    count = count_frames(run)
    if not -count <= snapshot < count:
        raise DustError(
            f"{run.path} has no snapshot {snapshot}; allowed: 0 to {count - 1}, or -1 for the last."
        )
    return snapshot % count


def read_frame(run: Run, snapshot: int = -1, contacts: bool | Sequence[str] = True) -> Frame:
    """One snapshot of a run.

    Parameters
    ----------
    run : Run
    snapshot : int
        Its number, from 0, or from the end if negative.
    contacts : bool or sequence of str
        Read the contacts, too: all of their variables, or those of these names.

    Raises
    ------
    DustError
        There is no snapshot of that number, or its contacts name grains that it does not have.
    """
    number = resolve_snapshot(run, snapshot)
    data = take_record(read_snapshots(run).to_dataset(inherit=False), "snapshot", number)
    present = {} if run.tree is None else run.tree.children
    groups = [name for name in ("contacts", "wall_contacts") if name in present]
    names = None if isinstance(contacts, bool) else contacts
    read = {name: run.contacts(number, name, names) for name in groups} if contacts else {}
    for group, rows in read.items():
        check_ends(run.path, f"{group} of snapshot {number}", rows, data.sizes["grain"])
    periodic = run.attrs.get("periodic_axes", "").split()
    cell = data.box.values.reshape(3, 2) if "box" in data else np.full((3, 2), np.nan)
    return Frame(
        number=number,
        time=float(data.snapshot_time),
        step=int(data.step),
        position=data.position.values.astype(float),
        velocity=_read_vectors(data, "velocity"),
        spin=_read_vectors(data, "spin"),
        radius=data.radius.values,
        cell=cell,
        periodic=np.array([axis in periodic for axis in AXES]),
        contacts=read.get("contacts"),
        sphere=np.append(data.sphere_position.values, run.attrs["sphere_radius"])
        if "sphere_position" in data
        else None,
        tilt=float(data.tilt) if "tilt" in data else 0.0,
        wall_contacts=read.get("wall_contacts"),
        material=data.material.values if "material" in data else np.zeros(data.sizes["grain"], int),
        orientation=data.orientation.values if "orientation" in data else None,
    )


def _read_vectors(data: xr.Dataset, name: str) -> Floats:
    """(N, 3) of a snapshot; not a number where output.variables excludes it."""
    if name in data:
        return data[name].values.astype(float)
    return np.full(data.position.shape, np.nan)


def compute_normal_force(run: Run, frame: Frame) -> Floats | None:
    """Normal force of each contact of a Frame [N], (C,), positive for repulsion.

    From the result, else from the overlap by S12 eqs 2 and 3, without damping. None for several
    materials or another law.
    """
    contacts = frame.require_contacts()
    if "normal_force" in contacts:
        force: Floats = contacts.normal_force.values.astype(float)
        return force
    material = run.material
    normal = run.scene.get("interaction", {}).get("normal", {})
    if normal.get("law", DEFAULT["normal"]) != DEFAULT["normal"]:
        return None
    if material is None or run.scene.get("materials"):
        return None
    R = constants.reduced_radius(*frame.radius[frame.pairs.T])
    gamma, E_star = material.surface_energy, reduced_modulus(material)
    a0 = constants.equilibrium_contact_radius(gamma, R, E_star)
    s = scaled_radius(contacts.overlap.values / constants.equilibrium_overlap(a0, R))
    pull_off: Floats = constants.pull_off_force(gamma, R)
    return 4.0 * pull_off * (s**6 - s**3)


def find_surface(run: Run) -> float:
    """Height of the upper end of the dust at the start [m], from the sample or the first frame."""
    height = run.sample.get("surface")
    return float(run.method.read(run, 0).top if height is None else height)


def read_grain_masses(run: Run) -> Floats:
    """Masses of the grains [kg], (N,): from the result, or volume times density of the material.

    Raises
    ------
    DustError
        The result has no density.
    """
    snapshots = read_snapshots(run)
    if "mass" in snapshots:
        masses: Floats = snapshots.mass.values
        return masses
    material = run.scene.get("material", {})
    if not isinstance(material, dict) or "density" not in material:
        raise DustError(f"{run.path} lacks the density of its grains (scene_resolved).")
    density = quantities.parse(material["density"], "density", "material.density")
    radius: Floats = snapshots.radius.values
    return 4.0 / 3.0 * np.pi * radius**3 * density
