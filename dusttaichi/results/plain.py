"""Plain data of numbers, arrays and dataclasses, as YAML and JSON have them, and back."""

from dataclasses import fields, is_dataclass
from pathlib import Path
from types import UnionType
from typing import Any, cast, get_args, get_origin, get_type_hints

import numpy as np


def plain(value: Any) -> Any:
    """A value for YAML and JSON: without NumPy types, paths as texts, dataclasses as dicts."""
    if is_dataclass(value):
        return {f.name: plain(getattr(value, f.name)) for f in fields(value)}
    if isinstance(value, dict):
        return {k: plain(v) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(v) for v in value]
    if isinstance(value, Path):
        return str(value)
    return value.tolist() if isinstance(value, (np.generic, np.ndarray)) else value


def from_plain(value_type: Any, value: Any) -> Any:
    """Value of a type from what `plain` has made of it.

    The type is that of an array, a tuple, a dict of such values, or a dataclass with them.
    """
    if value is None:
        return None
    if isinstance(value_type, UnionType):  # with None
        value_type = get_args(value_type)[0]
    if is_dataclass(value_type):
        field_types, make = get_type_hints(value_type), cast(Any, value_type)
        return make(**{name: from_plain(field_types[name], item) for name, item in value.items()})
    if get_origin(value_type) is dict:
        return {name: from_plain(get_args(value_type)[1], item) for name, item in value.items()}
    container = get_origin(value_type) or value_type
    if container in (np.ndarray, tuple):
        return np.array(value) if container is np.ndarray else tuple(value)
    return value
