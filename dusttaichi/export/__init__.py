"""Snapshots in the formats that other programs read: ParaView, OVITO, ASE, LAMMPS."""

from dusttaichi.export.export import FORMATS, export

__all__ = ["FORMATS", "export"]
