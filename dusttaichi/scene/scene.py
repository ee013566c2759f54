"""A whole scene: one block of the YAML file each, checked together, frozen."""

import copy
import html
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, ClassVar, cast

import yaml
from pydantic import PrivateAttr, ValidationError, ValidationInfo, field_validator

from dusttaichi import method
from dusttaichi.physics.geometry import AXES
from dusttaichi.scene import checks, extensions, plain_values, problems
from dusttaichi.scene.blocks import Path as KeyPath
from dusttaichi.scene.boundary import Boundary, bounded_axes, get_drive
from dusttaichi.scene.drive import Drive
from dusttaichi.scene.extensions import Extension
from dusttaichi.scene.fields import Block, Count, Faults, Field, NameLike, build_value_error
from dusttaichi.scene.material import DEFAULT
from dusttaichi.scene.numerics import CommonNumerics
from dusttaichi.scene.output import Interval, Output, becomes_due, default_intervals
from dusttaichi.scene.stage import Stage, StageOutput, StagePlan
from dusttaichi.scene.stop import Stop

NAME = r"^[A-Za-z0-9][A-Za-z0-9._-]{0,99}$"
RunName = Annotated[
    str,
    NameLike(
        NAME,
        "a text of at most 100 letters, digits, '.', '_' and '-' is needed, for example "
        '"omni_static"',
    ),
]


class Scene(Block):
    """Definition of a run by any method; all quantities are SI floats.

    Each method has a scene class of its own, with further blocks (GrainsScene), which `from_dict`
    selects by the key `method`.

    Attributes
    ----------
    source
        Text of the YAML file as read ("" without one).
    path
        Path of that file, or None.
    """

    SERIES_STEPS: ClassVar[int] = 1000  # between records where nothing is strained
    IGNORED: ClassVar[Mapping[str, str]] = {}  # see scene.checks.protocol

    name: RunName = Field(
        description="name of the run and of its directory: letters, digits, `.`, `_`, `-`"
    )
    extensions: tuple[Path, ...] = Field(
        (),
        description="Python files that register laws of the contact, kinds of samples or methods, "
        "imported before the rest is read; relative to the YAML file",
    )
    method: str = Field(description="method of simulation")
    boundary: Boundary = Field(description="walls and periodic faces")
    stop: Stop | None = Field(None, description="when the run ends; either this or stages")
    stages: tuple[Stage, ...] = Field(
        (),
        description="parts of the run in place of `stop`, one after another, each with its drive "
        "and its end",
    )
    numerics: CommonNumerics = Field(
        default_factory=CommonNumerics, description="time step, guards, threads"
    )
    output: Output = Field({}, description="variables, intervals and directory of the results")
    replicas: Count | None = Field(
        None,
        description="number of runs of this scene, each with the next seed; one run if not given",
    )

    _source: str = PrivateAttr("")
    _path: Path | None = PrivateAttr(None)
    _folder: Path | None = PrivateAttr(None)
    _input_data: dict[str, Any] | None = PrivateAttr(None)
    _imported: tuple[Extension, ...] = PrivateAttr(())

    @field_validator("extensions", mode="after")
    @classmethod
    def _in_folder(cls, value: tuple[Path, ...], info: ValidationInfo) -> tuple[Path, ...]:
        folder = (info.context or {}).get("folder")
        return tuple(extensions.find_file(path, folder) for path in value)

    @field_validator("output", mode="before")
    @classmethod
    def _fill_output(cls, value: Any, info: ValidationInfo) -> Any:
        if not isinstance(value, dict) or not {"name", "boundary"} <= info.data.keys():
            return value
        boundary = info.data["boundary"]
        stress = boundary.kind == "periodic" and bounded_axes(boundary) == AXES
        filled = {"directory": f"runs/{info.data['name']}", "stress": stress, **value}
        if not info.data.get("stages"):
            for name, interval in default_intervals(
                boundary, get_drive(boundary), cls.SERIES_STEPS
            ).items():
                if filled.get(name, "auto") == "auto":
                    filled[name] = interval
        return filled

    def faults(self) -> Faults:
        return checks.check(self)

    @property
    def stage_plans(self) -> tuple[StagePlan, ...]:
        """The stages with everything resolved; one without a name where there are none."""
        if not self.stages:
            stop = cast(Stop, self.stop)  # the checks refuse a scene without
            return (self._stage_plan("", get_drive(self.boundary), stop, None),)
        return tuple(self._stage_plan(s.name, s.drive, s.stop, s.output) for s in self.stages)

    def _stage_plan(
        self, name: str, drive: Drive, stop: Stop, stage_output: StageOutput | None
    ) -> StagePlan:
        defaults = default_intervals(self.boundary, drive, self.SERIES_STEPS)

        def interval(key: str) -> Any:
            if stage_output is not None and getattr(stage_output, key) != "auto":
                return getattr(stage_output, key)
            common = getattr(self.output, key)
            # an output common to all stages must not be refused for one in which nothing moves
            if common != "auto" and (
                stage_output is None or becomes_due(common, self.boundary, drive)
            ):
                return common
            default = defaults[key]
            if default == "auto" and common == "auto":
                return default
            return None if default in ("auto", "off") else Interval(**default)

        intervals = (interval(key) for key in ("series", "profiles", "snapshots"))
        return StagePlan(name, drive, stop, *intervals)

    def __eq__(self, other: object) -> bool:
        # Two files with equal blocks are the same scene; pydantic would compare their texts too.
        if not isinstance(other, Scene):
            return NotImplemented
        return all(getattr(self, key) == getattr(other, key) for key in type(self).model_fields)

    __hash__ = Block.__hash__

    @property
    def source(self) -> str:
        return self._source

    @property
    def path(self) -> Path | None:
        return self._path

    @property
    def imported_extensions(self) -> tuple[Extension, ...]:
        """The imported files of `extensions`."""
        return self._imported

    @property
    def imported_texts(self) -> list[str]:
        """Name and digest of each imported file, for results and checkpoints."""
        return [str(extension) for extension in self._imported]

    @classmethod
    def from_dict(
        cls,
        data: dict[str, Any],
        folder: str | Path | None = None,
        *,
        lines: Mapping[KeyPath, int] | None = None,
        title: str = "the scene",
        check_files: bool = False,
    ) -> "Scene":
        """Scene, of the class of its method, from the plain data of a YAML file.

        Parameters
        ----------
        data
        folder
            Folder of relative paths in `sample.file` and `extensions`. Default: the current
            directory.
        lines
            Path of a key -> line number, for errors.
        title
            Name of the scene in errors.
        check_files
            Refuse a `sample.file` that does not exist, and an extension that has changed since this
            process imported it.

        Raises
        ------
        DustError
            The data are no valid scene; one line for each problem.
        """
        imported = extensions.load(
            data, folder, lines=lines or {}, title=title, unchanged=check_files
        )
        context = {"folder": folder, "check_files": check_files}
        scene_class = _scene_class(data, lines or {}, title)
        try:
            scene = scene_class.model_validate(data, context=context)
        except ValidationError as error:
            problem_lines = problems.describe(scene_class, error, data, lines or {})
            raise problems.build_refusal(title, problem_lines) from None
        scene._imported = imported
        scene._input_data = copy.deepcopy(data)
        scene._folder = Path(folder) if folder is not None else None
        return scene

    def with_value(self, path: str, value: Any) -> "Scene":
        """New scene with one value changed; defaults that depend on other values follow the change.

        Parameters
        ----------
        path
            Keys joined by dots, such as "boundary.wall_speed" or "boundary.size.0".
        value
            As written in the YAML.

        Raises
        ------
        DustError
            The new scene is not valid.
        """
        return self.with_values({path: value})

    def with_values(self, values: dict[str, Any]) -> "Scene":
        """New scene with several values changed at once (path -> value), as by `with_value`."""
        data = self.input_data
        values = {path: plain_values.without_numpy(v) for path, v in values.items()}
        for path, value in values.items():
            plain_values.set_value(data, path.split("."), value, path)
        changes = ", ".join(f"{path} = {value!r}" for path, value in values.items())
        return self.with_data(data, title=f"the scene with {changes}")

    @property
    def input_data(self) -> dict[str, Any]:
        """Plain data of the YAML, without defaults; a copy that may be changed."""
        return self.plain if self._input_data is None else copy.deepcopy(self._input_data)

    def with_data(self, data: dict[str, Any], title: str = "the scene") -> "Scene":
        """New scene from other plain data, such as `input_data`, with the folder of this one.

        Parameters
        ----------
        data
        title
            Name of the scene in errors.

        Raises
        ------
        DustError
            The data are no valid scene.
        """
        scene = Scene.from_dict(data, self._folder, title=title)
        scene._path = self._path
        return scene

    @property
    def plain(self) -> dict[str, Any]:
        """Plain data of the YAML with every default."""
        data: dict[str, Any] = plain_values.without_none(self.model_dump(mode="json"))
        return data

    def to_yaml(self, absolute: bool = False) -> str:
        """YAML of the scene with every default; loads again to an equal scene.

        Parameters
        ----------
        absolute
            Write absolute paths of its files, so that they are found from any folder.
        """
        data = _absolute(self.plain) if absolute else self.plain
        return plain_values.write_text(data)

    def _repr_html_(self) -> str:
        """HTML for a notebook: a summary of the blocks, and the whole scene to unfold."""
        data = {k: v for k, v in yaml.safe_load(self.to_yaml()).items() if v not in (None, [], {})}
        rows = "".join(
            f"<tr><th style='text-align:left'>{key}</th><td style='text-align:left'>"
            f"{html.escape(_brief(value))}</td></tr>"
            for key, value in data.items()
            if key not in ("numerics", "output", "extensions")
        )
        full_yaml = html.escape(self.to_yaml())
        return (
            f"<table>{rows}</table><details><summary>with every default</summary>"
            f"<pre>{full_yaml}</pre></details>"
        )


def _brief(value: Any) -> str:
    """Numbers and words of a block, and of the blocks below it, on one line."""
    if isinstance(value, dict):
        entries = ((key, inner) for key, inner in value.items() if inner not in (None, [], {}))
        return ", ".join(f"{key}: {_brief(inner)}" for key, inner in entries)
    if isinstance(value, list):
        return "[" + ", ".join(map(_brief, value[:6])) + (", …]" if len(value) > 6 else "]")
    return str(value)


def _absolute(data: Any) -> Any:
    if isinstance(data, dict):
        file = data.get("file")
        absolute_paths: dict[str, Any] = {"file": str(Path(file).absolute())} if file else {}
        if extensions.KEY in data:
            absolute_paths[extensions.KEY] = [str(Path(p).absolute()) for p in data[extensions.KEY]]
        return {key: _absolute(value) for key, value in data.items()} | absolute_paths
    return [_absolute(value) for value in data] if isinstance(data, list) else data


class MaterialsScene(Scene):
    """A scene of a method with one `material` and further `materials` by name."""

    material: Block
    materials: dict[str, Block] = Field({})

    @field_validator("materials", mode="after")
    @classmethod
    def _names(cls, value: dict[str, Any]) -> dict[str, Any]:
        for name in value:
            if not re.fullmatch(NAME, name) or name == DEFAULT or name.isdigit():
                raise build_value_error(
                    f"\"{name}\" cannot name a material; letters, digits, '.', '_' and '-' are "
                    f'needed, not a number, and not "{DEFAULT}", which is the material above'
                )
        return value

    @property
    def all_materials(self) -> tuple[Block, ...]:
        """Materials by number: `material`, which walls have too, then `materials`."""
        return (self.material, *self.materials.values())

    @property
    def material_names(self) -> tuple[str, ...]:
        """Names of all materials, in the same order."""
        return (DEFAULT, *self.materials)


def _scene_class(data: dict[str, Any], lines: Mapping[KeyPath, int], title: str) -> type[Scene]:
    """Scene class of the method in the data; `grains` where they name none."""
    name = data.get("method", method.DEFAULT)
    if name not in method.METHODS:
        text = f"{' or '.join(method.METHODS)} is needed, or a file among `extensions` that has it"
        problem_line = problems.format_line(("method",), text, data, lines)
        raise problems.build_refusal(title, [problem_line])
    return cast(type[Scene], method.load_method(name).scene)
