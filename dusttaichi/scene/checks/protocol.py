"""A scene as the checks see it, whose class imports them."""

from collections.abc import Mapping
from typing import ClassVar, Protocol

from dusttaichi.scene.boundary import BoundaryBlock
from dusttaichi.scene.numerics import CommonNumerics
from dusttaichi.scene.output import Output
from dusttaichi.scene.stage import Stage, StagePlan
from dusttaichi.scene.stop import Stop


class Scene(Protocol):
    """Blocks that all methods share."""

    # keys of the common blocks drive, output and stop that the method does not read, for example
    # "drive.sphere_speed", with the reason and advice: another value than the default is refused
    IGNORED: ClassVar[Mapping[str, str]]

    @property
    def method(self) -> str: ...
    @property
    def boundary(self) -> BoundaryBlock: ...
    @property
    def stop(self) -> Stop | None: ...
    @property
    def stages(self) -> tuple[Stage, ...]: ...
    @property
    def numerics(self) -> CommonNumerics: ...
    @property
    def output(self) -> Output: ...
    @property
    def stage_plans(self) -> tuple[StagePlan, ...]: ...
