"""Stop conditions of a run."""

from typing import TYPE_CHECKING, Annotated, ClassVar

from pydantic import Tag

from dusttaichi.scene.fields import PLAIN_OR_BLOCK, Block, Count, Faults, Field, Number
from dusttaichi.scene.quantities import Quantity, format

Stress = Annotated[float, Quantity("pressure", example="-5 kPa")]
ABOVE, BELOW = (f"it ends once this is reached from {side}" for side in ("below", "above"))
COMPONENTS = ("xx", "yy", "zz", "xy", "xz", "yz")


class Limits(Block):
    """Thresholds that end the stage: one of the two, or both. EXAMPLE: of one of them."""

    DIMENSION: ClassVar[str]
    EXAMPLE: ClassVar[str]
    if TYPE_CHECKING:
        above: float | None
        below: float | None

    def faults(self) -> Faults:
        if self.above is self.below is None:
            yield "", f"above, below or both are needed, for example {{below: {self.EXAMPLE}}}"

    @classmethod
    def describe(cls, value: float, digits: int = 6) -> str:
        """Text of a value with its unit."""
        return format(value, cls.DIMENSION, digits)

    def describe_crossing(self, value: float) -> str:
        """Threshold that has been crossed, as the end of a sentence; "" where none has been."""
        if self.above is not None and value >= self.above:
            return self.describe(self.above)
        if self.below is not None and value <= self.below:
            return f"no more than {self.describe(self.below)}"
        return ""

    def surely_crossed(self, low: float, high: float) -> bool:
        """True if a value known to be between these two has crossed a threshold."""
        above, below = self.above, self.below
        return (above is not None and low >= above) or (below is not None and high <= below)

    def overshoot(self, value: float) -> float:
        """Distance of a value from the threshold that it has crossed, over that."""
        above = self.above is not None and value >= self.above
        level = self.above if above else self.below
        return abs(value - level) / abs(level) if level else 0.0


class Bounds(Limits):
    """Thresholds of a pressure or stress that end the stage: one of the two, or both."""

    DIMENSION, EXAMPLE = "pressure", "1 kPa"
    above: Stress | None = Field(None, description=ABOVE)
    below: Stress | None = Field(None, description=BELOW)

    @classmethod
    def describe(cls, value: float, digits: int = 6) -> str:
        return f"{value / 1e3:.{digits}g} kPa"  # as the other numbers of a run have it


Force = Annotated[float, Quantity("force", example="20 nN")]
Length = Annotated[float, Quantity("length", example="2 um")]


class ForceBounds(Limits):
    """Thresholds of a force that end the stage: one of the two, or both."""

    DIMENSION, EXAMPLE = "force", "20 nN"
    above: Force | None = Field(None, description=ABOVE)
    below: Force | None = Field(None, description=BELOW)


class LengthBounds(Limits):
    """Thresholds of a length that end the stage: one of the two, or both."""

    DIMENSION, EXAMPLE = "length", "2 um"
    above: Length | None = Field(None, description=ABOVE)
    below: Length | None = Field(None, description=BELOW)


class SurfaceBounds(Block):
    """Load and displacement of a surface that end the stage; at least one is needed."""

    force: ForceBounds | None = Field(
        None, description="its force on the grains, averaged over output.window"
    )
    pressure: Bounds | None = Field(None, description="that force over its area")
    displacement: LengthBounds | None = Field(
        None, description="along its direction, since the start"
    )

    def faults(self) -> Faults:
        if not self.loads and self.displacement is None:
            yield "", "force, pressure or displacement is needed"

    @property
    def loads(self) -> dict[str, Limits]:
        """The given bounds of a load, by name."""
        items = {"force": self.force, "pressure": self.pressure}
        return {name: bounds for name, bounds in items.items() if bounds is not None}


class StressBounds(Block):
    """Components of the stress that end the stage; positive in tension, as in the result."""

    xx: Bounds | None = Field(None, description="normal stress along x")
    yy: Bounds | None = Field(None, description="normal stress along y")
    zz: Bounds | None = Field(None, description="normal stress along z")
    xy: Bounds | None = Field(None, description="shear stress, its mean with yx")
    xz: Bounds | None = Field(None, description="shear stress, its mean with zx")
    yz: Bounds | None = Field(None, description="shear stress, its mean with zy")

    @property
    def components(self) -> dict[str, Bounds]:
        """The given components, by name."""
        return {name: bounds for name in COMPONENTS if (bounds := getattr(self, name)) is not None}


Pressure = Annotated[
    Annotated[float, Quantity("pressure", gt=0, example="120 kPa"), Tag("plain")]
    | Annotated[Bounds, Tag("block")],
    PLAIN_OR_BLOCK,
]


class Stop(Block):
    """The first condition that is met ends the run; at least one is needed."""

    filling_factor: (
        Annotated[
            float, Number(gt=0, le=0.74, note=" (0.74 is the densest packing of equal spheres)")
        ]
        | None
    ) = Field(None, description="filling factor, reached from below or from above")
    pressure: Pressure | None = Field(
        None,
        description="pressure on the top wall, or of a periodic cell (-trace of the stress / 3), "
        "averaged over output.window, reached from below; {below: 1 kPa}: reached from above; "
        "tested between records of the series as well",
    )
    stress: StressBounds | None = Field(
        None,
        description="components of the virial stress, positive in tension, averaged over "
        "output.window, for example {zz: {below: -10 kPa}}",
    )
    surfaces: dict[str, SurfaceBounds] = Field(
        {},
        description="load or displacement of surfaces, by name, along their directions, as in "
        "{piston: {force: {above: 1 uN}}}; tested between records of the series as well",
    )
    rest: Annotated[float, Number(gt=0, lt=1)] | None = Field(
        None,
        description="kinetic energy over the energy of the bonds at rest (of a continuum: over "
        "the energy that has gone through the system), below which everything is at rest, for "
        "example 1e-6",
    )
    plateau: Annotated[float, Number(gt=0, lt=1)] | None = Field(
        None,
        description="largest relative change of the pressure, averaged over ten records of the "
        "series, from the average over the ten before",
    )
    creep: Annotated[float, Quantity("rate", gt=0, example="20 s^-1")] | None = Field(
        None,
        description="rate of growth of the filling factor (of its logarithm), over ten records of "
        "the series, below which a sample under a controlled pressure or stress has settled; "
        "the load must be within 2 % of its prescribed value",
    )
    strain: Annotated[float, Number(gt=0)] | None = Field(
        None,
        description="change of the height, or of the edge that changes most, relative to its "
        "length at the start",
    )
    past_maximum: Annotated[float, Number(gt=0, lt=1)] | None = Field(
        None,
        description="relative drop of the tension, averaged over ten records of the series, "
        "below its largest value",
    )
    time: Annotated[float, Quantity("time", gt=0, example="1 us")] | None = Field(
        None, description="simulated time, in a stage from its start"
    )
    steps: Count | None = Field(None, description="number of time steps, in a stage from its start")

    def faults(self) -> Faults:
        if all(getattr(self, name) in (None, {}) for name in Stop.model_fields):
            text = f"at least one of {', '.join(Stop.model_fields)} is needed, "
            yield "", text + "for example {filling_factor: 0.5}"

    @property
    def pressure_bounds(self) -> Bounds | None:
        """Bounds of the pressure; a pressure alone is reached from below."""
        if self.pressure is None or isinstance(self.pressure, Bounds):
            return self.pressure
        return Bounds.model_construct(above=self.pressure, below=None)

    @property
    def time_text(self) -> str:
        """Its time, for people; "" without one."""
        return "" if self.time is None else format(self.time, "time", 6)

    @property
    def falling(self) -> bool:
        """True where the pressure may end the stage by falling."""
        bounds = self.pressure_bounds
        return bounds is not None and bounds.below is not None
