"""How the equations of the continuum are solved: particles, kernel, viscosity, step."""

from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field, model_validator

from dusttaichi.scene.fields import Block, Number, Switch, needed
from dusttaichi.scene.numerics import CommonNumerics
from dusttaichi.scene.quantities import Quantity

VISCOSITIES = {
    "quasi_static": {},
    "front": {"contact": 0.1, "bulk": 0.1, "quadratic": 2.0},
    "impact": {"contact": 0.3, "bulk": 0.3, "quadratic": 2.0},
}
"""Word -> coefficients that differ from the defaults: for dust that is pressed, or hit by a bead;
for fronts behind what pushes dust at 0.5 to 2 m/s; and at 2 to 10 m/s."""


class Viscosity(Block):
    """Artificial viscosity, by where it acts; none of it is material. Written as a word for the
    kind of scene (quasi_static, front at 0.5 to 2 m/s, impact at 2 to 10 m/s) or as a block."""

    needed: ClassVar[str] = (
        f"{', '.join(VISCOSITIES)} or a block is needed, for example {{bulk: 0.1, quadratic: 2}}"
    )

    contact: Annotated[float, Number(ge=0, le=10)] = Field(
        0.0,
        description="coefficient alpha (Monaghan & Gingold 1983) of pairs of which one is rigid or "
        "has what is rigid in its reach; G09 have 1",
    )
    bulk: Annotated[float, Number(ge=0, le=10)] = Field(
        0.0, description="coefficient alpha of all other pairs"
    )
    quadratic: Annotated[float, Number(ge=0, le=10)] = Field(
        0.0,
        description="coefficient beta of the term that is quadratic in the speed of approach of "
        "all pairs: what a front needs, and hardly anything where dust is strained slowly",
    )
    limiter: Literal["balsara", "none"] = Field(
        "balsara",
        description="bulk and quadratic viscosity by |div v|/(|div v| + |curl v|) (Balsara 1995): "
        "none where dust is sheared only; or by 1",
    )
    grid: Annotated[float, Number(ge=0, le=1)] = Field(
        0.02,
        description="coefficient of a viscosity that acts on the part of velocity differences "
        "that no velocity linear in place explains: on grid noise",
    )

    @model_validator(mode="before")
    @classmethod
    def _expand(cls, data: Any) -> Any:
        if isinstance(data, str) and data in VISCOSITIES:
            return VISCOSITIES[data]
        if not isinstance(data, (dict, Viscosity)):
            raise needed(cls.needed)
        return data

    @classmethod
    def __get_pydantic_json_schema__(cls, schema, handler):
        block = handler.resolve_ref_schema(handler(schema))
        return {"description": cls.__doc__, "anyOf": [{"enum": list(VISCOSITIES)}, block]}

    @property
    def by_pairs(self) -> bool:
        """Whether pairs of particles resist their approach."""
        return self.contact > 0.0 or self.bulk > 0.0 or self.quadratic > 0.0


class ArtificialStress(Block):
    """Artificial stress of Gray et al. (2001) against the pairing of particles in tension."""

    epsilon: Annotated[float, Number(ge=0, le=1)] = Field(
        0.3, description="share of the tension that is taken away"
    )
    n: Annotated[float, Number(ge=1, le=12)] = Field(
        4.0, description="exponent of the kernel over that at the spacing"
    )


_STRESS = Switch("off, on or a block with epsilon and n is needed", on=True)


class ContinuumNumerics(CommonNumerics):
    """How the equations of the continuum are solved."""

    precision: ClassVar[str] = "f64"
    order: ClassVar[tuple[str, ...]] = (
        "spacing",
        "h_over_spacing",
        "kernel",
        "viscosity",
        "artificial_stress",
        "cfl",
        "time_step",
        "deviator",
        "plastic_return",
        "contact",
        "ledger_tolerance",
        "backend",
        "threads",
        "debug",
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
    cfl: Annotated[float, Number(gt=0, le=1)] = Field(
        0.5,
        description="time step over smoothing length / speed of the fastest signal, at every step",
    )
    time_step: Annotated[float | Literal["auto"], Quantity("time", gt=0, word="auto")] = Field(
        "auto",
        description="what the run counts as a step and the method divides into steps that cfl "
        "allows; auto: eight of these at the start",
    )
    deviator: Literal["plane_strain", "printed"] = Field(
        "plane_strain",
        description="in two dimensions: a third of the trace of the strain rate leaves the "
        "deviator, or half of it, as G09 eq 4 is printed",
    )
    plastic_return: Literal["radial", "benz"] = Field(
        "radial",
        description="the deviator returns to the strength Y, or by Y^2/(3 J2) (Benz & Asphaug "
        "1994), beyond it by what the step overshot",
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
        """There are no presets."""
        return {}
