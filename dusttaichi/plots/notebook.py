"""Figures that notebooks show."""

from __future__ import annotations

import base64
import io

from matplotlib.figure import Figure

SCREEN = 96.0  # pixels an inch of a figure in a notebook


class ShownFigure(Figure):
    """A matplotlib Figure that a notebook shows as a PNG, also without its inline backend."""

    def _repr_png_(self) -> tuple[bytes, dict[str, int]]:
        """(PNG, its size on the screen)."""
        return render_png(self)


class ShownFigures(dict[str, Figure]):
    """Figures by name that a notebook shows below one another."""

    def _repr_html_(self) -> str:
        shown = []
        for name, figure in self.items():
            png, size = render_png(figure)
            url = f"data:image/png;base64,{base64.b64encode(png).decode()}"
            image = f'<img src="{url}" width="{size["width"]}" alt="{name}">'
            shown.append(f"<figure><figcaption>{name}</figcaption>{image}</figure>")
        return "".join(shown)


def render_png(figure: Figure) -> tuple[bytes, dict[str, int]]:
    """(PNG of a figure, its `width` and `height` on the screen in pixels)."""
    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi="figure")
    width, height = (round(SCREEN * inches) for inches in figure.get_size_inches())
    return stream.getvalue(), {"width": width, "height": height}
