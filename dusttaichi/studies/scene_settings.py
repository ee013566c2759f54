"""Settings of scenes: keys with their values, seeds, files."""

import itertools
import os
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import yaml

from dusttaichi.errors import DustError
from dusttaichi.results.plain import plain
from dusttaichi.scene import Scene
from dusttaichi.scene.dimensions import DIMENSIONS
from dusttaichi.scene.fields import Block
from dusttaichi.scene.keys import collect_annotations
from dusttaichi.scene.quantities import Quantity, split_quantity
from dusttaichi.scene.yaml_text import read

SINGLE_VALUED = ("name", "replicas")  # keys of which all runs of a sweep have the same value


class Choice(NamedTuple):
    """A value of a key: as text, which names directories, and as plain data of the YAML."""

    text: str
    value: Any


# Settings of a sweep: texts "key=value,value", or the values of each key as plain data or Choices.
Settings = list[str] | Mapping[str, Any]


@dataclass(frozen=True)
class Axis:
    """A key of a sweep with its values: as texts, as plain data of the YAML, and as coordinate.

    coordinate: (values,) SI floats, whole numbers, or texts where a value is not a number.
    unit: of the coordinate, or None.
    """

    key: str
    texts: tuple[str, ...]
    values: tuple[Any, ...]
    coordinate: np.ndarray
    unit: str | None

    @property
    def dimension(self) -> str:
        """Name of the dimension, a valid keyword such as boundary_wall_speed."""
        return re.sub(r"\W", "_", self.key)


def find_keys(
    block: dict[str, Any], key: str, path: tuple[str, ...] = ()
) -> Iterator[tuple[tuple[str, ...], dict[str, Any]]]:
    """(path of the key, the block that contains it) for each `key` at any depth."""
    for name, value in block.items():
        if name == key and value is not None:
            yield (*path, name), block
        elif isinstance(value, dict):
            yield from find_keys(value, key, (*path, name))


def make_files_relative(block: dict[str, Any]) -> list[str]:
    """Change the files of a block, at any depth, to relative paths; returns them.

    They are relative to the current directory and valid on a cluster, too.
    """
    blocks = [inner for _, inner in find_keys(block, "file")]
    for inner in blocks:
        inner["file"] = os.path.relpath(inner["file"])
    return [inner["file"] for inner in blocks]


def make_portable(data: dict[str, Any]) -> list[str]:
    """Change the files of a scene (its data) to relative paths, see `relative_files`; returns them.

    They are those of the sample, and extensions.
    """
    data["extensions"] = [os.path.relpath(path) for path in data["extensions"]]
    return replace_run_directories(
        [*make_files_relative(data.get("sample", {})), *data["extensions"]]
    )


def set_one_thread(data: dict[str, Any]) -> dict[str, Any]:
    """The data of one of many small scenes, on one thread where the number is `auto`; in place."""
    if data["numerics"]["threads"] == "auto":
        data["numerics"]["threads"] = 1
    return data


def shift_seeds(sample: dict[str, Any], number: int) -> dict[str, Any]:
    """The block of a sample with `number` added to every seed, at any depth; in place."""
    for _, block in find_keys(sample, "seed"):
        block["seed"] += number
    return sample


def list_input_files(scene: Scene) -> list[str]:
    """Paths of the files of the sample of a scene, and of its extensions."""
    data = scene.plain
    paths = [block["file"] for _, block in find_keys(data.get("sample", {}), "file")]
    return replace_run_directories([*paths, *data["extensions"]])


def replace_run_directories(paths: list[str]) -> list[str]:
    """The paths, in place of run directories those of their results."""
    return [os.path.join(path, "result.nc") if os.path.isdir(path) else path for path in paths]


def make_grid(scene: Scene, settings: Settings) -> tuple[tuple[Axis, ...], list[Scene]]:
    """(axes, scenes of all points, the last axis fastest) of `settings`. Raises DustError."""
    axes = _make_axes(scene, parse_choices(settings)) if settings else ()
    points = itertools.product(*(range(len(axis.texts)) for axis in axes))
    return axes, [_make_scene(scene, axes, point) for point in points]


def apply_settings(scene: Scene, settings: Settings) -> Scene:
    """The scene with `settings` of a single value each applied. Raises DustError."""
    axes, scenes = make_grid(scene, settings)
    for axis in axes:
        if len(axis.texts) > 1:
            hint = "" if axis.key in SINGLE_VALUED else " (dust sweep takes them)"
            raise DustError(f"--set {axis.key}: must be one value here{hint}")
    return scenes[0]


def apply_common_settings(
    scene: Scene, settings: Settings
) -> tuple[Scene, dict[str, list[Choice]]]:
    """(scene with the settings of SINGLE_VALUED, the other settings). Raises DustError."""
    choices = parse_choices(settings)
    common = {key: choices.pop(key) for key in SINGLE_VALUED if key in choices}
    return (apply_settings(scene, common) if common else scene), choices


# -- sweeps --------------------------------------------------------------------------------------


def parse_choices(settings: Settings) -> dict[str, list[Choice]]:
    """Values of each key of settings. Raises DustError."""
    if isinstance(settings, Mapping):
        choices = {key: _make_choices(key, values) for key, values in settings.items()}
    else:
        texts_of = _split_settings(settings).items()
        choices = {key: [Choice(t, _parse_value(key, t)) for t in texts] for key, texts in texts_of}
    if "output.directory" in choices:
        raise DustError("--set output.directory: use --output instead")
    return choices


def _make_choices(key: str, values: Any) -> list[Choice]:
    """The Choices of a key from the value, or values, of a script."""
    if isinstance(values, (str, bytes, Mapping)) or not isinstance(values, Iterable):
        values = [values]
    choices = [v if isinstance(v, Choice) else Choice(_format_value(v), plain(v)) for v in values]
    if not choices:
        raise DustError(f"{key}: at least one value is needed")
    return choices


def _format_value(value: Any) -> str:
    """Text of a value, as one would write it in YAML on one line."""
    value = plain(value)
    if isinstance(value, str):
        return value
    if isinstance(value, float):
        return repr(value)
    text: str = yaml.safe_dump(value, default_flow_style=True, width=10**6, sort_keys=False)
    return text.removesuffix("...\n").strip()


def _split_settings(settings: list[str]) -> dict[str, list[str]]:
    """Texts of the values of each key."""
    texts_by_key: dict[str, list[str]] = {}
    for setting in settings:
        key, equals, text = setting.partition("=")
        key, texts = (
            key.strip(),
            add_common_unit([value.strip() for value in _split_at_commas(text)]),
        )
        if not equals or not key or not all(texts):
            raise DustError(
                f"--set {setting}: must be a key and its values, such as "
                "--set boundary.wall_speed=1cm/s,5cm/s"
            )
        if key in texts_by_key:
            raise DustError(f"--set {key}: given twice; separate its values by commas")
        texts_by_key[key] = texts
    return texts_by_key


def add_common_unit(texts: list[str]) -> list[str]:
    """The values of a setting; where the last alone has a unit, the numbers before have it, too."""
    numbers_and_units = [split_quantity(text) for text in texts]
    units = [pair and pair[1] for pair in numbers_and_units]
    if not units[-1] or any(units[:-1]):
        return texts
    return [f"{text} {units[-1]}" if pair and not pair[1] else text
            for text, pair in zip(texts, numbers_and_units, strict=True)]  # fmt: skip


def _split_at_commas(text: str) -> list[str]:
    """Parts between commas outside brackets, braces and quotes."""
    values, depth, quote = [""], 0, ""
    for letter in text:
        if quote:
            quote = "" if letter == quote else quote
        elif letter in "\"'":
            quote = letter
        else:
            depth += (letter in "[{") - (letter in "]}")
        if letter == "," and depth == 0 and not quote:
            values.append("")
        else:
            values[-1] += letter
    return values


def _make_axes(scene: Scene, choices: dict[str, list[Choice]]) -> tuple[Axis, ...]:
    """The axes of choices. Keys with a single value may need each other: they change together."""
    axes, problems = [], []
    if single := {
        key: single_values[0].value
        for key, single_values in choices.items()
        if len(single_values) == 1
    }:
        scene = scene.with_values(single)
    for key, choices_of_key in choices.items():
        texts, values = zip(*choices_of_key, strict=True)
        scenes = [scene] if key in single else []
        for value in [] if key in single else values:
            try:
                scenes.append(scene.with_value(key, value))
            except DustError as error:
                problems.append(str(error))
        if len(scenes) == len(texts):
            axes.append(Axis(key, texts, values, *_make_coordinate(scenes, key, texts)))
    for axis in axes:
        if len(set(axis.coordinate.tolist())) < len(axis.texts):
            problems.append(f"--set {axis.key}={','.join(axis.texts)}: a value is given twice")
    if problems:
        raise DustError("\n".join(problems))
    return tuple(axes)


def _parse_value(key: str, text: str) -> Any:
    """The value of a setting; a name is a text without quotes, too. Raises DustError."""
    try:
        data = read(text).data
        return text if key == "name" and isinstance(data, (int, float)) else data
    except yaml.YAMLError as error:
        problem = str(error).splitlines()[0]
        raise DustError(f"{key} = {text}: not valid YAML: {problem}") from None


def _make_scene(scene: Scene, axes: tuple[Axis, ...], point: tuple[int, ...]) -> Scene:
    values = {axis.key: axis.values[i] for axis, i in zip(axes, point, strict=True)}
    return scene.with_values(values) if values else scene


def _make_coordinate(
    scenes: list[Scene], key: str, texts: tuple[str, ...]
) -> tuple[np.ndarray, str | None]:
    """(values, unit) of a key in resolved scenes; (texts, None) where they are not numbers."""
    values_and_quantities = [_look_up(scene, key.split(".")) for scene in scenes]
    if all(
        isinstance(v, (int, float)) and not isinstance(v, bool) for v, _ in values_and_quantities
    ):
        quantity = values_and_quantities[0][1]
        unit = DIMENSIONS[quantity.dimension].unit if quantity else None
        return np.array([v for v, _ in values_and_quantities]), unit
    return np.array(texts), None


def _look_up(scene: Scene, keys: list[str]) -> tuple[Any, Quantity | None]:
    """(value, Quantity or None) at the path `keys`; (None, None) for a shorthand."""
    value, mark = scene, None
    for key in keys:
        if isinstance(value, Block) and key in type(value).model_fields:
            field = type(value).model_fields[key]
            mark = next(
                (
                    annotation
                    for annotation in collect_annotations(field)
                    if isinstance(annotation, Quantity)
                ),
                None,
            )
            value = getattr(value, key)
        elif isinstance(value, tuple) and key.isdigit():
            value = value[int(key)]
        else:
            return None, None
    return value, mark
