"""Forces from outside on every particle, a list of blocks: `forces: [{kind: gas_drag, ...}]`.

A force is a block, which declares its keys, and a law: a module (or any object) with

- ``NUMBERS``: name -> Number (physics.forces.numbers), its constants;
- ``numbers(block)``: their values in SI, a dict; block: that of the YAML;
- ``acceleration(constants, particle)``, ``angular_acceleration(constants, particle)`` or both, each
  a `ti.func` that returns a vector. constants: struct of the numbers; particle: struct of position,
  velocity, spin (vectors), mass, inertia, radius, charge, time, dt (the step), number and step
  (whole numbers). A force is the acceleration times particle.mass, a torque the angular one times
  particle.inertia.

It may have

- ``potential(constants, particle)``: its potential energy, whose change is the work of the force;
- ``CHANNEL``: channel of the ledger that its losses go to, where it has no potential: minus its
  work; with ``flow(constants, particle)``, the velocity of its medium, the work of the
  medium is counted apart.
  A force with neither potential nor channel does work from outside;
- ``timescale(block, particles)``: shortest time [s] in which it changes a motion, a period or a
  stopping time, which the time step resolves; particles: arrays mass [kg], radius [m], charge [C];
- ``USES_VELOCITY = False`` where it does not depend on velocity and spin: it is then evaluated once
  a step; ``USES_CHARGE = True`` where it needs `particle.charge`.

The position does not jump where a particle crosses a periodic face; `conflicts` of the block
refuses scenes that a force cannot be for.
"""

from collections.abc import Iterable
from importlib import import_module
from math import inf
from types import SimpleNamespace
from typing import Annotated, Any, ClassVar, Literal

from dusttaichi.physics.forces.force_numbers import Number as Number
from dusttaichi.scene.fields import AnyScene, Block, Faults, Field
from dusttaichi.scene.fields import Number as Plain
from dusttaichi.scene.gravity import GravityField, refuse_periodic
from dusttaichi.scene.kinds import AnyOf, KindBlock, Kinds
from dusttaichi.scene.quantities import Quantity, Vector

FORCES = Kinds(__name__, "kind of force")
reads_forces = FORCES.add_reader
_NEEDED = ("NUMBERS", "numbers")
_LAWS = "dusttaichi.physics.forces"


class Force(KindBlock):
    """The YAML block of a force; its field `kind` is a Literal with the name of the kind."""

    @property
    def law(self) -> Any:
        """Law of the force: an object, or the name of its module."""
        return FORCES[self.kind].make


def register(block: type[Force], law: Any) -> None:
    """Add a force: the YAML may then have its block in `forces`.

    A force that is registered again under its kind replaces the former one. Raises ValueError for a
    built-in kind, or a law that lacks a member; TypeError for a block without a kind.
    """
    if not isinstance(law, str):
        missing = [name for name in _NEEDED if not hasattr(law, name)]
        if not hasattr(law, "acceleration") and not hasattr(law, "angular_acceleration"):
            missing.append("acceleration")
        if missing:
            raise ValueError(f"the law of {block.__name__} lacks {', '.join(missing)}")
        if hasattr(law, "potential") and hasattr(law, "CHANNEL"):
            raise ValueError(
                f"the law of {block.__name__} has a potential and a CHANNEL; make two forces of it"
            )
    FORCES.register(block)(law)


def find_law(block: Any) -> Any:
    """The law of a block of `forces` or `surfaces`, or of `gravity`.

    Its module is imported on first use.
    """
    return import_module(block.law) if isinstance(block.law, str) else block.law


def list_forces(scene: Any) -> tuple[Block, ...]:
    """All blocks of forces from outside, with `gravity` first."""
    gravity = getattr(scene, "gravity", None)
    return (*((gravity,) if gravity is not None else ()), *scene.forces)


def find_shortest_timescale(blocks: Iterable[Block], **of_particles: Any) -> float:
    """Shortest time [s] in which a force changes a motion; infinite without one.

    of_particles: arrays mass [kg], radius [m], charge [C].
    """
    particles = SimpleNamespace(**of_particles)
    laws = ((block, find_law(block)) for block in blocks)
    scales = [law.timescale(block, particles) for block, law in laws if hasattr(law, "timescale")]
    return min(scales, default=inf)


def check(scene: Any) -> Faults:
    """Faults of the forces of a scene with its other blocks."""
    for n, force in enumerate(scene.forces):
        for path, text in force.conflicts(scene):
            yield f"forces.{n}.{path}".rstrip("."), text


class GravityForce(GravityField, Force):
    """Gravity, as of the key `gravity`."""

    kind: Literal["gravity"]

    def conflicts(self, scene: AnyScene) -> Faults:
        return refuse_periodic(self, scene.boundary.periodic_axes)


class GasDrag(Force):
    """Drag of a gas, by a stopping time or by Epstein's law."""

    kind: Literal["gas_drag"]
    stopping_time: Annotated[float, Quantity("time", gt=0, example="10 us")] | None = Field(
        None, description="time in which the velocity relative to the gas falls by a factor e; "
        "either this, of all particles, or a density"
    )  # fmt: skip
    density: Annotated[float, Quantity("density", gt=0, example="1e-3 kg/m^3")] | None = Field(
        None, description="density of the gas, for Epstein's law"
    )
    temperature: Annotated[float, Quantity("temperature", gt=0)] | None = Field(
        None, description="with density: temperature of the gas, 280 K by default"
    )
    molecular_mass: Annotated[float, Plain(gt=0)] | None = Field(
        None, description="with density: mean mass of its molecules in atomic mass units, 2.34 by "
        "default, of hydrogen and helium"
    )  # fmt: skip
    velocity: Annotated[Vector, Quantity("speed", count=3)] = Field(
        ("0 m/s", "0 m/s", "0 m/s"), description="velocity of the gas"
    )

    SET_BY_DENSITY: ClassVar[tuple[str, ...]] = ("temperature", "molecular_mass")

    def faults(self) -> Faults:
        if (self.stopping_time is None) == (self.density is None):
            yield "", "exactly one of stopping_time and density is needed"
        elif self.density is None:
            for key in self.SET_BY_DENSITY:
                if getattr(self, key) is not None:
                    yield key, "it belongs to a density"

    def conflicts(self, scene: AnyScene) -> Faults:
        if scene.method != "grains" and self.density is not None:
            text = "particles of a continuum are no grains; stopping_time is allowed with them"
            yield "density", text


class RotatingFrame(Force):
    """Centrifugal and Coriolis forces of a frame that rotates; positions are those in the frame."""

    kind: Literal["rotating_frame"]
    angular_velocity: Annotated[Vector, Quantity("angular velocity", count=3)] = Field(
        description="angular velocity of the frame"
    )
    centre: Annotated[Vector, Quantity("length", count=3)] = Field(
        ("0 m", "0 m", "0 m"), description="a point of its axis"
    )

    def conflicts(self, scene: AnyScene) -> Faults:
        if scene.boundary.periodic_axes:
            yield "kind", "a cell is repeated, and an axis is not; use boundary.kind: open or box"


class ElectricField(Force):
    """A uniform electric field, with or without a magnetic one, on the charges of `charge`."""

    kind: Literal["electric_field"]
    field: Annotated[Vector, Quantity("electric field", count=3)] = Field(
        ("0 V/m", "0 V/m", "0 V/m"), description="electric field, its amplitude with a frequency"
    )
    frequency: Annotated[float, Quantity("rate", gt=0)] | None = Field(
        None, description="cycles of the electric field in a time; without it, it is steady"
    )
    phase: Annotated[float, Quantity("angle")] | None = Field(
        None, description="with frequency: phase at the start, by default 0, of the largest field"
    )
    magnetic_field: Annotated[Vector, Quantity("magnetic field", count=3)] = Field(
        ("0 T", "0 T", "0 T"), description="magnetic field"
    )

    def faults(self) -> Faults:
        if self.frequency is None and self.phase is not None:
            yield "phase", "it belongs to a frequency"
        if not any((*self.field, *self.magnetic_field)):
            yield "", "a field or a magnetic_field is needed"

    def conflicts(self, scene: AnyScene) -> Faults:
        if scene.charge is None:
            text = "the particles have no charge; give the key charge, for example charge: 1e-17 C"
            yield "kind", text


class ScriptForce(Force):
    """Forces and velocities that a Python script sets between steps; they are 0 before."""

    kind: Literal["script"]

    def conflicts(self, scene: AnyScene) -> Faults:
        if scene.method != "grains":
            yield "kind", "allowed with method: grains"


register(GravityForce, "")
register(RotatingFrame, f"{_LAWS}.rotating_frame")
register(ElectricField, f"{_LAWS}.electric_field")
register(ScriptForce, f"{_LAWS}.script")
register(GasDrag, f"{_LAWS}.drag")

AnyForce = Annotated[Force, AnyOf(FORCES)]
