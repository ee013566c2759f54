"""Figures of the continuum; its Method names them."""

from dusttaichi.plots.registry import in_package

FIGURES = tuple(function.row for function in in_package(__name__).values())
