"""Materials of the grains."""

from typing import Annotated, Any, ClassVar, cast

from pydantic import PrivateAttr, model_validator
from pydantic_core import PydanticCustomError

from dusttaichi.physics.contact import effect_registry
from dusttaichi.physics.contact.effect_numbers import Property
from dusttaichi.scene import quantities
from dusttaichi.scene.fields import (
    Block,
    CoreSchema,
    Faults,
    Field,
    JsonHandler,
    JsonSchema,
    Mark,
    Number,
    build_faults_error,
    build_value_error,
)
from dusttaichi.scene.quantities import Quantity

DEFAULT = "default"  # name of the scene's `material` beside those of `materials`

NAMED = {
    # Seizinger et al. 2012, Table 1.
    "silicate_s12": {
        "radius": "0.6 um",
        "density": "2.65 g/cm^3",
        "surface_energy": "20 mJ/m^2",
        "young_modulus": "54 GPa",
        "poisson_ratio": 0.17,
        "critical_rolling": "2 nm",
    },
    # Paszun & Dominik 2008, Table 1: E* = 27.8 GPa is that of E = 54 GPa and nu = 0.17.
    "silica_pd08": {
        "radius": "0.6 um",
        "density": "2.65 g/cm^3",
        "surface_energy": "25 mJ/m^2",
        "young_modulus": "54 GPa",
        "poisson_ratio": 0.17,
        "critical_rolling": "2 nm",
        "asperity_volume": "0.0336 nm",  # configs/paszun_dominik2008/asperity_fit.py
    },
    # Tatsuuma et al. 2019, Table 1.
    "ice_t19": {
        "radius": "0.1 um",
        "density": "1 g/cm^3",
        "surface_energy": "100 mJ/m^2",
        "young_modulus": "7 GPa",
        "poisson_ratio": 0.25,
        "critical_rolling": "0.8 nm",
    },
}


_MIXTURE = (
    "one material is needed; those of a mixture are given beside it, for example "
    "material: {name}, materials: {{ice: ice_t19}} and sample: shares: {{default: 3, ice: 1}}"
)


def _look_up(name: Any) -> dict[str, Any]:
    if not isinstance(name, str) or name not in NAMED:
        raise build_value_error(Material.requirement)
    return NAMED[name]


class _Properties(Mark):
    """Marks the properties that laws of contacts declare (numbers.Property of physics.contact).

    They are written by name with units, and stored as pairs (name, SI value) in their order.
    """

    @staticmethod
    def _find_property(name: str) -> Property:
        declared_property = effect_registry.properties().get(name)
        if declared_property is None:
            names = ", ".join(effect_registry.properties()) or "none is registered here"
            raise build_faults_error(
                [(name, f"a property that a registered law declares is needed: {names}")]
            )
        return declared_property

    @classmethod
    def _validate(cls, value: Any) -> tuple[tuple[str, float], ...]:
        if isinstance(value, tuple):
            return value
        if not isinstance(value, dict):
            raise build_value_error(
                "properties by name are needed, for example {neck_strength: 5 MPa}"
            )
        out: dict[str, float] = {}
        for name, value_text in value.items():
            quantity = Quantity(cls._find_property(str(name)).dimension)
            try:
                out[str(name)] = cast(float, quantity._validate(value_text))
            except PydanticCustomError as error:
                raise build_faults_error([(str(name), error.message())]) from None
        return tuple(sorted(out.items()))

    @classmethod
    def _serialize(cls, value: Any) -> Any:
        return {n: quantities.format(v, cls._find_property(n).dimension) for n, v in value}

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: JsonHandler) -> JsonSchema:
        property_schemas = {
            name: {"type": "string", "description": p.meaning}
            for name, p in effect_registry.properties().items()
        }
        return {"type": "object", "properties": property_schemas, "additionalProperties": False}


class Material(Block):
    """Material of grains: a name, a name with some numbers changed (`base`), or six numbers."""

    extra_keys: ClassVar[tuple[str, ...]] = ("base",)
    shorthands: ClassVar[tuple[str, ...]] = tuple(NAMED)
    requirement: ClassVar[str] = (
        f"{', '.join(NAMED)} or a block is needed, for example "
        "{base: silicate_s12, surface_energy: 25 mJ/m^2}"
    )

    name: str = Field("custom", description="name of the material in results and figures")
    radius: Annotated[float, Quantity("length", gt=0, le=1e-3)] = Field(
        description="radius of a grain"
    )
    density: Annotated[float, Quantity("density", gt=0, le=3e4, example="2.65 g/cm^3")] = Field(
        description="density of the solid"
    )
    surface_energy: Annotated[float, Quantity("surface energy", gt=0, le=10)] = Field(
        description="surface energy of one surface"
    )
    young_modulus: Annotated[float, Quantity("pressure", gt=0, le=1e13, example="54 GPa")] = Field(
        description="Young's modulus"
    )
    poisson_ratio: Annotated[float, Number(ge=0, lt=0.5)] = Field(description="Poisson's ratio")
    critical_rolling: Annotated[float, Quantity("length", gt=0, example="2 nm")] = Field(
        description="rolling displacement beyond which rolling dissipates energy (xi_crit)"
    )
    asperity_volume: Annotated[float, Quantity("length", gt=0, example="0.01 nm")] | None = Field(
        None, description="volume of asperities deformed at first contact, per area of contact"
    )

    properties: Annotated[tuple[tuple[str, float], ...], _Properties()] = Field(
        {}, description="properties that registered laws of contacts need, by name"
    )
    # no key of the YAML: the material that `with_scaling` was called for
    _unscaled: "Material | None" = PrivateAttr(None)

    @model_validator(mode="before")
    @classmethod
    def _expand(cls, data: Any) -> Any:
        if isinstance(data, str):
            return {"name": data, **_look_up(data)}
        if not isinstance(data, dict):
            return data if isinstance(data, Material) else _look_up(data)
        if mixed := [name for name in data if name in NAMED]:
            raise build_faults_error([("", _MIXTURE.format(name=mixed[0]))])
        if "base" not in data:
            return data
        base = data["base"]
        changed = {key: value for key, value in data.items() if key != "base"}
        name = base if not changed else f"{base}, changed"
        if not isinstance(base, str) or base not in NAMED:
            raise build_faults_error([("base", f"one of {', '.join(NAMED)} is needed")])
        return {"name": name, **NAMED[base], **changed}

    def faults(self) -> Faults:
        if self.critical_rolling >= self.radius:
            yield "critical_rolling", "it must be smaller than the radius of a grain"

    def with_scaling(self, mass: float, stiffness: float) -> "Material":
        """The unscaled material with its density and its Young's modulus multiplied.

        Parameters
        ----------
        mass
            Factor on the density (numerics.mass_scaling).
        stiffness
            Factor on Young's modulus (numerics.stiffness_scaling).
        """
        unscaled = self.unscaled
        if mass == stiffness == 1.0:
            return unscaled
        factors = {
            "density": mass * unscaled.density,
            "young_modulus": stiffness * unscaled.young_modulus,
        }
        scaled_material = unscaled.model_copy(update=factors)
        scaled_material._unscaled = unscaled
        return scaled_material

    @property
    def unscaled(self) -> "Material":
        """This material before `with_scaling`."""
        return self._unscaled or self

    @property
    def stiffness_scaling(self) -> float:
        """Young's modulus over that without scaling."""
        return self.young_modulus / self.unscaled.young_modulus

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: JsonHandler) -> JsonSchema:
        block = handler.resolve_ref_schema(handler(schema))
        numbers = block["properties"]
        base = {"enum": list(NAMED), "description": "the named material to start from"}
        return {
            "description": cls.__doc__,
            "anyOf": [
                {"enum": list(NAMED)},
                {**block, "properties": {"base": base, **numbers}, "required": ["base"]},
                block,
            ],
        }
