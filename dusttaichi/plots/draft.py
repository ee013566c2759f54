"""The word on figures of drafts."""

from dusttaichi.analysis.draft import draft_of
from dusttaichi.plots import style


def marked(figure, run):
    """A matplotlib Figure, or None, with the word on it where the Run is a draft."""
    text = draft_of(run.scene)
    if figure is not None and text:
        place = {"ha": "right", "va": "bottom", "fontsize": 7, "color": style.GREY}
        figure.text(0.995, 0.005, text, **place)
    return figure
