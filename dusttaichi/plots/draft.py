"""The word on figures of drafts."""

from functools import partial

from dusttaichi.analysis.draft import draft_of
from dusttaichi.plots import style


def marked(drawings, run):
    """Functions that draw, by name, each with the word on its figure where the Run is a draft."""
    text = draft_of(run.scene)
    if not text:
        return drawings
    return {name: partial(_drawn, draw, text) for name, draw in drawings.items()}


def _drawn(draw, text):
    figure = draw()
    if figure is not None:
        place = {"ha": "right", "va": "bottom", "fontsize": 7, "color": style.GREY}
        figure.text(0.995, 0.005, text, **place)
    return figure
