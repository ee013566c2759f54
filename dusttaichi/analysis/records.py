"""Protocol of a run for measurements: its records and its scene, and properties that follow.

`Run`, which has it, imports the measurements that its properties use, and they this file.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    import xarray as xr


class Records(Protocol):
    """Content of a result file or of a stage; the members are described in Run and RunKind."""

    path: Path
    series: xr.Dataset
    stage_name: str
    _record_before: int | None

    @property
    def name(self) -> str: ...

    @property
    def title(self) -> str: ...

    @property
    def tree(self) -> xr.DataTree | None: ...

    @property
    def scene(self) -> dict[str, Any]: ...

    @property
    def sample(self) -> dict[str, Any]: ...

    @property
    def boundary(self) -> str: ...

    @property
    def grains(self) -> int | None: ...

    @property
    def parts(self) -> Sequence[Records]: ...

    def part_that(self, condition: str) -> Records: ...

    @property
    def start(self) -> xr.Dataset: ...

    @property
    def snapshots(self) -> xr.Dataset | None: ...

    @property
    def snapshot_count(self) -> int: ...

    @property
    def compresses(self) -> bool: ...

    @property
    def stretches(self) -> bool: ...

    @property
    def unloads(self) -> bool: ...

    @property
    def has_tension(self) -> bool: ...

    @property
    def has_top_pressure(self) -> bool: ...

    @property
    def growth(self) -> float: ...
