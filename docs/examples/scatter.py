"""Scatter of p_m between the replicas of an ensemble or of each point of a sweep."""

from dusttaichi.analysis import numbers
from dusttaichi.analysis.ensemble_tables import point_labels
from dusttaichi.analysis.numbers import Statistics


def table(data):
    """(columns, sentences) of a dataset of `analysis.gather`; of both none without p_m."""
    if "p_m" not in data:
        return [], []
    relative_scatter = (data.std_p_m / data.mean_p_m).values.ravel()
    columns = [
        ("point", [label or "all" for label in point_labels(data)]),
        ("scatter of p_m", [f"{value:.1%}" for value in relative_scatter]),
    ]
    return columns, [f"largest: {relative_scatter.max():.1%}"]


numbers.register(Statistics(name="scatter", title="scatter between replicas", table=table))
