"""When a stage ends: at a step that is known beforehand, or where a record says so."""

import numpy as np

from dusttaichi import units
from dusttaichi.domain.servo import EVEN, WALL
from dusttaichi.names import AXES, NEVER, WALLS
from dusttaichi.run.ledger import turnover
from dusttaichi.run.state import Tension

TENSIONS = 10  # points of the series that stop.past_maximum, plateau and creep look at
HELD = 0.02  # share by which a load may differ from what is held
TOP = WALLS.index("top")


class End:
    """The end of the present stage: its step at the latest, and why.

    plan: StagePlan. state: RunState, which keeps what has ended a stage. pressure [Pa]: of the last
    record, or None.
    """

    def __init__(self, plan, clock, state, step):
        self.plan, self.clock, self.state, self.pressure = plan, clock, state, None
        self.step, self.reason = clock.last_step(plan.stop)
        if state.ended:
            self.step, self.reason = step, state.ended

    def check(self, record, sim, measurement):
        """End the stage now if its record meets a condition that only records tell.

        measurement: the Measurement that belongs to the record.
        """
        domain, step = sim.domain, sim.step
        self.pressure = pressure(record, domain)
        reason = self._reached(record, domain, step) or self._settled(
            measurement, getattr(sim, "binds", True)
        )
        reason = reason or self._crept(record, domain)
        if reason:
            self.step, self.reason, self.state.ended = step, reason, reason

    def put_off(self):
        """The stage goes on, whatever its conditions say."""
        self.step, self.reason, self.state.ended = NEVER, "", ""

    def _reached(self, record, domain, step):
        stop, reason = self.plan.stop, ""
        if stop.pressure is not None and (level := stop.pressure_bounds.crossed(self.pressure)):
            reason = f"pressure {level}"
        for name, bounds in stop.stress.given.items() if stop.stress is not None else ():
            if level := bounds.crossed(component(record["stress"], name)):
                reason = f"stress {name} {level}"
        if stop.filling_factor is not None and (self.clock.held or not self.clock.bounded):
            grows = domain.servo.presses if self.clock.held else domain.wall_speed > 0.0
            way = 1.0 if grows else -1.0
            if way * (record["filling_factor"] - stop.filling_factor) >= 0.0:
                reason = f"filling factor {stop.filling_factor:.4g}"
        if stop.past_maximum is not None and past_maximum(
            self.state.tension, self._tension(record, step) / units.PRESSURE, stop.past_maximum
        ):
            share = f"{stop.past_maximum:.0%}"
            reason = f"the tension has fallen by {share} below its largest value"
        return reason

    def _settled(self, m, binds):
        """Why the stage ends because nothing happens any more, or ""; binds: method.Simulation."""
        stop, state = self.plan.stop, self.state
        if stop.rest is not None:
            scale = m.bound if binds else turnover(m, state.start)[1]
            if m.kinetic < stop.rest * scale:
                of = "what the bonds hold" if binds else "the energy that has gone through"
                return f"at rest: kinetic energy below {stop.rest:.3g} of {of}"
        if stop.plateau is not None and plateau(state.pressures, self.pressure, stop.plateau):
            return f"plateau: the pressure changes by less than {stop.plateau:.3g}"
        return ""

    def _crept(self, record, domain):
        """Why the stage ends because what is under load has settled, or ""."""
        if self.plan.stop.creep is None:
            return ""
        point = [float(record["time"]), float(np.log(record["filling_factor"]))]
        last = [*self.state.settling, [*point, self._load_held(record, domain)]][-TENSIONS:]
        self.state.settling = last
        if len(last) < TENSIONS:
            return ""
        (begin, first, _), (end, now, _) = last[0], last[-1]
        held = abs(np.mean([load for _, _, load in last]) - 1.0) <= HELD
        settled = abs(now - first) <= self.plan.stop.creep * (end - begin)
        return f"settled: creep below {self.plan.stop.creep:.3g} s^-1" if held and settled else ""

    def _load_held(self, record, domain):
        """Load of a record over that which is held."""
        servo = domain.servo
        if servo.kind == WALL:
            own = [record["pressure"][TOP]]
        elif servo.kind == EVEN:
            own = [pressure(record, domain)]
        else:
            own = [-record["stress"][n, n] for n in servo.axes]
        return float(np.sum(own) / units.PRESSURE / np.sum(servo.load))

    def _tension(self, record, step):
        """Tension of a record along the axis that strains most [Pa]."""
        if "stress" not in record:
            return -float(record["pressure"][TOP])
        now, before = (np.array(self.clock.lengths(s)) for s in (step, self.clock.first))
        axis = int(np.argmax(np.abs(now / before - 1.0)))
        return float(record["stress"][axis, axis])


def pressure(record, domain):
    """Pressure of a record [Pa]: on the top wall, else of the cell; None without either."""
    if domain.has_top and "pressure" in record:
        return float(record["pressure"][TOP])
    return -float(np.trace(record["stress"])) / 3.0 if "stress" in record else None


def component(stress, name):
    """Component such as "xy" of a stress [Pa] (3, 3), of shear the mean with its mirror image."""
    a, b = (AXES.index(axis) for axis in name)
    return 0.5 * float(stress[a, b] + stress[b, a])


def plateau(last, pressure, share):
    """True once the mean pressure of the last points [Pa] differs by no more than `share` from that
    of as many before them. last: the pressures so far, which the new one is added to."""
    last[:] = [*last, pressure][-2 * TENSIONS :]
    before, after = (np.mean(part) for part in (last[:TENSIONS], last[-TENSIONS:]))
    return len(last) == 2 * TENSIONS and bool(abs(after - before) <= share * abs(before))


def past_maximum(tensions: Tension, tension, share):
    """True once the tension [kPa], averaged over the last points, has fallen by `share` below the
    largest such average of the stage."""
    tensions.last = [*tensions.last, tension][-TENSIONS:]
    tensions.count += 1
    if tensions.count < TENSIONS:
        return False
    mean = float(np.mean(tensions.last))
    tensions.most = max(tensions.most, mean)
    pulled = tensions.most > 0.0 and tensions.count >= 2 * TENSIONS
    return pulled and mean < (1.0 - share) * tensions.most
