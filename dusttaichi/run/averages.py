"""Averages of the time series: differences of sums over a span that ends at the record."""

from dusttaichi.method import Window


def open_window(state, sim):
    """The average of the next record begins at this step."""
    state.opened, state.sums = sim.step, sim.sums()


def close_window(state, sim):
    """The Window that ends at this step; the next one opens."""
    now = sim.sums()
    window = Window(state.sums, now, (sim.step - state.opened) * sim.dt)
    state.opened, state.sums = sim.step, now
    return window
