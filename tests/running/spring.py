"""A method of its own in sixty lines of code: a particle on a spring, which a drag slows down.

Mass 1 pg; the spring's stiffness in nN/um, so that its root is the frequency in 1/us.
"""

from typing import Annotated, Literal

from pydantic import Field

from dusttaichi.analysis.numbers import Family, Observable
from dusttaichi.errors import GuardStop
from dusttaichi.method import Measurement, Method, SimpleEngine
from dusttaichi.plots import figure, style
from dusttaichi.results import common, declare
from dusttaichi.scene.fields import Number
from dusttaichi.scene.scene import Scene
from dusttaichi.units import GRAINS

PLACE = "displacement of the particle"
VARIABLES = (
    *common("snapshots"),
    *declare("series", [("place", "time", "m", PLACE, "", "")]),
    *declare("series", [("mean_speed", "time", "m/s", "speed, averaged since then", "", "")]),
    *declare("snapshots", [("place", "snapshot", "m", PLACE, "", "")]),
)


class SpringScene(Scene):
    """What the YAML of a spring may say, beside what all scenes say."""

    method: Literal["spring"] = Field(description="what computes the run")
    stiffness: Annotated[float, Number(gt=0)] = Field(1.0, description="of the spring [nN/um]")
    drag: Annotated[float, Number(ge=0)] = Field(0.0, description="force over speed [ng/us]")
    start: Annotated[float, Number()] = Field(1.0, description="first displacement [um]")


class Spring(SimpleEngine):
    """The particle in motion: place at a step, speed half a step back, what the drag has taken."""

    variables, channels, stored = VARIABLES, ("drag",), ("x", "v", "lost", "way")
    units = GRAINS  # um, us, pg

    def __init__(self, scene, start):
        self.k, self.drag, self.dt = scene.stiffness, scene.drag, scene.numerics.time_step * 1e6
        self.x, self.lost, self.way = start, 0.0, 0.0
        self.v = -0.5 * self.dt * self.pull(0.0)

    def pull(self, v):
        return -self.k * self.x - self.drag * v

    def advance(self, steps):
        for _ in range(steps):
            speed_before, self.v = self.v, self.v + self.dt * self.pull(self.v)
            self.lost += self.dt * self.drag * speed_before * 0.5 * (speed_before + self.v)
            self.x, self.way = self.x + self.dt * self.v, self.way + self.dt * abs(self.v)
        self.step += steps

    def measure(self):
        speed_after = self.v + self.dt * self.pull(self.v)
        kinetic, potential = 0.125 * (self.v + speed_after) ** 2, 0.5 * self.k * self.x**2
        # the drag of the next step acts half before now
        lost = self.lost + 0.25 * self.dt * self.drag * self.v * (self.v + speed_after)
        return Measurement.from_energies(
            kinetic, potential, [lost], kick=kinetic - 0.5 * self.v * speed_after
        )

    def validate(self, measurement):
        if abs(self.x) > 10.0:
            raise GuardStop(f"At step {self.step} the spring has snapped. Try a smaller start.")

    def sums(self):
        return {"way": self.way}

    def series(self, measurement, window):
        return self.snapshot() | {"mean_speed": window.mean("way") if window else 0.0}

    def snapshot(self):
        return {"place": self.x}

    def attributes(self):
        return {"stiffness": self.k}


# what its results show


@figure("Displacement over time", 10)
def places(run):
    own, (axes,) = style.create_figure()
    axes.plot(run.series.time, run.series.place)
    axes.set(xlabel="time (s)", ylabel="displacement (m)")
    return own


NUMBERS = Family(
    name="spring", title="a particle on a spring", order=10,
    numbers=(
        Observable(name="swing", title="largest displacement", unit="m", figure="places",
               value=lambda run: float(abs(run.series.place).max())),
    ),
)  # fmt: skip
METHOD = Method(
    name="spring", scene=SpringScene, make_sample=lambda scene: scene.start, build=Spring,
    variables=VARIABLES, observables=(NUMBERS,), figures=(places,),
)  # fmt: skip
