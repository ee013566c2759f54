"""Parameters of `dust collide`: many speeds, impact parameters, bodies and seeds."""

from typing import Annotated

import numpy as np
from pydantic import Field, Tag

from dusttaichi.samples.sample_registry import AnyBody, reads_samples
from dusttaichi.scene.fields import PLAIN_OR_BLOCK, Block, Count, Faults, Number
from dusttaichi.scene.quantities import Quantity

MOST = 100_000  # collisions of a study

Impact = Annotated[float, Number(ge=0, le=1)]
Ratio = Annotated[float, Number(ge=1)]
Filling = Annotated[float, Number(gt=0, lt=1)]
ImpactSpeed = Annotated[float, Quantity("speed", gt=0, example="10 m/s")]


class SpeedRange(Block):
    """Speeds evenly spaced in the logarithm."""

    lowest: ImpactSpeed = Field(description="the first speed")
    highest: ImpactSpeed = Field(description="the last speed")
    count: Annotated[int, Number(whole=True, ge=2)] = Field(description="number of speeds")

    def values(self) -> tuple[float, ...]:
        """The speeds [m/s]."""
        return tuple(np.geomspace(self.lowest, self.highest, self.count).tolist())


class Rings(Block):
    """Impact parameters of rings of equal area, into which the disc of the largest is cut."""

    rings: Count = Field(
        description="number of rings of equal area, with one impact parameter each"
    )
    largest: Annotated[float, Number(gt=0, le=1)] = Field(
        1.0, description="outer radius of the last ring, a fraction of the sum of the outer radii"
    )

    def values(self) -> tuple[float, ...]:
        """Impact parameters that halve the area of their ring."""
        fractions = (np.arange(self.rings) + 0.5) / self.rings
        return tuple((self.largest * np.sqrt(fractions)).tolist())


Speeds = Annotated[
    Annotated[tuple[ImpactSpeed, ...], Tag("plain")] | Annotated[SpeedRange, Tag("block")],
    PLAIN_OR_BLOCK,
]
Impacts = Annotated[
    Annotated[tuple[Impact, ...], Tag("plain")] | Annotated[Rings, Tag("block")], PLAIN_OR_BLOCK
]


@reads_samples
class Collisions(Block):
    """Parameters of `dust collide`; `dust run` makes the one collision of `sample`."""

    speed: Speeds = Field(
        description="relative speeds: a list, or {lowest, highest, count} in the logarithm"
    )
    impact_parameter: Impacts = Field(
        description="fractions of the sum of the outer radii: a list, or {rings: n} of equal area"
    )
    mass_ratio: tuple[Ratio, ...] = Field(
        (1.0,),
        description="mass of the target over that of the projectile, whose number of `grains` is "
        "reduced accordingly",
    )
    bodies: dict[str, AnyBody] = Field(
        {},
        description="bodies by name, each the target and the projectile of the scene in turn; "
        "without any, those of `sample`",
    )
    filling_factor: tuple[Filling, ...] = Field(
        (),
        description="filling factors, each in turn that of both bodies of `sample`, which need "
        "this key, such as those of kind cutout from space_filling; not together with bodies",
    )
    seeds: Count = Field(
        3, description="pairs of bodies at each point; their seeds follow those of the sample"
    )

    refine: Annotated[int, Number(whole=True, ge=0, le=30)] = Field(
        0,
        description="number of additional speeds: each halves, in the logarithm, the widest "
        "interval of a body and mass ratio in which the growth efficiency falls below 0",
    )
    phases: bool = Field(
        False,
        description="whether the energy dissipated in compression and in stretching is measured, "
        "which takes up to twice as long",
    )
    files: bool = Field(
        False,
        description="whether each collision has a file of its own in `collisions`: energies and "
        "losses over time, and its grains and fragments at start and end",
    )

    @property
    def speeds(self) -> tuple[float, ...]:
        """Relative speeds [m/s]."""
        return self.speed.values() if isinstance(self.speed, SpeedRange) else self.speed

    @property
    def impacts(self) -> tuple[float, ...]:
        """Impact parameters, fractions of the sum of the outer radii."""
        parameters = self.impact_parameter
        return parameters.values() if isinstance(parameters, Rings) else parameters

    @property
    def by_area(self) -> bool:
        """True where the impact parameters are those of rings of equal area."""
        return isinstance(self.impact_parameter, Rings)

    @property
    def count(self) -> int:
        """Number of collisions."""
        points = (len(self.speeds) + self.refine) * len(self.impacts) * len(self.mass_ratio)
        return points * max(1, len(self.bodies), len(self.filling_factor)) * self.seeds


def check(scene) -> Faults:
    """Faults of the block with the other blocks."""
    collisions = scene.collisions
    if collisions is None:
        return
    if scene.sample.kind != "collision":
        sample_kind = scene.sample.kind
        yield "collisions", f"sample.kind is {sample_kind}; it needs two bodies: kind: collision"
        return
    faults = [*_grid(scene, collisions), *_filling(scene.sample, collisions)]
    yield from faults or _ratios(collisions, {"sample.projectile": scene.sample.projectile})


def _grid(scene, collisions: Collisions) -> Faults:
    if scene.stop is None or scene.stop.time is None:
        text = "it needs stop: {time: ...}, the time after first contact at which collisions end"
        yield "collisions", text
    if (
        isinstance(collisions.speed, SpeedRange)
        and not collisions.speed.lowest < collisions.speed.highest
    ):
        yield "collisions.speed", "highest must be above lowest"
    lists = {
        "speed": collisions.speeds,
        "impact_parameter": collisions.impacts,
        "mass_ratio": collisions.mass_ratio,
    }
    lists["filling_factor"] = collisions.filling_factor
    for key, values in lists.items():
        if not values and key != "filling_factor":
            yield f"collisions.{key}", "at least one value is needed"
        elif len(set(values)) < len(values):
            yield f"collisions.{key}", "a value is given twice"
    if collisions.count > MOST:
        yield (
            "collisions",
            f"these are {collisions.count:,} collisions; at most {MOST:,} are allowed",
        )


def _filling(sample, collisions: Collisions) -> Faults:
    """Filling factors beside named bodies, or of bodies without that key."""
    if collisions.filling_factor and collisions.bodies:
        text = "it varies the bodies of `sample`, and bodies replace these; use one of the two"
        yield "collisions.filling_factor", text
    elif collisions.filling_factor:
        for name in ("target", "projectile"):
            body = getattr(sample, name)
            if not hasattr(getattr(body, "of", body), "filling_factor"):
                text = (
                    f"a body of kind {body.kind} has no filling_factor; one that has is {{kind: "
                    "cutout, of: {kind: space_filling, grains: 800}, diameter: 2 um}"
                )
                yield f"sample.{name}", text


def _ratios(collisions: Collisions, bodies: dict) -> Faults:
    """Bodies that no mass ratio can scale."""
    bodies = {f"collisions.bodies.{n}": body for n, body in collisions.bodies.items()} or bodies
    largest = max(collisions.mass_ratio)
    if largest == 1.0:
        return
    for path, body in bodies.items():
        grains = getattr(body, "grains", None)
        if grains is None:
            text = "a mass ratio above 1 needs a number of grains; a body with `grains` is needed"
            yield path, text
        elif grains < 2 * largest:
            yield path, f"{grains} grains over {largest:g}: the projectile has fewer than 2 grains"
