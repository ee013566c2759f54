"""Grain-by-grain simulation of porous dust with JKR contacts."""

__version__ = "0.1.0"
