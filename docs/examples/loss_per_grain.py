"""Energy that a grain loses on average, and a figure of it over time."""

from dusttaichi.analysis import compute_ledger, numbers
from dusttaichi.analysis.numbers import Family, Observable
from dusttaichi.plots import figure, register, style


def applies(run):
    return bool(run.grains) and "loss" in run.series


def lost(run):
    """Energy lost per grain since the start [J], (times,)."""
    return sum(compute_ledger(run).losses.values()) / run.grains


numbers.register(
    Family(
        name="loss per grain",
        title="energy that grains lose",
        order=5,
        applies=applies,
        numbers=(
            Observable(
                name="loss_per_grain",
                title="energy lost per grain",
                unit="J",
                value=lambda run: float(lost(run)[-1]),
                figure="loss_per_grain",
            ),
        ),
    )
)


@figure("Energy lost per grain", applies=applies)
def loss_per_grain(run):
    drawn, (axes,) = style.create_figure()
    axes.plot(run.series.time * 1e6, lost(run) * 1e15)
    axes.set(xlabel="time (µs)", ylabel="energy lost per grain (fJ)")
    return drawn


register(loss_per_grain)
