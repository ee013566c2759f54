"""Two grains, in contact or flying at each other.

Grain 1 is on the side of +x and flies along -x, grain 0 along +x. The centre of mass is at rest at
the origin, so each has half of the speed if their masses are equal. The line of centres is in the
plane of x and y; the impact parameter b is along y, b = d sin(angle) with the initial distance d of
the centres and the angle between the line of centres and the x axis.
"""

import math
from typing import Annotated, ClassVar, Literal

import numpy as np

from dusttaichi.errors import DustError
from dusttaichi.samples.explicit import check_apart
from dusttaichi.samples.materials import Materials
from dusttaichi.samples.sample import Sample
from dusttaichi.samples.sample_registry import SampleBlock, register
from dusttaichi.samples.values import ImpactParameter, MaterialName, Radius, Spin, unknown_materials
from dusttaichi.scene.fields import AnyScene, Faults, Field
from dusttaichi.scene.quantities import Quantity


class PairSample(SampleBlock):
    """Two grains; grain 1 flies along -x and grain 0 along +x, each with half of the speed."""

    flies: ClassVar[bool] = True

    kind: Literal["pair"]
    distance: Annotated[float, Quantity("length", gt=0, example="1.3 um")] | None = Field(
        None, description="initial distance of the centres; without it and gap: equilibrium contact"
    )
    gap: Annotated[float, Quantity("length", example="10 nm")] | None = Field(
        None, description="initial distance of the surfaces, below 0 for an overlap"
    )
    speed: Annotated[float, Quantity("speed", ge=0)] = Field(
        "0 m/s", description="relative speed at the start; the centre of mass is at rest"
    )
    impact_parameter: ImpactParameter = Field(
        0.0, description="along y: a length, or a fraction of the sum of the radii"
    )
    angle: Annotated[float, Quantity("angle", ge=0, le=math.pi / 2)] | None = Field(
        None,
        description="initial angle between the line of centres and the flight, in place of "
        "impact_parameter; 0 is head-on",
    )
    spins: tuple[Spin, ...] | None = Field(
        None, description="angular velocities of the two, default none"
    )
    radii: tuple[Radius, ...] | None = Field(
        None, description="radii of the two, default that of their material"
    )
    materials: tuple[MaterialName, ...] | None = Field(
        None, description="materials of the two, names from the scene's materials, or default"
    )

    def faults(self) -> Faults:
        if self.distance is not None and self.gap is not None:
            yield "gap", "it is not allowed together with distance; keep one of them"
        if self.angle is not None and self.impact_parameter.value != 0:
            yield "angle", "it is not allowed together with impact_parameter"
        for name in ("spins", "radii", "materials"):
            values = getattr(self, name)
            if values is not None and len(values) != 2:
                yield name, f"2 are needed, one for each grain, and not {len(values)}"

    def conflicts(self, scene: AnyScene) -> Faults:
        return unknown_materials(self.materials, scene)


@register(PairSample)
def make(spec: PairSample, materials: Materials) -> Sample:
    """The two grains of spec.

    Raises DustError for grains that overlap too much, or an impact parameter beyond the distance.
    """
    unequal, second_mass_fraction, radii = {}, 0.5, np.full(2, materials.radius)
    equilibrium_distance = materials.distance
    if spec.radii is not None or spec.materials is not None:
        numbers = materials.numbers(spec.materials, 2, "sample.materials")
        radii = materials.radii(spec.radii, numbers, "sample.radii")
        unequal = materials.polydisperse(radii, numbers)
    if unequal.get("radii") is not None:
        equilibrium_distance = materials.equilibrium_distance(radii, numbers)
        m1, m2 = materials.masses(Sample(*np.zeros((3, 2, 3)), **unequal))
        second_mass_fraction = float(m2 / (m1 + m2))
    touch = float(radii.sum())
    distance = equilibrium_distance
    if spec.distance is not None:
        distance = spec.distance
    elif spec.gap is not None:
        distance = touch + spec.gap
    if distance < touch:
        origin = "sample.gap" if spec.distance is None else "sample.distance"
        centres = np.outer([0.0, max(distance, 0.0)], [1.0, 0.0, 0.0])
        check_apart(
            centres, radii if unequal.get("radii") is not None else materials.radius, origin
        )
    if spec.angle is not None:
        impact = distance * math.sin(spec.angle)
        along = distance * math.cos(spec.angle)
    else:
        impact = spec.impact_parameter.metres(touch)
        if impact > distance:
            raise DustError(
                f"sample.impact_parameter: {impact * 1e6:g} µm is more than the distance of the "
                f"centres, {distance * 1e6:g} µm; allowed: at most that. Set a larger gap."
            )
        along = math.sqrt(distance**2 - impact**2)
    line = np.array([along, impact, 0.0])
    positions = np.array([-second_mass_fraction * line, (1 - second_mass_fraction) * line])
    velocities = np.zeros((2, 3))
    velocities[:, 0] = second_mass_fraction * spec.speed, -(1 - second_mass_fraction) * spec.speed
    spins = np.zeros((2, 3)) if spec.spins is None else np.array(spec.spins, dtype=np.float64)
    info = {
        "distance": float(distance),
        "gap": float(distance - touch),
        "speed": float(spec.speed),
        "impact_parameter": float(impact),
        "equilibrium_distance": float(equilibrium_distance),
    }
    return Sample(positions, velocities, spins, info=info, **unequal)
