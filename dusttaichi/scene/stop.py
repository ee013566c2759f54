"""When a run ends."""

from typing import Annotated

from pydantic import Field, model_validator

from dusttaichi.scene.fields import Block, Count, Number, problems
from dusttaichi.scene.quantities import Quantity


class Stop(Block):
    """The first condition that is met ends the run; at least one is needed."""

    filling_factor: (
        Annotated[
            float, Number(gt=0, le=0.74, note=" (0.74 is the densest packing of equal spheres)")
        ]
        | None
    ) = Field(None, description="filling factor, reached from below or from above")
    pressure: Annotated[float, Quantity("pressure", gt=0, example="120 kPa")] | None = Field(
        None,
        description="pressure on the top wall, or of a periodic cell (-trace of the stress / 3), "
        "averaged over output.window",
    )
    strain: Annotated[float, Number(gt=0)] | None = Field(
        None,
        description="change of the height, or of the edge that changes most, over its length at "
        "the start",
    )
    past_maximum: Annotated[float, Number(gt=0, lt=1)] | None = Field(
        None,
        description="share by which the tension, averaged over ten points of the series, has "
        "fallen below its largest value",
    )
    time: Annotated[float, Quantity("time", gt=0, example="1 us")] | None = Field(
        None, description="simulated time, in a stage from its start"
    )
    steps: Count | None = Field(None, description="number of time steps, in a stage from its start")

    @model_validator(mode="after")
    def _check(self) -> "Stop":
        if all(getattr(self, name) is None for name in Stop.model_fields):
            raise problems(
                [
                    (
                        "",
                        f"at least one of {', '.join(Stop.model_fields)} is needed, "
                        "for example {filling_factor: 0.5}",
                    )
                ]
            )
        return self
