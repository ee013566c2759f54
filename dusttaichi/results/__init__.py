"""The result file result.nc: variables declared once, and a crash-safe writer.

NetCDF-4 with CF conventions. The root group is the time series; further groups are /profiles,
/snapshots, /contacts, /wall_contacts, /sphere_contacts and those recorded by the user. Contacts are
contiguous ragged arrays: the rows of all snapshots one after the other, `contact_count` of them for
each snapshot. All values are SI.
"""

from dusttaichi.results.integrity import open_result
from dusttaichi.results.provenance import provenance
from dusttaichi.results.variables import (
    COMMON,
    Variable,
    common,
    declare,
    reference_energy,
    select_variables,
)
from dusttaichi.results.writer import Writer

__all__ = [
    "COMMON",
    "Variable",
    "Writer",
    "common",
    "declare",
    "open_result",
    "provenance",
    "reference_energy",
    "select_variables",
]
