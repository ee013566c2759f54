"""Charges of the particles: the same on each, with a scatter, by surface or by mass."""

from typing import Annotated, Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from pydantic import model_validator

from dusttaichi.scene.fields import Block, CoreSchema, Faults, Field, JsonHandler, JsonSchema, Seed
from dusttaichi.scene.quantities import Quantity

EACH = Quantity("charge", example="1e-17 C")
FAR = 6.0  # standard deviations beyond which no charge is expected


class Charge(Block):
    """Charge of each particle; `charge: 1e-17 C` is that as its mean, without a deviation."""

    WAYS: ClassVar[tuple[str, ...]] = ("mean", "surface_density", "per_mass")

    mean: Annotated[float, EACH] | None = Field(
        None, description="mean charge of a grain; either this or one of the next two"
    )
    deviation: Annotated[float, Quantity("charge", ge=0, example="2e-18 C")] = Field(
        "0 C", description="with mean: standard deviation of the charges, which are normal"
    )
    seed: Seed = Field(1, description="with deviation: seed of the charges")
    surface_density: Annotated[float, Quantity("charge per area")] | None = Field(
        None, description="charge of a grain over its surface"
    )
    per_mass: Annotated[float, Quantity("charge per mass")] | None = Field(
        None, description="charge of a particle over its mass"
    )

    @model_validator(mode="before")
    @classmethod
    def _of_each(cls, data: Any) -> Any:
        return data if isinstance(data, (dict, Block)) else {"mean": data}

    def faults(self) -> Faults:
        if sum(getattr(self, key) is not None for key in self.WAYS) != 1:
            yield "", f"exactly one of {', '.join(self.WAYS)} is needed, for example 1e-17 C"
        elif self.mean is None:
            for key, default in (("deviation", 0.0), ("seed", 1)):  # as resolved scenes have them
                if getattr(self, key) != default:
                    yield key, "it belongs to a mean"

    def draw(self, mass: NDArray[np.float64], radius: NDArray[np.float64]) -> NDArray[np.float64]:
        """Charges [C] of particles of a mass [kg] and a radius [m], (N,) both."""
        expected = self._expect(mass, radius)
        if not self.deviation:
            return expected
        normal = np.random.Generator(np.random.PCG64(int(self.seed))).standard_normal(len(mass))
        return expected + self.deviation * normal

    def bound(self, mass: NDArray[np.float64], radius: NDArray[np.float64]) -> NDArray[np.float64]:
        """Size of the charges [C] that hardly any of such particles exceeds."""
        return np.abs(self._expect(mass, radius)) + FAR * self.deviation

    def _expect(
        self, mass: NDArray[np.float64], radius: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        if self.mean is not None:
            return np.full(len(mass), self.mean)
        if self.per_mass is not None:
            return self.per_mass * mass
        assert self.surface_density is not None  # by `faults`
        return 4.0 * np.pi * self.surface_density * radius**2

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: JsonHandler) -> JsonSchema:
        block = handler.resolve_ref_schema(handler(schema))
        return {"anyOf": [EACH.__get_pydantic_json_schema__(schema, handler), block]}
