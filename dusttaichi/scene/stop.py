"""When a run ends."""

from typing import Annotated

from pydantic import Field, model_validator

from dusttaichi.scene.fields import Block, Count, Number, problems
from dusttaichi.units import Quantity


class Stop(Block):
    """The first condition that is met ends the run; at least one is needed."""

    filling_factor: (
        Annotated[
            float, Number(gt=0, le=0.74, note=" (0.74 is the densest packing of equal spheres)")
        ]
        | None
    ) = Field(None, description="filling factor of a closed box")
    pressure: Annotated[float, Quantity("pressure", gt=0, example="120 kPa")] | None = Field(
        None, description="pressure on the top wall, averaged over output.window"
    )
    time: Annotated[float, Quantity("time", gt=0, example="1 us")] | None = Field(
        None, description="simulated time"
    )
    steps: Count | None = Field(None, description="number of time steps")

    @model_validator(mode="after")
    def _check(self) -> "Stop":
        if self.filling_factor is self.pressure is self.time is self.steps is None:
            raise problems(
                [
                    (
                        "",
                        "at least one of filling_factor, pressure, time and steps is needed, "
                        "for example {filling_factor: 0.5}",
                    )
                ]
            )
        return self
