"""Motion of surfaces in a stage: velocities, and loads that a controller holds."""

from typing import Annotated

from dusttaichi.physics.surfaces.surface_motion import LOADS
from dusttaichi.scene.fields import Block, Faults, Field, Number
from dusttaichi.scene.quantities import Quantity, Vector

Velocity = Annotated[Vector, Quantity("speed", count=3)]
Spin = Annotated[Vector, Quantity("angular velocity", count=3)]
Force = Annotated[float, Quantity("force", example="20 nN")]
Pressed = Annotated[float, Quantity("pressure", example="5 kPa")]
Largest = Annotated[float, Quantity("speed", gt=0)]
Gain = Annotated[float, Number(gt=0, le=0.5)]
SPEED = 0.05  # default limit of the speed under a load [m/s]

FORCE = Field(
    None,
    description="controlled force along its `direction`, which it moves along as needed; negative "
    "pulls",
)
PRESSURE = Field(None, description="controlled pressure in place of a force: this over its `area`")
LARGEST = Field(
    None,
    description="with a force or pressure the largest speed; if not given 5 cm/s, or the speed of "
    "the stage before if that is more",
)
GAIN = Field(None, description="with a force or pressure gain of the control, as `drive.gain`")


def find_load_faults(block: Block) -> Faults:
    """Conflicts between the keys of a load; block: a SurfaceDrive, or a surface with these keys."""
    loads = [name for name in LOADS if getattr(block, name) is not None]
    if len(loads) == 2:
        yield "pressure", "force is given already; one of both is enough"
    for name in loads:
        if getattr(block, name) == 0.0:
            yield (
                name,
                "its size sets the scale of the control, so it must not be 0; to release "
                "the surface give a velocity",
            )


class SurfaceDrive(Block):
    """Motion of a surface in a stage; what is not given is as in its own block."""

    velocity: Velocity | None = Field(
        None, description="velocity at which it is driven; with a force or pressure across that"
    )
    spin: Spin | None = Field(None, description="angular velocity about its centre")
    force: Force | None = FORCE
    pressure: Pressed | None = PRESSURE
    largest_speed: Largest | None = LARGEST
    gain: Gain | None = GAIN

    def faults(self) -> Faults:
        yield from find_load_faults(self)
