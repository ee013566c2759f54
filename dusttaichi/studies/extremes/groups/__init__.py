"""Groups of the map: functions of `quick` that return their cells."""

from dusttaichi.studies.extremes.groups import grains
from dusttaichi.studies.extremes.groups.continuum import continuum
from dusttaichi.studies.extremes.groups.materials import materials, single_materials
from dusttaichi.studies.extremes.groups.states import special

GROUPS = {
    "time step": grains.time_step, "materials": materials, "one number": single_materials,
    "wall speeds": grains.wall_speeds, "size ratios": grains.size_ratios, "special states": special,
    "filling factors": grains.filling_factors, "long runs": grains.long_runs,
    "precisions": grains.precisions, "continuum": continuum,
}  # fmt: skip
