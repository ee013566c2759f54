"""Snapshots in the formats that other programs read: ParaView, OVITO, ASE, LAMMPS."""

from dusttaichi.export.export import export

__all__ = ["export"]
