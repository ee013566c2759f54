"""Colours of grains for viewers of other programs, those of the pictures of this program."""

import numpy as np

from dusttaichi.plots.grains import appearance_of, bodies_of, colouring_of


def colours_of(run, frame):
    """Colours of the grains of a Frame, (N, 3) of 0 to 1.

    By body for a collision, else by coordination number, or height without contacts.
    """
    color = "body" if run.collides else "height" if frame.contacts is None else "coordination"
    appearance = appearance_of([frame], color, "front", bodies=bodies_of(run, color))
    return np.asarray(colouring_of(frame, appearance, None).colours)
