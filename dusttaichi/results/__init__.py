"""The result file result.nc: variables declared once, and a crash-safe writer.

NetCDF-4 with CF conventions. The root group is the time series; /profiles, /snapshots, /contacts,
/wall_contacts and /sphere_contacts hold what their names say, and groups of the user what he has
recorded. Contacts are contiguous ragged arrays: the rows of all snapshots one after the other,
`contact_count` of them for each snapshot. All values are SI.
"""

from dusttaichi.results.provenance import provenance
from dusttaichi.results.seal import opened
from dusttaichi.results.variables import (
    COMMON,
    Variable,
    common,
    declare,
    reference_energy,
    select,
)
from dusttaichi.results.writer import Writer

__all__ = [
    "COMMON",
    "Variable",
    "Writer",
    "common",
    "declare",
    "opened",
    "provenance",
    "reference_energy",
    "select",
]
