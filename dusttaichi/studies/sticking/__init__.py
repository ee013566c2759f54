"""Sticking speed and restitution of a scene's collision: many speeds side by side in one batch."""

from dusttaichi.studies.sticking.collision import closed_form
from dusttaichi.studies.sticking.restitution import map_rows, restitution_map, save_map
from dusttaichi.studies.sticking.search import TOGETHER, Sticking, rows, speed_of, sticking

__all__ = [
    "TOGETHER",
    "Sticking",
    "closed_form",
    "map_rows",
    "restitution_map",
    "rows",
    "save_map",
    "speed_of",
    "sticking",
]
