"""Interaction of grains: effects of the contact with their modifiers, and the damping."""

from typing import Annotated, Any, Literal

from pydantic import SerializeAsAny, field_validator

from dusttaichi.physics.contact import effect_registry
from dusttaichi.scene.fields import (
    Block,
    CoreSchema,
    Field,
    JsonHandler,
    JsonSchema,
    Number,
    Switch,
    build_faults_error,
    build_value_error,
)
from dusttaichi.scene.named_laws import RegisteredLaws, validate_law
from dusttaichi.scene.quantities import Quantity


class Effect(Block):
    """An inelastic effect that is switched on."""

    law: str = Field("linear", description="name of the law; others than linear are registered")
    modifier: Annotated[float, Number(gt=0)] = Field(
        1.0, description="factor on the spring constant (S12: 8 for rolling, 2.5 for sliding)"
    )


class NormalLaw(Block):
    """The law of the normal force, by its name."""

    law: str = Field("jkr", description="name of the law; others than jkr are registered")


class Asperities(Block):
    """Energy lost on flattening asperities when two surfaces first touch (PD08 section 2.2)."""

    yield_strength: Annotated[float, Quantity("pressure", gt=0, example="11 GPa")] = Field(
        "11 GPa", description="yield strength of the asperities, about 0.2 of Young's modulus"
    )
    volume: Annotated[float, Quantity("length", gt=0, example="0.01 nm")] | None = Field(
        None, description="volume deformed per area of contact; default that of the material"
    )


class Damping(Block):
    """Damping along the normal, by the name of its law."""

    model: str


class NoDamping(Damping):
    """No damping along the normal."""

    model: Literal["none"]


class Viscous(Damping):
    """Constant damping along the normal, as S12."""

    model: Literal["viscous"]
    kappa: Annotated[float, Quantity("mass rate", gt=0)] = Field(
        "1e-6 g/s", description="damping constant"
    )


class Scaled(Damping):
    """Damping constant from mass and characteristic time of the grains, as T19 eq 5."""

    model: Literal["scaled"]
    coefficient: Annotated[float, Number(gt=0)] = Field(
        0.01, description="k_n' of T19: damping constant in units of m0/t_c"
    )


class Viscoelastic(Damping):
    """Damping that grows with the contact radius, as Brilliantov 2007 and Krijt 2013."""

    model: Literal["viscoelastic"]
    time: Annotated[float, Quantity("time", gt=0, example="12.5 ps")] = Field(
        "12.5 ps", description="viscous relaxation time T_vis"
    )


BuiltInDamping = NoDamping | Viscous | Scaled | Viscoelastic
_MODELS = ("none", "viscous", "scaled", "viscoelastic")
_SWITCH = Switch(
    "on, off or a block with a modifier is needed, for example {modifier: 2.5}", on=True
)
_ASPERITIES = Switch(
    "on, off or a block is needed, for example {yield_strength: 11 GPa, volume: 0.01 nm}", on=True
)


class _DampingWord:
    """Allows the damping to be written as one word, with the default numbers."""

    requirement = (
        f"{', '.join(_MODELS)} or a block is needed, for example "
        "{model: viscous, kappa: 1e-6 g/s}"
    )

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: JsonHandler) -> JsonSchema:
        return {"anyOf": [{"enum": [*_MODELS, None]}, handler(schema)]}


def _validate_damping(value: Any) -> Block | None:
    """Block of a registered law of the damping; pydantic lists the allowed names of others."""
    name = value.get("model") if isinstance(value, dict) else getattr(value, "model", None)
    is_registered = isinstance(name, str) and name in effect_registry.names("damping")
    return validate_law(effect_registry, "damping", value, "model") if is_registered else None


class _Effects:
    """Adds the registered effects to the JSON Schema of `effects`."""

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: JsonHandler) -> JsonSchema:
        blocks = {
            name: effect_registry.block_of("effects", name)
            for name in effect_registry.names("effects")
        }
        schemas = {name: block.model_json_schema() for name, block in blocks.items() if block}
        return {"type": "object", "properties": schemas, "additionalProperties": False}


class Interaction(Block):
    """The contact model. Its normal law, by default JKR, is always on."""

    shear_modulus: Literal["mindlin", "printed"] = Field(
        "mindlin",
        description="1/G* = sum of (2-nu)/G (mindlin), or (2-nu^2)/G as the papers print it",
    )
    mixing: Literal["geometric", "arithmetic", "work_of_adhesion"] = Field(
        "geometric",
        description="surface energy of a contact between different materials: root of the product, "
        "mean, or gamma1 + gamma2 - 2/(1/gamma1 + 1/gamma2)",
    )
    normal: Annotated[
        SerializeAsAny[NormalLaw], RegisteredLaws(effect_registry, "normal", "law")
    ] = Field({}, description="force along the normal: law jkr, or one that is registered")
    rolling: Annotated[
        SerializeAsAny[Effect] | None, _SWITCH, RegisteredLaws(effect_registry, "rolling", "law")
    ] = Field({}, description="resistance to rolling")
    sliding: Annotated[
        SerializeAsAny[Effect] | None, _SWITCH, RegisteredLaws(effect_registry, "sliding", "law")
    ] = Field({}, description="resistance to sliding")
    twisting: Annotated[
        SerializeAsAny[Effect] | None, _SWITCH, RegisteredLaws(effect_registry, "twisting", "law")
    ] = Field({}, description="resistance to twisting")
    asperities: Annotated[Asperities | None, _ASPERITIES] = Field(
        None, description="energy lost on flattening asperities at first touch"
    )
    damping: SerializeAsAny[
        Annotated[
            BuiltInDamping,
            Field(discriminator="model"),
            _DampingWord(),
            RegisteredLaws(effect_registry, "damping", "model"),
        ]
    ] = Field({"model": "viscous"}, description="damping of the normal motion of a contact")

    effects: Annotated[dict[str, SerializeAsAny[Block]], _Effects] = Field(
        {}, description="further effects of the contacts, by the names they are registered under"
    )

    def asperity_volume(self, material: Any) -> float:
        """Volume of asperities deformed at first contact, per area [m]; 0 where they are off.

        It is that of the scene, else that of the material.
        """
        if self.asperities is None:
            return 0.0
        scene_volume = self.asperities.volume
        return (material.asperity_volume or 0.0) if scene_volume is None else scene_volume

    @field_validator("effects", mode="wrap")
    @classmethod
    def _validate_effects(cls, value: Any, handler: Any) -> Any:
        if not isinstance(value, dict):
            raise build_value_error("effects by name are needed, for example {sintered_neck: {}}")
        out = {}
        for name, block in value.items():
            effect_block = effect_registry.block_of("effects", name)
            if effect_block is None:
                names = ", ".join(effect_registry.names("effects")) or "none is registered here"
                raise build_faults_error(
                    [(str(name), f"the name of a registered effect is needed: {names}")]
                )
            out[name] = effect_block.model_validate({} if block in (True, "on", None) else block)
        return out

    @field_validator("normal", "rolling", "sliding", "twisting", mode="wrap")
    @classmethod
    def _validate_registered_law(cls, value: Any, handler: Any, info: Any) -> Any:
        return validate_law(effect_registry, info.field_name, value) or handler(value)

    @field_validator("damping", mode="wrap")
    @classmethod
    def _expand_damping_word(cls, value: Any, handler: Any) -> Any:
        return _validate_damping(value) or handler(cls._expand_damping(value))

    @staticmethod
    def _expand_damping(value: Any) -> Any:
        if value is None or value is False or value == "off":
            return {"model": "none"}
        if isinstance(value, str) and value in _MODELS:
            return {"model": value}
        if not isinstance(value, (dict, Block)):
            raise build_value_error(_DampingWord.requirement)
        return value
