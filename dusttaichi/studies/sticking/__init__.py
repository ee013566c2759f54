"""Sticking speed and restitution of the collision of a scene, with many speeds in one batch."""

from dusttaichi.names import exported
from dusttaichi.studies.sticking.collision import closed_form
from dusttaichi.studies.sticking.restitution import map_rows, restitution_map, save_map
from dusttaichi.studies.sticking.search import TOGETHER, Sticking, rows, speed_of, sticking

__all__ = ["TOGETHER", *exported(globals())]
