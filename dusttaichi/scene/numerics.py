"""Time step, precision, and what the run is computed on."""

from typing import Annotated, Literal

from pydantic import Field

from dusttaichi.scene.fields import Block, Number
from dusttaichi.units import Quantity


class Numerics(Block):
    """How the equations are solved."""

    time_step: Annotated[float | Literal["auto"], Quantity("time", gt=0, word="auto")] = Field(
        "auto", description="time step, or auto: step_fraction of the stiffest period"
    )
    # Leapfrog is stable up to 1/pi = 0.318 of the period.
    step_fraction: Annotated[
        float, Number(gt=0, le=0.31, note="; from 0.318 (1/pi) on the step is unstable")
    ] = Field(0.2, description="time step over the stiffest period, with time_step auto")
    precision: Literal["f64"] = Field(
        "f64", description="f64: a force law in f32 was measured to be no faster on the CPU"
    )
    backend: Literal["cpu", "cuda"] = Field("cpu", description="what the kernels run on")
    threads: Annotated[int | Literal["auto"], Number(whole=True, ge=1, word="auto")] = Field(
        "auto", description="CPU threads, no more than there are cores"
    )
    skin: Annotated[float | Literal["auto"], Number(gt=0, le=10, word="auto")] = Field(
        "auto", description="extra reach of the neighbour search as a fraction of the radius"
    )
