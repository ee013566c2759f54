"""The variables of the result of a continuum, each declared once."""

from dusttaichi.results import roles
from dusttaichi.results.variables import declare_variables

_INTEGERS = {"role": "i4", "body": "i4", "substeps": "i8", "material": "i4"}
_PHYS = "docs, Continuum"

# Features: "walls" (any face that moves particles), "height" (a finite one), "stages", "bodies"
# (rigid or elastic ones), "heat", "damage", "materials" (several). In two dimensions masses,
# energies and forces are per metre of depth.
_TABLE = {
    "series": [
        "time",
        "step",
        "height",
        "stage",
        ("substeps", "time", "1", "time steps, several in an output step, since the start", "", ""),
        ("kinetic", "time", "J", "kinetic energy of dust and rigid bodies", "", ""),
        ("gravity_energy", "time", "J", "energy in the field of gravity, that of the "
         "bodies themselves included", "", ""),
        ("elastic_energy", "time", "J", "elastic energy, p^2/2K + S:S/4mu per volume", _PHYS, ""),
        ("loss", "time channel", "J", "energy lost since the start", _PHYS, ""),
        ("work", "time", "J", "work of moving faces on the dust since the start", _PHYS, ""),
        ("force_work", "time", "J", "work of forces from outside since the start, without their "
         "losses", _PHYS, "outside"),
        "energy_residual",
        "energy_residual_relative",
        ("momentum", "time xyz", "kg m/s", "momentum of dust and free rigid bodies", "", ""),
        ("angular_momentum", "time xyz", "kg m^2/s", "angular momentum of them about 0", "", ""),
        ("body_position", "time rigid xyz", "m", "centre of a rigid or elastic body", "", "bodies"),
        ("body_velocity", "time rigid xyz", "m/s", "its velocity", "", "bodies"),
        ("body_spin", "time rigid xyz", "rad/s", "its angular velocity", "", "bodies"),
        ("body_force", "time rigid xyz", "N", "force on it, gravity included, average since the "
         "last entry", "", "bodies"),
        "wall_force",
        "pressure",
        ("pressure_mean", "time", "Pa", "pressure of the dust, mean over its volume", "", ""),
        ("stress_mean", "time component", "Pa", "stress of the dust, mean over its volume, "
         "positive in tension", "", ""),
        ("filling_factor_mean", "time", "1", "filling factor of the dust, mean over its mass", "",
         ""),
        ("largest_filling_factor", "time", "1", "largest filling factor", "", ""),
        ("damage_mean", "time", "1", "damage of the dust, mean over its mass", _PHYS, "damage"),
        ("heat", "time", "J", "heat that the dust has got since the start: what compaction, "
         "tension, shear and both viscosities have dissipated in it", _PHYS, "heat"),
        ("temperature_mean", "time", "K", "temperature of the dust, mean over its heat capacity",
         _PHYS, "heat"),
        ("largest_temperature", "time", "K", "largest temperature of the dust", _PHYS, "heat"),
        ("largest_speed", "time", "m/s", "speed of the fastest particle", "", ""),
        "wall_clock",
    ],
    "snapshots": [
        "snapshot_time",
        "step",
        ("position", "snapshot particle xyz", "m", "place of the particle", "", ""),
        ("velocity", "snapshot particle xyz", "m/s", "its velocity", "", ""),
        ("density", "snapshot particle", "kg/m^3", "its density", "", ""),
        ("reference_density", "snapshot particle", "kg/m^3", "density without pressure on its "
         "present elastic path", _PHYS, ""),
        ("pressure", "snapshot particle", "Pa", "its pressure", "", ""),
        ("deviator", "snapshot particle component", "Pa", "deviator of its stress", "", ""),
        ("damage", "snapshot particle", "1", "its damage: share that carries no tension and no "
         "deviator", _PHYS, "damage"),
        ("temperature", "snapshot particle", "K", "its temperature", _PHYS, "heat"),
        ("material", "particle", "1", "number of its material: 0 that of the scene, then its "
         "`materials`", "", "materials"),
        ("solid_density", "particle", "kg/m^3", "density of the solid of its material", "",
         "materials"),
        ("mass", "particle", "kg", "its mass", "", ""),
        ("role", "particle", "1", roles.MEANING, "", ""),
        ("body", "particle", "1", "number of its body", "", ""),
    ],
}  # fmt: skip

VARIABLES = declare_variables(_TABLE, _INTEGERS)
