"""Figures of the continuum; its Method names them."""

from dusttaichi.plots.figure_registry import find_figures

FIGURES = tuple(function.row for function in find_figures(__name__).values())
