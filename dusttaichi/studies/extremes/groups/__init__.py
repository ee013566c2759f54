"""Groups of the map: functions of `quick` that return their cells."""

from dusttaichi.studies.extremes.groups.continuum import continuum
from dusttaichi.studies.extremes.groups.materials import materials, single_materials
from dusttaichi.studies.extremes.groups.precisions import precisions
from dusttaichi.studies.extremes.groups.sizes import filling_factors, size_ratios
from dusttaichi.studies.extremes.groups.speeds import wall_speeds
from dusttaichi.studies.extremes.groups.states import special
from dusttaichi.studies.extremes.groups.steps import long_runs, time_step

GROUPS = {
    "time step": time_step,
    "materials": materials,
    "one number": single_materials,
    "wall speeds": wall_speeds,
    "size ratios": size_ratios,
    "special states": special,
    "filling factors": filling_factors,
    "long runs": long_runs,
    "precisions": precisions,
    "continuum": continuum,
}
