"""Numerics of the continuum: particles, kernel, viscosity, time step."""

from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field

from dusttaichi.scene.fields import Block, NamedBlock, Number, Switch
from dusttaichi.scene.numerics import CommonNumerics
from dusttaichi.scene.quantities import Quantity

VISCOSITIES = {
    "quasi_static": {},
    "front": {"contact": 0.1, "bulk": 0.1, "quadratic": 2.0},
    "impact": {"contact": 0.3, "bulk": 0.3, "quadratic": 2.0},
}
"""Word -> coefficients that differ from the defaults: for slow compression and beads; for
compaction fronts at 0.5 to 2 m/s; and for impacts at 2 to 10 m/s."""


class Viscosity(NamedBlock):
    """Artificial viscosity, by where it acts; none of it is material.

    Written as a word for the kind of scene (quasi_static, front at 0.5 to 2 m/s, impact at 2 to 10
    m/s) or as a block.
    """

    WORDS: ClassVar[dict[str, dict[str, Any]]] = VISCOSITIES
    requirement: ClassVar[str] = (
        f"{', '.join(VISCOSITIES)} or a block is needed, for example {{bulk: 0.1, quadratic: 2}}"
    )

    contact: Annotated[float, Number(ge=0, le=10)] = Field(
        0.0,
        description="coefficient alpha (Monaghan & Gingold 1983) of pairs of which one is rigid or "
        "has a rigid neighbour; G09 have 1",
    )
    bulk: Annotated[float, Number(ge=0, le=10)] = Field(
        0.0, description="coefficient alpha of all other pairs"
    )
    quadratic: Annotated[float, Number(ge=0, le=10)] = Field(
        0.0,
        description="coefficient beta of the term that is quadratic in the approach speed of "
        "all pairs: needed at fronts, negligible where dust is strained slowly",
    )
    limiter: Literal["balsara", "none"] = Field(
        "balsara",
        description="factor on bulk and quadratic viscosity: balsara, |div v|/(|div v| + "
        "|curl v|) (Balsara 1995), which vanishes in pure shear; none: 1",
    )
    grid: Annotated[float, Number(ge=0, le=1)] = Field(
        0.02,
        description="coefficient of a viscosity that acts on grid noise: the part of velocity "
        "differences that is not linear in position",
    )

    @property
    def by_pairs(self) -> bool:
        """True where pairs of particles resist their approach."""
        return self.contact > 0.0 or self.bulk > 0.0 or self.quadratic > 0.0


class ArtificialStress(Block):
    """Artificial stress of Gray et al. (2001) against the pairing of particles in tension."""

    epsilon: Annotated[float, Number(ge=0, le=1)] = Field(
        0.3, description="share of the tension that is removed"
    )
    n: Annotated[float, Number(ge=1, le=12)] = Field(
        4.0, description="exponent of the ratio of the kernel to its value at the spacing"
    )


_STRESS = Switch("off, on or a block with epsilon and n is needed", on=True)


class ContinuumNumerics(CommonNumerics):
    """Numerics of the continuum."""

    precision: ClassVar[str] = "f64"
    order: ClassVar[str] = (
        "spacing h_over_spacing kernel viscosity artificial_stress hourglass cfl time_step "
        "deviator plastic_return contact ledger_tolerance backend threads debug"
    )

    spacing: Annotated[float, Quantity("length", gt=0, example="100 um")] = Field(
        description="distance of neighbouring particles at the start"
    )
    h_over_spacing: Annotated[float, Number(ge=1, le=3)] = Field(
        1.3, description="smoothing length over spacing; the kernel reaches twice as far"
    )
    kernel: Literal["cubic_spline", "wendland_c2"] = Field(
        "cubic_spline", description="smoothing kernel"
    )
    viscosity: Viscosity = Field(default_factory=Viscosity, description="artificial viscosity")
    artificial_stress: Annotated[ArtificialStress | None, _STRESS] = Field(
        None, description="against the pairing of particles of elastic bodies in tension"
    )
    hourglass: Annotated[float, Number(ge=0, le=2)] = Field(
        1.0,
        description="stiffness of elastic bodies against hourglass modes, displacements of "
        "particles that no strain explains, over their longitudinal modulus; 0 for none, where "
        "particles of a body that is pulled pair; dust has none",
    )
    cfl: Annotated[float, Number(gt=0, le=1)] = Field(
        0.5,
        description="time step over smoothing length / speed of the fastest signal, at every step",
    )
    time_step: Annotated[float | Literal["auto"], Quantity("time", gt=0, word="auto")] = Field(
        "auto",
        description="step of the run, which the method divides into steps that cfl allows; auto: "
        "eight of these at the start",
    )
    deviator: Literal["plane_strain", "printed"] = Field(
        "plane_strain",
        description="in two dimensions: a third of the trace of the strain rate is subtracted in "
        "the deviator, or half of it, as G09 eq 4 is printed",
    )
    plastic_return: Literal["radial", "benz"] = Field(
        "radial",
        description="return of the deviator: radial, onto the strength Y; or benz, by the factor "
        "Y^2/(3 J2) (Benz & Asphaug 1994), which overcorrects",
    )
    contact: Literal["stick", "separate"] = Field(
        "stick",
        description="dust sticks to what is rigid with its tensile strength, or separates where it "
        "would be pulled",
    )
    ledger_tolerance: Annotated[float, Number(gt=0, le=1)] = Field(
        0.05,
        description="share of the energy that has gone through the system by which the ledger may "
        "be open before a guard stops the run",
    )

    @property
    def smoothing_length(self) -> float:
        """h [m]."""
        return self.h_over_spacing * self.spacing

    @property
    def support(self) -> float:
        """Radius of the kernel [m]."""
        return 2.0 * self.smoothing_length

    @property
    def preset(self) -> dict[str, Any]:
        """Values of presets, of which there are none."""
        return {}
