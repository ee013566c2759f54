"""End of a stage: at a step that is known beforehand, or by a condition on a record.

A pressure or stress that a stop condition names is tested between two records as well, since it may
rise many times over from one to the next where dust is loaded again. What counts is the mean since
the last record, which the record that ends the stage has. It scatters more than that of a whole
interval: its standard error follows from the changes between successive tests, which a steady rise
adds little to, and a stage ends where the mean exceeds a threshold by SIGMAS of it: by chance less
often than at a record. A filling factor is tested there too where a controlled load moves the
walls, and no step is known for it; so is the displacement of a surface.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from dusttaichi.domain.clock import NEVER
from dusttaichi.domain.servo import EVEN, WALL
from dusttaichi.results.variables import LABELS
from dusttaichi.running.ledger import turnover
from dusttaichi.running.state import Tension

if TYPE_CHECKING:
    from dusttaichi.domain.clock import Clock
    from dusttaichi.domain.domain import Domain
    from dusttaichi.method import Engine, Measurement
    from dusttaichi.running.state import RunState
    from dusttaichi.scene.stage import StagePlan
    from dusttaichi.scene.stop import Limits


AVERAGED = 10  # records over which stop.past_maximum, plateau and creep average
TESTS, LEAST_STEPS = 32, 200  # tests of an interval between records, and steps between two
FEWEST, SIGMAS = 4, 3.0  # of them, and standard errors that put a mean beyond a threshold
OVERSHOOT = 0.05  # relative one from which the reason of an end names it
DEVIATION = 0.02  # largest relative deviation of a settled load from the controlled one
TOP = LABELS["wall"].index("top")
SURFACE_LOADS = {"force": "surface_load", "pressure": "surface_pressure"}  # of stop, of records


class End:
    """The end of the present stage: its latest step, and the reason.

    plan: StagePlan. state: RunState, with the reason of the end. pressure [Pa]: of the last record,
    or None.
    """

    def __init__(self, plan: StagePlan, clock: Clock, state: RunState, step: int) -> None:
        self.plan, self.clock, self.state = plan, clock, state
        self.pressure: float | None = None
        self.step, self.reason = clock.last_step(plan.stop)
        if state.end_reason:
            self.step, self.reason = step, state.end_reason

    def check(
        self,
        record: Mapping[str, Any],
        sim: Engine,
        measurement: Measurement,
        *,
        bounds: bool = True,
    ) -> None:
        """End the stage if its record meets a stop condition; measurement: of the record.

        bounds: its pressure and stress may end the stage.
        """
        domain, step = sim.domain, sim.step
        self.pressure = pressure(record, domain)
        reasons = [self._check_bounds(record, domain)] if bounds else []
        reasons += [self._check_filling_factor(record, domain), self._check_rest(measurement, sim)]
        reasons.append(self._check_displacements(domain, step))
        reasons += [
            self._check_maximum(record, step),
            self._check_plateau(),
            self._check_creep(record, domain),
        ]
        if reason := next(filter(None, reasons), ""):
            self.step, self.reason, self.state.end_reason = step, reason, reason

    def put_off(self) -> None:
        """Let the stage continue in spite of its conditions."""
        self.step, self.reason, self.state.end_reason = NEVER, "", ""

    def _check_bounds(self, record: Mapping[str, Any], domain: Domain) -> str:
        """Reason of the end of a stage by a pressure or stress of a record, or ""."""
        reason = ""
        for name, value, bounds in self.bounded(record, domain):
            if level := bounds.describe_crossing(value):
                reason = f"{name} {level}"
                if (overshoot := bounds.overshoot(value)) > OVERSHOOT:
                    reason += f", passed by {100.0 * overshoot:.0f} %: {bounds.describe(value, 4)}"
        return reason

    def _check_filling_factor(self, record: Mapping[str, Any], domain: Domain) -> str:
        """Reason of the end of a stage at a filling factor that no step is known for, or ""."""
        stop, clock = self.plan.stop, self.clock
        if stop.filling_factor is None or (clock.bounded and not clock.controlled):
            return ""
        servo = domain.servo
        grows = domain.wall_speed > 0.0 if servo is None else servo.presses
        sign = 1.0 if grows else -1.0
        reached = sign * (record["filling_factor"] - stop.filling_factor) >= 0.0
        return f"filling factor {stop.filling_factor:.4g}" if reached else ""

    def _check_displacements(self, domain: Domain, step: int) -> str:
        """Reason of the end of a stage by the displacement of a surface, or ""."""
        for name, bounds in self.plan.stop.surfaces.items():
            if bounds.displacement is None or domain.surfaces is None:
                continue
            shift = domain.surfaces.displacement_of(name, domain.dt * step) * domain.units("m")
            if level := bounds.displacement.describe_crossing(shift):
                return f"displacement of {name} {level}"
        return ""

    def _check_maximum(self, record: Mapping[str, Any], step: int) -> str:
        """Reason of the end of a stage whose tension has passed its maximum, or ""."""
        drop, tensions = self.plan.stop.past_maximum, self.state.tension
        if drop is None:
            return ""
        if not has_passed_maximum(tensions, self._measure_tension(record, step), drop):
            return ""
        return f"the tension has fallen by {drop:.0%} below its largest value"

    def bounded(self, record: Mapping[str, Any], domain: Domain) -> list[tuple[str, float, Limits]]:
        """(name, value [SI], Limits) of the loads and stresses of a record that may end it."""
        stop = self.plan.stop
        out: list[tuple[str, float, Limits]] = []
        bounds, measured = stop.pressure_bounds, pressure(record, domain)
        if bounds is not None and measured is not None:
            out.append(("pressure", measured, bounds))
        for name, bounds in stop.stress.components.items() if stop.stress is not None else ():
            out.append((f"stress {name}", component(record["stress"], name), bounds))
        names = () if domain.surfaces is None else domain.surfaces.names
        for surface, limits in stop.surfaces.items():
            n = names.index(surface)
            for name, bound in limits.loads.items():
                value = float(record[SURFACE_LOADS[name]][n])
                out.append((f"{name} of {surface}", value, bound))
        return out

    @property
    def tested(self) -> bool:
        """True where a pressure, a stress or a filling factor under load may end it at a test."""
        stop, clock = self.plan.stop, self.clock
        dense = stop.filling_factor is not None and clock.bounded and bool(clock.controlled)
        named = stop.pressure is not None or stop.stress is not None
        return dense or named or bool(stop.surfaces)

    def reached_between(self, record: Mapping[str, Any], sim: Engine) -> bool:
        """True if means since the last record, in `record`, or its filling factor cross a bound.

        A mean must be surely beyond it; a filling factor has no scatter.
        """
        if self._check_filling_factor(record, sim.domain):
            return True
        if self._check_displacements(sim.domain, sim.step):
            return True
        bounded = self.bounded(record, sim.domain)
        tests = self.state.tests
        tests.append((sim.step, [value for _, value, _ in bounded]))
        if len(tests) < FEWEST or not bounded:
            return False
        steps = np.diff([self.state.opened, *(step for step, _ in tests)])[:, None]
        means = np.array([values for _, values in tests])
        sums = means * np.cumsum(steps, axis=0)
        interval_means = np.diff(sums, axis=0, prepend=0.0) / steps  # between two tests
        variance = 0.5 * np.mean(np.diff(interval_means, axis=0) ** 2, axis=0)
        error = np.sqrt(variance / len(interval_means))
        low, high = means[-1] - SIGMAS * error, means[-1] + SIGMAS * error
        return any(
            limits.surely_crossed(lowest, highest) and limits.describe_crossing(latest)
            for (*_, limits), lowest, highest, latest in zip(
                bounded, low, high, interval_means[-1], strict=True
            )
        )

    def _check_rest(self, m: Measurement, sim: Engine) -> str:
        """Reason of the end of a stage at rest, or ""; m: Measurement of the record."""
        limit = self.plan.stop.rest
        if limit is None:
            return ""
        binds = getattr(sim, "binds", True)  # see method.Engine
        scale = m.bound if binds else turnover(m, self.state.start)[1]
        of = "the binding energy" if binds else "the energy that has gone through"
        at_rest = m.kinetic < limit * scale
        return f"at rest: kinetic energy below {limit:.3g} of {of}" if at_rest else ""

    def _check_plateau(self) -> str:
        """Reason of the end of a stage whose pressure no longer changes, or ""."""
        tolerance = self.plan.stop.plateau
        if tolerance is None or self.pressure is None:
            return ""
        if not plateau(self.state.pressures, self.pressure, tolerance):
            return ""
        return f"plateau: the pressure changes by less than {tolerance:.3g}"

    def _check_creep(self, record: Mapping[str, Any], domain: Domain) -> str:
        """Reason of the end of a stage whose creep under load has stopped, or ""."""
        if self.plan.stop.creep is None:
            return ""
        point = [float(record["time"]), float(np.log(record["filling_factor"]))]
        point.append(self._measure_relative_load(record, domain))
        last = [*self.state.settling, point][-AVERAGED:]
        self.state.settling = last
        if len(last) < AVERAGED:
            return ""
        (begin, first, _), (end, latest, _) = last[0], last[-1]
        loaded = abs(np.mean([load for _, _, load in last]) - 1.0) <= DEVIATION
        settled = abs(latest - first) <= self.plan.stop.creep * (end - begin)
        return f"settled: creep below {self.plan.stop.creep:.3g} s^-1" if loaded and settled else ""

    def _measure_relative_load(self, record: Mapping[str, Any], domain: Domain) -> float:
        """Load of a record over the controlled one."""
        servo = domain.servo
        assert servo is not None, "the checks refuse creep without a controlled load"
        loads: list[Any]
        if servo.mode == WALL:
            loads = [record["pressure"][TOP]]
        elif servo.mode == EVEN:
            loads = [pressure(record, domain)]
        else:
            loads = [-record["stress"][n, n] for n in servo.axes]
        return float(np.sum(loads) / domain.units("Pa") / np.sum(servo.load))

    def _measure_tension(self, record: Mapping[str, Any], step: int) -> float:
        """Tension of a record along the axis that strains most [Pa]."""
        if "stress" not in record:
            return -float(record["pressure"][TOP])
        lengths, first_lengths = (np.array(self.clock.lengths(s)) for s in (step, self.clock.first))
        axis = int(np.argmax(np.abs(lengths / first_lengths - 1.0)))
        return float(record["stress"][axis, axis])


def pressure(record: Mapping[str, Any], domain: Domain) -> float | None:
    """Pressure of a record [Pa]: on the top wall, else of the cell; None without either."""
    if domain.has_top and "pressure" in record:
        return float(record["pressure"][TOP])
    return -float(np.trace(record["stress"])) / 3.0 if "stress" in record else None


def component(stress: NDArray[np.float64], name: str) -> float:
    """Component such as "xy" of a stress [Pa] (3, 3), of shear the mean with its mirror image."""
    a, b = ("xyz".index(axis) for axis in name)
    return 0.5 * float(stress[a, b] + stress[b, a])


def plateau(last: list[float], pressure: float, tolerance: float) -> bool:
    """True if the mean pressure [Pa] changes by at most a tolerance between two sets of records.

    tolerance: relative. last: the pressures so far, to which the new one is added.
    """
    last[:] = [*last, pressure][-2 * AVERAGED :]
    earlier, later = (np.mean(records) for records in (last[:AVERAGED], last[-AVERAGED:]))
    return len(last) == 2 * AVERAGED and bool(abs(later - earlier) <= tolerance * abs(earlier))


def has_passed_maximum(tensions: Tension, tension: float, drop: float) -> bool:
    """True once the average tension [Pa] has fallen by a fraction `drop` below its largest."""
    tensions.last = [*tensions.last, tension][-AVERAGED:]
    tensions.count += 1
    if tensions.count < AVERAGED:
        return False
    mean = float(np.mean(tensions.last))
    tensions.largest = max(tensions.largest, mean)
    is_tensile = tensions.largest > 0.0 and tensions.count >= 2 * AVERAGED
    return is_tensile and mean < (1.0 - drop) * tensions.largest
