"""Numbers of every run: its end, its ledger, its size, its wall time."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from dusttaichi.analysis.ledger import Ledger, compute_ledger
from dusttaichi.analysis.load_control import CLOSE, LoadControl, measure_load_control
from dusttaichi.analysis.loads import (
    ControlledLoad,
    StrengthTest,
    measure_controlled_loads,
    measure_shear_tests,
    measure_triaxial_tests,
)
from dusttaichi.analysis.numbers.number_registry import (
    AUTO,
    ENSEMBLES,
    FILE,
    GENERAL,
    Family,
    Observable,
    quiet,
)
from dusttaichi.analysis.texts import format_quantity
from dusttaichi.errors import DustError
from dusttaichi.results.datasets import read_at
from dusttaichi.scene import quantities

if TYPE_CHECKING:
    from dusttaichi.analysis.run import Run


class _FinalState:
    """The last record of a Run, and numbers from its series."""

    def __init__(self, run: Run) -> None:
        self.run, self.grains = run, run.grains
        self.series = run.series if len(run.series.time) else {}

    def __call__(self, name: str, convert: Callable[[Any], Any] = float) -> Any:
        return convert(self.series[name].values[-1]) if name in self.series else None

    @cached_property
    def ledger(self) -> Ledger:
        return compute_ledger(self.run)

    @property
    def pressure(self) -> float | None:
        """Pressure on the top wall [Pa], or None."""
        if "pressure" not in self.series:
            return None
        value = float(read_at(self.series["pressure"], wall="top")[-1])
        return value if np.isfinite(value) else None

    @property
    def rate(self) -> float | None:
        steps, seconds = self("step"), self("wall_clock")
        return steps / seconds if steps and seconds else None

    @property
    def contacts_per_grain(self) -> float | None:
        count = self("contact_count")
        return None if count is None or not self.grains else count / self.grains

    @property
    def missed_loads(self) -> list[tuple[str, float, float]]:
        """(stage, load, prescribed load) [Pa] of loads that their stages do not reach or hold."""
        tests_by_stage: dict[str, tuple[float, ControlledLoad | StrengthTest]] = {
            load.stage: (load.pressure, load) for load in measure_controlled_loads(self.run)
        }
        for tests in (measure_shear_tests, measure_triaxial_tests):
            with suppress(DustError):  # the run has none
                tests_by_stage |= {test.stage: (test.load, test) for test in tests(self.run)}
        return [
            (stage, load, measured.prescribed)
            for stage, (load, measured) in tests_by_stage.items()
            if measured.missed
        ]

    @cached_property
    def load_controls(self) -> list[LoadControl]:
        return measure_load_control(self.run)

    @property
    def load_missed_share(self) -> float | None:
        """Largest share of a stage in which the load was missed, or None."""
        return max((stage.missed_share for stage in self.load_controls), default=None)


def _format_load_control(
    value: Sequence[Mapping[str, Any]], n: Mapping[str, Any]
) -> list[tuple[str, str, str]]:
    """A row of each stage; value: LoadControls as dicts."""
    rows = []
    for load in value:
        surface = f" on {load['surface']}" if load["surface"] else ""
        stage = f"{surface} in {load['stage']}" if load["stage"] else surface
        extremes = f"{load['lowest']:.2f} to {load['highest']:.2f} of it"
        within = f"load within {100.0 * CLOSE:.0f} %{stage}"
        rows.append(
            (within, f"{100.0 * (1.0 - load['missed_share']):.0f} % of the time, {extremes}", "")
        )
    return rows


def _format_missed_loads(
    value: Sequence[tuple[str, float, float]], n: Mapping[str, Any]
) -> list[tuple[str, str, str]]:
    rows = []
    for stage, pressure, prescribed in value:
        texts = [format_quantity(p, "Pa") for p in (pressure, prescribed)]
        title = f"load missed{f' in {stage}' if stage else ''}"
        rows.append((title, "{} instead of {}".format(*texts), ""))
    return rows


def _format_advice(value: str, n: Mapping[str, Any]) -> list[tuple[str, str, str]]:
    pairs = (text.split(": ", 1) for text in value.split("\n"))
    return [(f"set {key}", reason, "") for key, reason in pairs]


def _format_contacts_per_grain(value: float, n: Mapping[str, Any]) -> str:
    coordination = n["coordination_number"]
    remark = (
        ""
        if coordination is None
        else f" (coordination number {coordination:.2f}: each contact counts twice)"
    )
    return f"{value:.2f}{remark}"


def _format_initial_contacts(
    value: Mapping[str, Any], n: Mapping[str, Any]
) -> list[tuple[str, str, str]]:
    correction = value.get("done")
    return [
        ("contacts at the start", value["text"] + (f": {correction}" if correction else ""), "")
    ]


def _format_duration(seconds: float, n: Mapping[str, Any] | None = None) -> str:
    if seconds < 60:
        return f"{seconds:.1f} s"
    minutes, seconds = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours} h {minutes:02d} min" if hours else f"{minutes} min {seconds:02d} s"


END = Family(
    name="end",
    title="every run, at its end",
    order=GENERAL,
    measure=_FinalState,
    numbers=(
        Observable(name="filling_factor", title="filling factor", text="{:.4f}", column=None,
                   value=lambda end: end("filling_factor")),
        quiet("height", "height", "m", value=lambda end: end("height"), sweeps=ENSEMBLES),
        Observable(name="pressure", title="pressure on the top wall", unit="Pa", column=None,
                   text=lambda v, n: f"{v / 1e3:.4g} kPa"),
        Observable(name="missed_loads", title="loads that were missed", unit=None,
                   rows=_format_missed_loads, column=None),
        quiet("load_control", "control of the load, by stages", None,
              rows=_format_load_control, text=AUTO,
              value=lambda end: [asdict(load) for load in end.load_controls] or None),
        quiet("load_missed_share", "largest share of a stage in which a load was missed by more "
              f"than {CLOSE:.0%}", sweeps=ENSEMBLES),
        Observable(name="advice", title="defaults to change", unit=None, rows=_format_advice,
                   value=lambda end: end.run.attrs.get("advice"), column=None),
        Observable(name="ledger_worst", title="largest residual of the energy ledger",
                   text="{:.1e}", value=lambda end: end.ledger.worst,
                   column=("ledger", "{:.0e}", 1), figure="ledger"),
        quiet("ledger_shares", "shares of the losses by channel", None,
              value=lambda end: end.ledger.shares, figure="ledger"),
        quiet("start_contacts", "contacts of a sample of listed grains, at the start", None,
              value=lambda end: end.run.sample.get("touching"), rows=_format_initial_contacts,
              text=AUTO),
        Observable(name="grains", title="grains", text="{:,}", column=("grains", "{:,}", 1),
                   sweeps=FILE),
        Observable(name="contacts", title="contacts", text="{:,}", column=None, sweeps=ENSEMBLES,
                   value=lambda end: end("contact_count", int)),
        Observable(name="contacts_per_grain", title="contacts per grain",
                   text=_format_contacts_per_grain, column=None),
        quiet("coordination_number", "coordination number",
              value=lambda end: end("coordination_number"), sweeps=ENSEMBLES),
        Observable(name="steps", title="steps", text="{:,}", column=None, sweeps=ENSEMBLES,
                   value=lambda end: end("step", int)),
        Observable(name="time", title="simulated time", unit="s", value=lambda end: end("time"),
                   text=lambda v, n: quantities.format(v, "time", 5),
                   column=("time (µs)", "{:.4g}", 1e-6), sweeps=ENSEMBLES),
        Observable(name="wall_time", title="wall time", unit="s", text=_format_duration,
                   column=None, value=lambda end: end("wall_clock"), sweeps=FILE),
        Observable(name="steps_per_second", title="steps per second", unit="1/s", column=None,
                   value=lambda end: end.rate, sweeps=FILE,
                   text=lambda v, n: quantities.format_rate(v)),
    ),
)  # fmt: skip
FAMILIES = (END,)
