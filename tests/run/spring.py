"""A method of its own in some fifty lines: a particle on a spring, which a drag slows down.

Mass 1 pg; the spring's stiffness in nN/um, so that its root is the frequency in 1/us.
"""

from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from dusttaichi import units
from dusttaichi.domain.domain import Domain
from dusttaichi.errors import GuardStop
from dusttaichi.method import Measurement, Method, State
from dusttaichi.results import COMMON, declare
from dusttaichi.scene.fields import Number
from dusttaichi.scene.scene import Scene

NAMES = ("time", "step", "energy_residual", "energy_residual_relative", "wall_clock")
VARIABLES = (
    *(COMMON[name] for name in NAMES),
    *declare("series", [("place", "time", "m", "displacement of the particle", "", "")]),
    *declare("series", [("mean_speed", "time", "m/s", "speed, averaged since then", "", "")]),
    *declare("snapshots", [("snapshot_time", "snapshot", "s", "simulated time", "", "")]),
    *declare("snapshots", [("step", "snapshot", "1", "steps done", "", "")], {"step": "i8"}),
    *declare("snapshots", [("place", "snapshot", "m", "displacement of the particle", "", "")]),
)


class SpringScene(Scene):
    """What the YAML of a spring may say, beside what all scenes say."""

    method: Literal["spring"] = Field(description="what computes the run")
    stiffness: Annotated[float, Number(gt=0)] = Field(1.0, description="of the spring [nN/um]")
    drag: Annotated[float, Number(ge=0)] = Field(0.0, description="force over speed [ng/us]")
    start: Annotated[float, Number()] = Field(1.0, description="first displacement [um]")


class Spring:
    """The particle in motion: place at a step, speed half a step back, what the drag has taken."""

    size, channels, variables = 1, ("drag",), VARIABLES

    def __init__(self, scene, start):
        self.k, self.drag, self.dt = scene.stiffness, scene.drag, scene.numerics.time_step * 1e6
        self.step, self.x, self.lost, self.way = 0, start, 0.0, 0.0
        self.v = -0.5 * self.dt * self._pull(0.0)

    time = property(lambda self: self.step * self.dt)
    domain = property(lambda self: Domain(self.dt))

    def _pull(self, v):
        return -self.k * self.x - self.drag * v

    def advance(self, steps):
        for _ in range(steps):
            before = self.v
            self.v += self.dt * self._pull(before)
            self.lost += self.dt * self.drag * before * 0.5 * (before + self.v)
            self.x, self.way = self.x + self.dt * self.v, self.way + self.dt * abs(self.v)
            self.step += 1

    def drive(self, drive):
        """Nothing moves around it."""

    def measure(self):
        after = self.v + self.dt * self._pull(self.v)
        kinetic, potential = 0.125 * (self.v + after) ** 2, 0.5 * self.k * self.x**2
        # the drag of the next step acts half before now
        lost = self.lost + 0.25 * self.dt * self.drag * self.v * (self.v + after)
        kick = kinetic - 0.5 * self.v * after
        return Measurement(
            kinetic, potential, kinetic + potential, np.array([lost]), lost, kick=kick
        )

    def sums(self):
        return {"way": np.array(self.way)}

    def series(self, measurement, window):
        way = 0.0 if window is None else window.after["way"] - window.before["way"]
        speed = way / window.span if window else 0.0
        return {"place": self.x * units.LENGTH, "mean_speed": speed * units.SPEED}

    def records(self, group):
        time = self.time * units.TIME
        record = {"snapshot_time": time, "step": self.step, "place": self.x * units.LENGTH}
        return [(group, record)] if group == "snapshots" else []

    def trust(self, measurement):
        if abs(self.x) > 10.0:
            raise GuardStop(f"At step {self.step} the spring has snapped. Try a smaller start.")

    def state(self):
        names = ("dt", "step", "x", "v", "lost", "way")
        return State({}, {name: getattr(self, name) for name in names})

    def restore(self, state):
        vars(self).update(state.numbers)

    def sizes(self):
        return {}

    def constants(self):
        return {}

    def attributes(self):
        return {"stiffness": self.k}

    # for the error bar

    def halve_step(self):
        now = self.v + 0.5 * self.dt * self._pull(self.v)
        self.dt, self.step = 0.5 * self.dt, 2 * self.step
        self.v = now - 0.5 * self.dt * self._pull(now)

    def positions(self):
        return np.array([[self.x, 0.0, 0.0]])

    def ends(self):
        return self.sums()

    def compared(self, window, moments):
        return {}


def _reopen(scene, state):
    spring = Spring(scene, scene.start)
    spring.restore(state)
    return spring


METHOD = Method("spring", SpringScene, lambda scene: scene.start, Spring, _reopen, VARIABLES)
