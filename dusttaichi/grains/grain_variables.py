"""The variables of the result of grains, each declared once; results.variables has the others."""

from dataclasses import replace

from dusttaichi.physics.geometry import WALLS
from dusttaichi.results.variables import declare, declare_variables

_TYPES = {
    "contact_count": "i8", "wall_contact_count": "i8", "outside_count": "i8", "step": "i8",
    "sphere_contact_count": "i8",
    "material": "i4", "grain_i": "i4", "grain_j": "i4", "grain": "i4", "wall": "i4",
    # seven digits are enough for variables that no run reads again
    "normal_force": "f4", "force": "f4", "torque": "f4", "torque_i": "f4", "torque_j": "f4",
    "sliding_force": "f4", "rolling_moment": "f4", "twisting_moment": "f4",
}  # fmt: skip
_KINDS = {"contact": "", "wall_contact": "walls ", "sphere_contact": "sphere "}
"""Features that contacts of each kind need, beside those of all kinds."""
_COUNTS = {f"{row}_count": row for row in _KINDS}
_S12, _PHYS = "S12 section 3.2", "docs, Physics"


def _loads(row, line="line of centres", grain="grain"):
    """Rows of the loads in one kind of contacts. line: of its normal force; grain: on which."""
    needs = f"{_KINDS[row]}snapshots contacts"
    forces, requested = f"{needs} forces", f"{needs} requested"
    return [
        ("step", row, "1", "time steps done at the snapshot of this contact", "", forces),
        ("normal_force", row, "N", f"force along the {line}, positive where it pushes", _PHYS,
         forces),
        ("force", f"{row} xyz", "N", f"force on the {grain}", _PHYS, forces),
        ("sliding_force", f"{row} xyz", "N", f"part of force across the {line}", _PHYS, requested),
        ("rolling_moment", f"{row} xyz", "N m", f"torque of rolling on the {grain}", _PHYS,
         requested),
        ("twisting_moment", row, "N m", f"torque on the {grain} about the {line}", _PHYS,
         requested),
        ("loss", f"{row} channel", "J", "energy lost in the contact since it formed", _PHYS,
         requested),
    ]  # fmt: skip


# Features: "walls" (any wall), "cell" (periodic axes), "room" (either of them), "height" (a finite
# one), "filling" (a filling factor), "plates", "tube", "surfaces", "stress", "stages", "push"
# (forces, carried grains), "gravity", "outside" (forces from outside beside it), "sphere" (a rigid
# one), "pair" (two bodies that fly at each other), "shear" (in some stage), "tilt" (of the cell),
# "open" (nothing around), "polydisperse" (grains of different radius or material), "profiles",
# "snapshots", "contacts" (with the snapshots), "forces" (of these), "requested" (optional outputs).
_TABLE = {
    "series": [
        "time",
        "step",
        "height",
        "stage",
        "filling_factor",
        ("inner_filling_factor", "time", "1", "filling factor of an upright cylinder in the middle "
         "of the initial footprint", "PD08 section 3.1.2", "plates"),
        ("projected_area", "time", "m^2", "area of the shadow of the grains on the plates, exact",
         _S12, "plates"),
        ("outside_count", "time", "1", "grains whose centre has left the initial footprint", "",
         "plates"),
        "box_length",
        ("stress", "time xyz axis", "Pa", "virial stress, positive in tension, average since the "
         "last entry or over the stated window; the force along `axis` on a face across `xyz`",
         "T19 eq 23", "stress"),
        "pressure",
        "wall_force",
        ("surface_force", "time surface xyz", "N", "force of each surface on the grains, the tube "
         "first, average as for pressure", _PHYS, "surfaces"),
        ("surface_pressing", "time surface", "N", "its component along the normals, positive where "
         "it pushes, summed over the contacts, likewise", _PHYS, "surfaces"),
        ("surface_load", "time surface", "N", "force of a surface along its direction, likewise; "
         "not a number without a direction", _PHYS, "surfaces"),
        ("surface_pressure", "time surface", "Pa", "this over the area of the surface; not a "
         "number where none is defined", _PHYS, "surfaces"),
        ("surface_displacement", "time surface xyz", "m", "way of each surface since the start", "",
         "surfaces"),
        ("tube_pressure", "time", "Pa", "pressure on the tube, positive in compression, average as "
         "for pressure", "", "tube"),
        ("tube_friction", "time", "Pa", "force of the tube on the grains along z over its area, "
         "average as for pressure", "", "tube"),
        ("coordination_number", "time", "1", "mean number of grains that a grain touches", "", ""),
        ("contact_count", "time", "1", "contacts between grains", "", ""),
        ("wall_contact_count", "time", "1", "contacts of grains with walls", "", "walls"),
        ("kinetic_translation", "time", "J", "kinetic energy of translation", "", ""),
        ("kinetic_rotation", "time", "J", "kinetic energy of rotation", "", ""),
        ("potential", "time spring", "J", "potential energy in contacts between grains",
         _PHYS, ""),
        ("potential_wall", "time spring", "J", "potential energy in contacts with walls",
         _PHYS, "walls"),
        ("loss", "time channel", "J", "energy lost in contacts between grains, and to forces from "
         "outside, since the start",
         _PHYS, ""),
        ("loss_wall", "time channel", "J", "energy lost in contacts with walls since the start",
         _PHYS, "walls"),
        ("wall_work", "time", "J", "work of the walls on the grains since the start",
         _PHYS, "walls"),
        ("face_work", "time", "J", "work of the moving faces of the cell on the grains since the "
         "start", _PHYS, "cell"),
        ("shear_strain", "time", "1", "shear strain since the start: of the cell, or the "
         "displacement of the top wall along x over the height", "", "shear"),
        ("momentum", "time xyz", "kg m/s", "momentum of all grains and the sphere", "", "open"),
        ("angular_momentum", "time xyz", "kg m^2/s", "angular momentum of all grains and the "
         "sphere about the origin, spins included", "", "open"),
        ("body_position", "time body xyz", "m", "centre of mass of each of two bodies that fly at "
         "each other; its grains stay its own wherever they go", "", "pair"),
        ("body_velocity", "time body xyz", "m/s", "its velocity", "", "pair"),
        ("body_angular_momentum", "time body xyz", "kg m^2/s", "angular momentum of the body about "
         "its centre of mass, spins included", "", "pair"),
        ("gravity_work", "time", "J", "work of gravity on grains and sphere since the start: minus "
         "the change of their potential", _PHYS, "gravity"),
        ("force_work", "time", "J", "work of the other forces from outside on grains and sphere "
         "since the start, without their losses", _PHYS, "outside"),
        ("sphere_position", "time xyz", "m", "centre of the sphere", "", "sphere"),
        ("sphere_velocity", "time xyz", "m/s", "velocity of the sphere", "", "sphere"),
        ("sphere_spin", "time xyz", "rad/s", "angular velocity of the sphere", "", "sphere"),
        ("sphere_force", "time xyz", "N", "force of the grains on the sphere, average as for "
         "pressure", _PHYS, "sphere"),
        ("sphere_torque", "time xyz", "N m", "their torque on it about its centre, likewise",
         _PHYS, "sphere"),
        ("sphere_kinetic", "time", "J", "kinetic energy of the sphere, 0 while it is driven", "",
         "sphere"),
        ("sphere_contact_count", "time", "1", "grains that touch the sphere", "", "sphere"),
        ("potential_sphere", "time spring", "J", "potential energy in contacts with the sphere",
         _PHYS, "sphere"),
        ("loss_sphere", "time channel", "J", "energy lost in contacts with the sphere since the "
         "start", _PHYS, "sphere"),
        ("sphere_work", "time", "J", "work of what drives the sphere since the start", _PHYS,
         "sphere"),
        ("push_work", "time", "J", "work of pushes from outside on the grains since the start",
         _PHYS, "push"),
        "energy_residual",
        "energy_residual_relative",
        ("largest_overlap", "time", "m", "largest overlap of a contact", "", ""),
        ("largest_speed", "time", "m/s", "speed of the fastest grain", "", ""),
        "wall_clock",
    ],
    "profiles": [
        ("profile_time", "profile", "s", "simulated time", "", "height profiles"),
        ("step", "profile", "1", "time steps done", "", "height profiles"),
        ("height", "profile", "m", "top wall above bottom wall", _S12, "height profiles"),
        ("box_filling_factor", "profile", "1", "filling factor of the whole box", "S12 eq 28",
         "height profiles"),
        ("filling_factor", "profile bin", "1", "filling factor of the part of the bin below the "
         "top wall; not a number above it", "S12 Fig 5", "height profiles"),
        ("bin_height", "bin", "m", "middle of the bin above the bottom wall", "S12 Fig 5",
         "height profiles"),
        ("bin_lower", "bin", "m", "lower end of the bin above the bottom wall", "S12 Fig 5",
         "height profiles"),
        ("bin_upper", "bin", "m", "upper end of the bin above the bottom wall", "S12 Fig 5",
         "height profiles"),
    ],
    "snapshots": [
        "snapshot_time",
        "step",
        ("position", "snapshot grain xyz", "m", "centre of the grain", "", "snapshots"),
        ("velocity", "snapshot grain xyz", "m/s", "velocity of the grain", "", "snapshots"),
        ("spin", "snapshot grain xyz", "rad/s", "angular velocity of the grain", "", "snapshots"),
        ("orientation", "snapshot grain quaternion", "1", "rotation of the grain since the start, "
         "a unit quaternion", _PHYS, "snapshots requested"),
        ("grain_loss", "snapshot grain channel", "J", "energy lost in the contacts of the grain "
         "since the start: half of what a contact of two grains loses, all of what one with a wall "
         "or the sphere does", _PHYS, "snapshots requested"),
        ("box", "snapshot wall", "m", "coordinate of the wall, or of the face of a periodic cell, "
         "along its normal; not a number where there is neither", "", "room snapshots"),
        ("sphere_position", "snapshot xyz", "m", "centre of the sphere", "", "sphere snapshots"),
        ("sphere_velocity", "snapshot xyz", "m/s", "velocity of the sphere", "",
         "sphere snapshots"),
        ("sphere_spin", "snapshot xyz", "rad/s", "angular velocity of the sphere", "",
         "sphere snapshots"),
        ("sphere_force", "snapshot xyz", "N", "force of the grains on the sphere at that moment",
         _PHYS, "sphere snapshots"),
        ("tilt", "snapshot", "m", "shift along x of the image above the cell", "",
         "tilt snapshots"),
        *((f"{row}_count", "snapshot", "1", f"rows of /{row}s that belong to the snapshot", "",
           f"{needs}snapshots contacts") for row, needs in _KINDS.items()),
        ("radius", "grain", "m", "radius of the grain", "", "snapshots"),
        ("mass", "grain", "kg", "mass of the grain", "", "polydisperse snapshots"),
        ("material", "grain", "1", "number of the grain's material, in the order of the global "
         "attribute materials", "", "polydisperse snapshots"),
    ],
    "contacts": [
        ("grain_i", "contact", "1", "first grain", "", "snapshots contacts"),
        ("grain_j", "contact", "1", "second grain", "", "snapshots contacts"),
        ("pointer_i", "contact xyz", "1", "contact pointer fixed in the first grain", _PHYS,
         "snapshots contacts"),
        ("pointer_j", "contact xyz", "1", "contact pointer fixed in the second grain", _PHYS,
         "snapshots contacts"),
        ("twist", "contact", "rad", "twisting angle", _PHYS, "snapshots contacts"),
        ("approach", "contact", "m/s", "speed of approach in the last half step", "",
         "snapshots contacts"),
        ("overlap", "contact", "m", "sum of the radii less distance of the centres", _PHYS,
         "snapshots contacts"),
        *_loads("contact", grain="first grain"),
        ("torque_i", "contact xyz", "N m", "torque on the first grain", _PHYS,
         "snapshots contacts forces"),
        ("torque_j", "contact xyz", "N m", "torque on the second grain", _PHYS,
         "snapshots contacts forces"),
    ],
    "wall_contacts": [
        ("grain", "wall_contact", "1", "grain", "", "walls snapshots contacts"),
        ("wall", "wall_contact", "1", "number of the wall, from 0: " + ", ".join(WALLS)
         + ", tube, surfaces", "", "walls snapshots contacts"),
        ("pointer", "wall_contact xyz", "1", "contact pointer fixed in the grain", _PHYS,
         "walls snapshots contacts"),
        ("foot", "wall_contact xyz", "m", "point of the wall where the grain touched", _PHYS,
         "walls snapshots contacts"),
        ("twist", "wall_contact", "rad", "twisting angle", _PHYS, "walls snapshots contacts"),
        ("approach", "wall_contact", "m/s", "speed of approach in the last half step", "",
         "walls snapshots contacts"),
        ("overlap", "wall_contact", "m", "radius less distance of the centre from the wall",
         _PHYS, "walls snapshots contacts"),
        *_loads("wall_contact", line="normal of the wall"),
        ("torque", "wall_contact xyz", "N m", "torque on the grain", _PHYS,
         "walls snapshots contacts forces"),
    ],
    "sphere_contacts": [
        ("grain", "sphere_contact", "1", "grain", "", "sphere snapshots contacts"),
        ("overlap", "sphere_contact", "m", "sum of the radii less distance of the centres", _PHYS,
         "sphere snapshots contacts"),
        *_loads("sphere_contact"),
        ("torque", "sphere_contact xyz", "N m", "torque on the grain", _PHYS,
         "sphere snapshots contacts forces"),
    ],
}  # fmt: skip

VARIABLES = {v.key: v for v in declare_variables(_TABLE, _TYPES, _COUNTS)}


def variables_of(model):
    """Variables of the contact history that registered effects of a ContactModel declare."""
    history, out = own_history(model), ()
    for row, needs in _KINDS.items():
        features = f"{needs}snapshots contacts"
        rows = [
            (h.result, f"{row} xyz" if h.components == 3 else row, h.unit, h.meaning, "", features)
            for h in history
        ]
        out += tuple(replace(v, history=True) for v in declare(f"{row}s", rows))
    return out


def own_history(model):
    """History of registered effects that the result has, beside that of all models."""
    return [
        h for h in model.history.values() if h.result and f"contacts/{h.result}" not in VARIABLES
    ]
