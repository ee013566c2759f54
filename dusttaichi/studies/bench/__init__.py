"""Speed, start and memory of the simulation, with LAMMPS beside it: what `dust bench` prints.

`main` measures and returns a Table. It imports no Taichi: every configuration runs in a process
of its own (worker.py), on samples that are made once and kept (sample.py).
"""

from dusttaichi.studies.bench.measure import command, main
from dusttaichi.studies.bench.table import Row, Start, Table

__all__ = ["Row", "Start", "Table", "command", "main"]
