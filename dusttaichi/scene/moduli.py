"""Elastic moduli from Young's modulus and Poisson's ratio, in place of K and mu/K."""

from typing import Annotated, Any

from pydantic import TypeAdapter, ValidationError

from dusttaichi.scene.fields import build_faults_error
from dusttaichi.scene.quantities import Quantity

YOUNG_MODULUS = TypeAdapter(Annotated[float, Quantity("pressure", gt=0, example="300 kPa")])
KEYS = ("poisson_ratio", "young_modulus")
SCHEMA = {
    "poisson_ratio": {"type": "number", "description": "Poisson's ratio"},
    "young_modulus": {"type": "string", "description": "Young's modulus, for bulk_modulus"},
}


def with_moduli(data: dict[str, Any]) -> dict[str, Any]:
    """Plain data with bulk_modulus and shear_ratio where it has KEYS.

    mu/K = 3 (1 - 2 nu)/(2 (1 + nu)) and K = E (3 + mu/K)/(9 mu/K). Raises a validation error for
    what is there twice, or is no such number.
    """
    out = {key: value for key, value in data.items() if key not in KEYS}
    if "poisson_ratio" in data:
        if "shear_ratio" in data:
            raise build_faults_error(
                [("poisson_ratio", "it is not allowed together with shear_ratio")]
            )
        nu = data["poisson_ratio"]
        if not isinstance(nu, (int, float)) or isinstance(nu, bool) or not 0 <= nu < 0.5:
            raise build_faults_error(
                [("poisson_ratio", "a number of at least 0 and below 0.5 is needed")]
            )
        out["shear_ratio"] = 1.5 * (1.0 - 2.0 * nu) / (1.0 + nu)
    if "young_modulus" in data:
        if "bulk_modulus" in data:
            raise build_faults_error(
                [("young_modulus", "it is not allowed together with bulk_modulus")]
            )
        ratio = out.get("shear_ratio")
        if not isinstance(ratio, (int, float)) or isinstance(ratio, bool) or not ratio > 0:
            raise build_faults_error(
                [("young_modulus", "it needs a poisson_ratio, or a shear_ratio")]
            )
        try:
            young = YOUNG_MODULUS.validate_python(data["young_modulus"])
        except ValidationError as error:
            raise build_faults_error([("young_modulus", error.errors()[0]["msg"])]) from None
        out["bulk_modulus"] = f"{young * (3.0 + ratio) / (9.0 * ratio)!r} Pa"
    return out
