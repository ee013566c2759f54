"""The result file result.nc: variables declared once, and a crash-safe writer.

NetCDF-4 with CF conventions. The root group is the time series; /profiles, /snapshots, /contacts
and /wall_contacts hold what their names say. Contacts are contiguous ragged arrays: the rows of
all snapshots one after the other, `contact_count` of them for each snapshot. All values are SI.
"""

from dusttaichi.names import CHANNELS, SPRINGS, WALLS
from dusttaichi.results.provenance import provenance
from dusttaichi.results.variables import VARIABLES, Variable, reference_energy, select
from dusttaichi.results.writer import Writer

__all__ = [
    "CHANNELS",
    "SPRINGS",
    "VARIABLES",
    "WALLS",
    "Variable",
    "Writer",
    "provenance",
    "reference_energy",
    "select",
]
