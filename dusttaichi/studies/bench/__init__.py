"""Speed, start and memory of the simulation, with LAMMPS beside it: what `dust bench` prints.

`main` measures and returns a Table. It imports no Taichi: every configuration runs in a worker
process of its own (task), on samples that are made once and kept (sample).
"""

from dusttaichi.studies.bench.measure import main
from dusttaichi.studies.bench.table import Row, Start, Table

__all__ = ["Row", "Start", "Table", "main"]
