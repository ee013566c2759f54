"""Figures as the tests read them."""


def legend(axes):
    """Texts of the legend of axes, in them or below."""
    legend_box = axes.get_legend() or axes.figure.legends[0]
    return [text.get_text() for text in legend_box.get_texts()]


def line(axes, label):
    """The line of axes with this label."""
    return next(line for line in axes.lines if line.get_label() == label)
