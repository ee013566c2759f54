"""Materials of the continuum: dust with its strengths (Güttler et al. 2009, G09)."""

from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

from pydantic import (
    Field,
    SerializeAsAny,
    ValidationError,
    ValidationInfo,
    field_validator,
    model_validator,
)

from dusttaichi.continuum.physics import conditions, dust_laws
from dusttaichi.continuum.physics.laws.shear_product import WORDS as SHEAR
from dusttaichi.continuum.physics.material_numbers import CommonNumbers, MaterialNumbers
from dusttaichi.continuum.scene import dusts as continuum_dusts
from dusttaichi.scene import moduli
from dusttaichi.scene.fields import (
    Block,
    Faults,
    NamedBlock,
    Number,
    Seed,
    build_faults_error,
    build_value_error,
)
from dusttaichi.scene.moduli import with_moduli
from dusttaichi.scene.named_laws import RegisteredLaws, validate_law
from dusttaichi.scene.quantities import Quantity

Share = Annotated[float, Number(gt=0, lt=1)]


class DustLaw(Block):
    """A law of dust, by its name; laws of your own derive their block from it."""

    law: str = Field(description="name of the law")


class CompressiveLaw(DustLaw):
    """Sigma = p_m ((phi_2 - phi_1)/(phi_2 - phi) - 1)^(delta ln 10) (G09 eq 10)."""

    law: str = Field("g09", description="name of the law; others than g09 are registered")
    phi_1: Annotated[float, Number(ge=0, lt=1)] = Field(
        description="filling factor at which the compressive strength vanishes"
    )
    phi_2: Share = Field(description="filling factor at which it is infinite")
    p_m: Annotated[float, Quantity("pressure", gt=0, le=1e9, example="1.3 kPa")] = Field(
        description="compressive strength half way between phi_1 and phi_2: a pressure, and not "
        "the axial stress of confined pressing"
    )
    delta: Annotated[float, Number(gt=0, le=5)] = Field(
        description="width of the law in decades of pressure"
    )

    def faults(self) -> Faults:
        if self.phi_2 - self.phi_1 < 0.02:
            yield "phi_2", f"it must lie 0.02 or more above phi_1 = {self.phi_1:g}"


class TensileLaw(DustLaw):
    """T = -10^(a + b phi) Pa (G09 eq 8)."""

    law: str = Field(
        "exponential", description="name of the law; others than exponential are registered"
    )
    a: Annotated[float, Number(ge=-3, le=9)] = Field(
        description="lg of the tensile strength in Pa at filling factor 0"
    )
    b: Annotated[float, Number(ge=0, le=30)] = Field(
        description="growth of that lg with the filling factor"
    )


class ShearLaw(NamedBlock, DustLaw):
    """Y = factor Sigma^exponent |T|^(1 - exponent) (G09 sections 4.1 and 5.1.2)."""

    WORDS: ClassVar[dict[str, dict[str, Any]]] = {
        name: {"factor": factor, "exponent": exponent} for name, (factor, exponent) in SHEAR.items()
    }
    requirement: ClassVar[str] = (
        f"{', '.join(SHEAR)} or a block is needed, for example {{factor: 1, exponent: 0.5}}"
    )

    law: str = Field("product", description="name of the law; others than product are registered")
    factor: Annotated[float, Number(gt=0, le=100)] = Field(1.0, description="factor C")
    exponent: Annotated[float, Number(ge=0, le=1)] = Field(
        0.5, description="exponent a of the compressive strength"
    )


class ElasticityLaw(DustLaw):
    """K = bulk_modulus (rho/density)^exponent (G09 eq 15)."""

    law: str = Field("power", description="name of the law; others than power are registered")


class Damage(Block):
    """Flaws that grow into cracks under tension (Grady & Kipp 1980, Benz & Asphaug 1995)."""

    lg_k: Annotated[float, Number(ge=-30, le=60)] = Field(
        description="lg of k in m^-3: k strain^m flaws in a volume activate below a strain "
        "(Weibull); in two dimensions dust is a spacing deep"
    )
    m: Annotated[float, Number(ge=1, le=40)] = Field(description="Weibull exponent m")
    crack_speed: Annotated[float, Number(gt=0, le=1)] = Field(
        0.4, description="speed of a crack over the longitudinal speed of sound"
    )
    seed: Seed = Field(1, description="seed of the places of the flaws")


class Provenance(Block):
    """Provenance of fitted numbers: `dust fit continuum` writes it."""

    runs: tuple[str, ...] = Field((), description="the runs of the fit")
    dimension: Literal[2, 3] | None = Field(
        None, description="dimension of the samples and of the strains of the fit"
    )
    numbers: dict[str, str] = Field({}, description="number -> its source, points and spread")
    names: tuple[str, ...] = Field((), description="fitted numbers, in the order of values")
    values: tuple[float, ...] = Field((), description="their values as they were fitted, SI")
    covariance: tuple[tuple[float, ...], ...] = Field(
        (), description="covariance of the values over the seeds"
    )


class ContinuumMaterial(Block):
    """Material of dust: a name, a file of `dust fit continuum`, either with changes, or numbers.

    `base` names the material whose numbers are changed; `draw` draws them from their covariance.
    """

    extra_keys: ClassVar[tuple[str, ...]] = ("base", "draw", *moduli.KEYS)
    shorthands: ClassVar[tuple[str, ...]] = continuum_dusts.NAMES
    requirement: ClassVar[str] = continuum_dusts.NEEDED

    name: str = Field("custom", description="name of the material in results and figures")
    bulk_modulus: Annotated[float, Quantity("pressure", gt=0, le=1e12, example="300 kPa")] = Field(
        description="bulk modulus K_0 at `density`"
    )
    exponent: Annotated[float, Number(ge=1, le=20)] = Field(
        description="exponent of the bulk modulus, K = K_0 (rho/density)^exponent"
    )
    solid_density: Annotated[float, Quantity("density", gt=0, le=3e4, example="2 g/cm^3")] = Field(
        description="density of the solid, at which the filling factor is 1"
    )
    density: Annotated[float, Quantity("density", gt=0, le=3e4, example="0.3 g/cm^3")] = Field(
        description="density at zero pressure for which bulk_modulus is valid; default density of "
        "samples at the start"
    )
    shear_ratio: Annotated[float, Number(gt=0, le=1.5)] = Field(
        description="shear modulus over bulk modulus; poisson_ratio may be given in its place"
    )
    elasticity: Annotated[
        SerializeAsAny[ElasticityLaw], RegisteredLaws(dust_laws, "elasticity")
    ] = Field({}, description="law of the bulk modulus")
    compressive: Annotated[
        SerializeAsAny[CompressiveLaw], RegisteredLaws(dust_laws, "compressive")
    ] = Field(description="compressive strength Sigma")
    tensile: Annotated[SerializeAsAny[TensileLaw], RegisteredLaws(dust_laws, "tensile")] = Field(
        description="tensile strength T"
    )
    shear: Annotated[SerializeAsAny[ShearLaw], RegisteredLaws(dust_laws, "shear")] = Field(
        "sqrt", description="shear strength Y"
    )
    damage: Damage | None = Field(
        None, description="damage by tension: flaws that grow, default none"
    )
    heat_capacity: (
        Annotated[float, Quantity("heat capacity", gt=0, example="800 J/(kg K)")] | None
    ) = Field(None, description="heat capacity; with it the result has a temperature")
    temperature: Annotated[float, Quantity("temperature", ge=0, example="280 K")] = Field(
        "0 K", description="temperature at the start; the strengths do not depend on it"
    )
    source: Provenance | None = Field(None, description="provenance of the numbers")

    @model_validator(mode="before")
    @classmethod
    def _expand(cls, data: Any, info: ValidationInfo) -> Any:
        if isinstance(data, ContinuumMaterial):
            return data
        if isinstance(data, str):
            return with_moduli(cls._read_named(data, info))
        if not isinstance(data, dict):
            raise build_value_error(cls.requirement)
        if "base" not in data:
            if "draw" in data:
                raise build_faults_error([("draw", "it needs a `base` that has a covariance")])
            return with_moduli(data)
        expanded = {**cls._read_named(data["base"], info, "base"), "name": Path(data["base"]).stem}
        changed = {key: value for key, value in data.items() if key not in ("base", "draw")}
        if "draw" in data:
            expanded = continuum_dusts.draw_numbers(expanded, data["draw"], cls._possible)
            expanded["name"] += f", draw {data['draw']}"
        if changed:
            expanded["name"] += ", changed"
        for key, value in changed.items():
            expanded[key] = cls._change_key(key, expanded.get(key), value)
        if "poisson_ratio" in changed and "shear_ratio" not in changed:
            expanded.pop("shear_ratio", None)
        if "young_modulus" in changed and "bulk_modulus" not in changed:
            expanded.pop("bulk_modulus", None)
        return with_moduli(expanded)

    @staticmethod
    def _change_key(key: str, former: Any, value: Any) -> Any:
        """Plain data of a key with changes; another law keeps none of the former numbers."""
        if not (isinstance(value, dict) and isinstance(former, dict)):
            return value
        law = former.get("law", dust_laws.DEFAULT.get(key))
        return {**former, **value} if value.get("law", law) == law else value

    @field_validator("compressive", "tensile", "shear", "elasticity", mode="wrap")
    @classmethod
    def _validate_registered_law(cls, value: Any, handler: Any, info: ValidationInfo) -> Any:
        return validate_law(dust_laws, info.field_name, value) or handler(value)

    @staticmethod
    def _read_named(name: Any, info: ValidationInfo, key: str = "") -> dict[str, Any]:
        """Plain data of a named dust or of a file; its default name is that of the file."""
        expanded = continuum_dusts.read_dust(name, (info.context or {}).get("folder") or "", key)
        return {"name": Path(name).stem, **expanded}

    @classmethod
    def _possible(cls, data: dict) -> bool:
        """True for plain data of a valid material."""
        try:
            cls.model_validate(data)
        except ValidationError:
            return False
        return True

    def faults(self) -> Faults:
        conflict = dust_laws.describe_conflict(dust_laws.laws_of([self]), CommonNumbers.names())
        if conflict is not None:
            return [("", conflict)]
        return conditions.impossible(MaterialNumbers.from_material(self))

    @property
    def filling_factor(self) -> float:
        """Initial filling factor."""
        return self.density / self.solid_density

    @property
    def poisson_ratio(self) -> float:
        """Poisson's ratio, (3 - 2 mu/K)/(6 + 2 mu/K)."""
        return (3.0 - 2.0 * self.shear_ratio) / (6.0 + 2.0 * self.shear_ratio)

    @classmethod
    def __get_pydantic_json_schema__(cls, schema, handler):
        block = handler.resolve_ref_schema(handler(schema))
        base = {"type": "string", "description": "the named material or file to start from"}
        draw = {
            "type": "integer",
            "minimum": 1,
            "description": "draw the fitted numbers of the base from their covariance over the "
            "seeds; the number of the draw",
        }
        numbers = {"base": base, "draw": draw, **block["properties"], **moduli.SCHEMA}
        some = {
            key: _changed_schema(key, built_in)
            for key, built_in in (("compressive", CompressiveLaw), ("tensile", TensileLaw))
        }
        partial = {**block, "properties": {**numbers, **some}, "required": ["base"]}
        return {
            "description": cls.__doc__,
            "anyOf": [{"type": "string", "examples": list(continuum_dusts.NAMES)}, partial, block],
        }


def _changed_schema(key: str, built_in: type[DustLaw]) -> dict[str, Any]:
    """Schema of a strength where the material has a base: some of its numbers, or another law."""
    properties = built_in.model_json_schema()["properties"]
    numbers = {"type": "object", "properties": properties, "additionalProperties": False}
    laws = RegisteredLaws(dust_laws, key).build_schemas()
    text = f"changed numbers of the {key} strength, or another law"
    return {"description": text, **({"anyOf": [numbers, *laws]} if laws else numbers)}
