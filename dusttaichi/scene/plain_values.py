"""Plain data of a YAML file: written as text, and changed by the path of a key."""

from typing import Any

import yaml
from pydantic_core import to_jsonable_python

from dusttaichi.errors import DustError

_Base: Any = getattr(yaml, "CSafeDumper", yaml.SafeDumper)  # of libyaml, where there is one


class Dumper(_Base):
    """Dumper with one line for a list of plain values, and one for each key otherwise."""

    def represent_list(self, data: list[Any]) -> yaml.Node:
        flow = not any(isinstance(item, (list, dict)) for item in data)
        return self.represent_sequence("tag:yaml.org,2002:seq", data, flow_style=flow)

    def ignore_aliases(self, data: Any) -> bool:
        return True


Dumper.add_representer(list, Dumper.represent_list)


def write_text(data: Any) -> str:
    """YAML of plain data, with the keys in their order."""
    options = {"sort_keys": False, "allow_unicode": True, "width": 1000}
    return str(yaml.dump(data, Dumper=Dumper, **options))


def without_numpy(value: Any) -> Any:
    """A value of Python as plain data: of arrays lists, of NumPy's numbers those of Python."""
    return to_jsonable_python(
        value, fallback=lambda item: item.tolist() if hasattr(item, "tolist") else repr(item)
    )


def without_none(data: Any) -> Any:
    """Data without the keys whose value is None."""
    if isinstance(data, dict):
        return {key: without_none(item) for key, item in data.items() if item is not None}
    if isinstance(data, list):
        return [without_none(item) for item in data]
    return data


# Key of the word of a shorthand that becomes a block when a value inside it is set.
_BLOCK_KEY = {"material": "base", "damping": "model"}


def set_value(data: dict[str, Any], keys: list[str], value: Any, path: str) -> None:
    """Set one value of plain data; words of shorthands become blocks on the way."""
    container: Any = data
    key: str | int
    for depth, key in enumerate(keys):
        last = depth == len(keys) - 1
        if isinstance(container, list):
            if not key.isdigit() or int(key) >= len(container):
                raise DustError(
                    f"{path}: a number from 0 to {len(container) - 1} is needed, not {key}"
                )
            key = int(key)
        elif not isinstance(container, dict):
            above = ".".join(keys[:depth])
            raise DustError(f"{path}: {above} = {container!r} has no keys below it")
        if last:
            container[key] = value
            return
        below = container.get(key) if isinstance(container, dict) else container[key]
        if isinstance(below, str) and key in _BLOCK_KEY:
            container[key] = {_BLOCK_KEY[key]: below}
        elif isinstance(below, str) and keys[:depth] == ["materials"]:
            container[key] = {"base": below}
        elif below in (None, "on", "off") or isinstance(below, bool):
            container[key] = {}
        container = container[key]
