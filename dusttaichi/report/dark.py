"""Pictures of figures for dark pages: inverted greys, and unchanged data colours.

Lines and labels are lighter on dark, like those that plotly.js draws (source/figures.js); a map of
numbers keeps its colours, on a ground from which the darkest of them differs.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.collections import Collection
from matplotlib.colors import to_rgba, to_rgba_array
from matplotlib.image import AxesImage
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.text import Text

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.figure import Figure
    from matplotlib.typing import RGBAColorType

GROUND = "#565f6c"  # of axes with a map
GREY = 0.08  # largest difference of the channels of a grey
WHITE = 250  # least value of the paper in a picture of pixels


def darken_colour(colour: Any) -> RGBAColorType:
    """Change a colour that was chosen for white paper for a dark page, as RGBA.

    Greys are inverted, other colours too dark to be seen become lighter.
    """
    *channels, alpha = to_rgba(colour)
    rgb = np.array(channels)
    if np.ptp(rgb) < GREY:
        rgb = 0.9 - 0.85 * rgb
    else:
        luminance = rgb @ np.array([0.2126, 0.7152, 0.0722])
        rgb = rgb + np.clip(1.1 * (0.45 - luminance), 0.0, 0.5) * (1.0 - rgb)
    red, green, blue = np.clip(rgb, 0.0, 1.0)
    return red, green, blue, alpha


def darken(figure: Figure) -> None:
    """Change the colours of a Figure for a dark page, and make its background transparent."""
    figure.patch.set_alpha(0.0)
    grounds = {id(axes.patch) for axes in figure.axes} | {id(figure.patch)}
    for artist in figure.findobj():
        if id(artist) in grounds:
            continue
        if isinstance(artist, (Text, Line2D)):
            artist.set_color(darken_colour(artist.get_color()))
        if isinstance(artist, Line2D):
            for name in ("markerfacecolor", "markeredgecolor"):
                _turn(artist, name)
        elif isinstance(artist, (Patch, Collection)):
            _turn_areas(artist)
        elif isinstance(artist, AxesImage) and artist.get_array() is not None:
            _cut_out(artist)
    for axes in figure.axes:
        maps: list[Collection | AxesImage] = [*axes.collections, *axes.images]
        axes.patch.set(
            facecolor=GROUND, alpha=float(any(_is_map(artist_of_axes) for artist_of_axes in maps))
        )


def _is_map(artist: Collection | AxesImage) -> bool:
    """True for numbers shown by colours."""
    array = artist.get_array()
    return array is not None and np.ndim(array) < 3


def _turn(artist: Artist, name: str) -> None:
    colour = getattr(artist, f"get_{name}")()
    if not (isinstance(colour, str) and colour == "none"):
        getattr(artist, f"set_{name}")(darken_colour(colour))


def _turn_areas(artist: Artist) -> None:
    """Faces and edges of patches and collections but those whose colours are numbers."""
    faces = getattr(artist, "get_array", lambda: None)() is None
    for name in (*["facecolor"] * faces, "edgecolor"):
        colours = to_rgba_array(getattr(artist, f"get_{name}")())
        if len(colours) and np.any(colours[:, 3]):  # else an `alpha` would make them visible
            turned = [darken_colour(colour) for colour in colours]
            getattr(artist, f"set_{name}")(turned if isinstance(artist, Collection) else turned[0])


def _cut_out(image: AxesImage) -> None:
    """Make the white paper of a picture of pixels transparent."""
    pixels = np.asarray(image.get_array())
    if pixels.ndim != 3:
        return
    if pixels.dtype.kind == "f":
        pixels = np.round(255 * pixels).astype(np.uint8)
    alpha = np.where((pixels[..., :3] >= WHITE).all(axis=-1), 0, 255)
    image.set_data(np.dstack([pixels[..., :3], alpha]).astype(np.uint8))
