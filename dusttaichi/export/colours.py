"""Colours of grains as viewers of other programs show them: those of this program's pictures."""

import numpy as np

from dusttaichi.plots.grains import appearance_of, bodies_of, colouring_of


def colours_of(run, frame):
    """Colours of the grains of a Frame, (N, 3) of 0 to 1: of a collision by body, else by
    coordination number, without contacts by height."""
    color = "body" if run.collides else "height" if frame.contacts is None else "coordination"
    appearance = appearance_of([frame], color, "front", bodies=bodies_of(run, color))
    return np.asarray(colouring_of(frame, appearance, None).colours)
