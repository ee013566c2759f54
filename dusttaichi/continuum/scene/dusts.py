"""Dusts of the continuum by name or from a file, as plain data, and draws from fitted numbers."""

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from dusttaichi.scene import yaml_text
from dusttaichi.scene.fields import build_faults_error, refuse_unreadable
from dusttaichi.scene.paths import path_in

_DUST = {
    "bulk_modulus": "300 kPa",
    "exponent": 4,
    "solid_density": "2 g/cm^3",
    "density": "0.3 g/cm^3",
    "shear_ratio": 0.5,
    "compressive": {"phi_1": 0.12, "phi_2": 0.58, "p_m": "13 kPa", "delta": 0.58},
    "tensile": {"a": 2.8, "b": 1.48},
    "shear": "sqrt",
}
_NUMBERS = {
    # Güttler et al. 2009 (G09) section 4.1, calibrated with the bead; mu = K/2 is a choice, they
    # give no shear modulus.
    "dust_g09": {**_DUST, "compressive": {**_DUST["compressive"], "p_m": "1.3 kPa"}},
    # G09 Table 1: the static omnidirectional curve.
    "dust_static": _DUST,
}
_FITTED = "dust_grains"  # from grain runs; its file has the source of every number
NAMES = (*_NUMBERS, _FITTED)
NEEDED = (
    f"{', '.join(NAMES)}, the path of a file such as dust.yaml or a block is needed, for "
    "example {base: dust_g09, shear: tensile}"
)
_UNITS = {"bulk_modulus": " Pa", "compressive.p_m": " Pa"}  # of fitted numbers, SI
# numbers that are positive by nature: what is fitted, and drawn, is their logarithm
SCALES = frozenset({"bulk_modulus", "shear_ratio", "compressive.p_m", "shear.factor"})


def read_dust(name: Any, folder: str | Path = "", key: str = "") -> dict[str, Any]:
    """Plain data of a named dust, or of a file whose path is relative to the folder.

    Raises pydantic's ValidationError, at the key, for anything else.
    """
    if isinstance(name, str) and name in _NUMBERS:
        return {**_NUMBERS[name]}
    if name == _FITTED:
        return {**_read_fitted()}
    if not isinstance(name, str) or Path(name).suffix not in (".yaml", ".yml"):
        words = f"one of {', '.join(NAMES)} or the path of a file such as dust.yaml is needed"
        raise build_faults_error([(key, words if key else NEEDED)])
    return _read(path_in(folder, name), key)


@cache
def _read_fitted():
    return _read(Path(__file__).with_name(f"{_FITTED}.yaml"), "")


def _read(path, key):
    try:
        refuse_unreadable(path, yaml_text.MOST_CHARACTERS)
        data = yaml_text.read(path.read_text(encoding="utf-8")).data
    except UnicodeDecodeError as error:
        raise build_faults_error([(key, f"{path} is not a text file: {error.reason}")]) from None
    except (OSError, ValueError) as error:
        reason = "there is no such file" if isinstance(error, FileNotFoundError) else str(error)
        raise build_faults_error([(key, f"{reason} ({path})")]) from None
    except yaml.YAMLError as error:
        raise build_faults_error(
            [(key, f"{path} is not valid YAML: {' '.join(str(error).split())}")]
        ) from None
    if not isinstance(data, dict) or "base" in data:
        raise build_faults_error([(key, f"{path} does not contain the block of a material")])
    return data


def draw_numbers(data, draw, possible):
    """Plain data with the fitted numbers drawn from their covariance over the seeds.

    Numbers, or logarithms of SCALES, are normally distributed. draw: an integer of at least 1, the
    seed of a sequence, of which the first that possible(data) accepts is returned. Raises
    pydantic's ValidationError where there is no covariance, or nothing is accepted.
    """
    if isinstance(draw, bool) or not isinstance(draw, int) or draw < 1:
        raise build_faults_error(
            [("draw", "a whole number of at least 1 is needed, one for each draw")]
        )
    source = data.get("source") or {}
    try:
        names = source["names"]
        values = np.array(source["values"], dtype=float)
        covariance = np.array(source["covariance"], dtype=float).reshape(2 * (len(names),))
    except (KeyError, TypeError, ValueError):
        words = f"it needs a dust with a covariance: {_FITTED}, or a file of dust fit continuum"
        raise build_faults_error([("draw", words)]) from None
    logs = np.array([name in SCALES for name in names])
    scale = np.where(logs, values, 1.0)
    width, axes = _axes(covariance / np.outer(scale, scale))
    random = np.random.default_rng(draw)
    for _ in range(100):
        moved = width * (axes @ random.standard_normal(len(names)))
        numbers = np.where(logs, values * np.exp(np.where(logs, moved, 0.0)), values + moved)
        replaced = _replace_numbers(data, dict(zip(names, numbers.tolist(), strict=True)))
        if possible(replaced):
            return replaced
    words = "a hundred materials were drawn and none of them is possible: the fit is too uncertain"
    raise build_faults_error([("draw", words)])


def _axes(covariance):
    """Standard deviations, and a root of the correlation.

    The correlation is singular for few seeds, or slightly indefinite by the digits in a file.
    """
    width = np.sqrt(covariance.diagonal())
    safe = np.where(width > 0.0, width, 1.0)
    values, vectors = np.linalg.eigh(covariance / np.outer(safe, safe))
    return width, vectors * np.sqrt(np.maximum(values, 0.0))


def _replace_numbers(data, numbers):
    """Plain data without its source, with fitted numbers by name."""
    out = {
        key: {**value} if isinstance(value, dict) else value
        for key, value in data.items()
        if key != "source"
    }
    for name, number in numbers.items():
        block, _, key = name.rpartition(".")
        unit = _UNITS.get(name)
        (out[block] if block else out)[key] = f"{number!r}{unit}" if unit else number
    return out
