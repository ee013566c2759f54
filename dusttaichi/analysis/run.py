"""One run from its result file, and its stages."""

from __future__ import annotations

import copy
import importlib
from collections.abc import Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from dusttaichi import method
from dusttaichi.analysis import foreign
from dusttaichi.analysis.kind import RunKind, add_draft_reason
from dusttaichi.analysis.names import format_run_name
from dusttaichi.analysis.stored import explain_missing_result
from dusttaichi.errors import DustError
from dusttaichi.physics.geometry import WALLS
from dusttaichi.results.datasets import take_record, take_records
from dusttaichi.results.reading import load_groups, load_variable, open_tree
from dusttaichi.scene import extensions, quantities
from dusttaichi.scene.material import Material
from dusttaichi.scene.paths import user_path

if TYPE_CHECKING:
    import xarray as xr

    from dusttaichi.method import Method


SHOWN_BY = "dusttaichi.report.notebook"  # imported where a notebook shows a run


class Run(RunKind, AbstractContextManager["Run"]):
    """A result file, or one stage of it (`stage`). Use `open_run`.

    Where `tree` has been used, close the run, or use it as a context manager.

    Attributes
    ----------
    series
        xr.Dataset of the time series, in memory.
    profiles
        xr.Dataset, in memory; None where there are none.
    attrs
        Global attributes.
    whole
        The run that a stage belongs to; a run itself.
    stage_name
        "" of a whole run.
    """

    def __init__(
        self,
        path: str | Path,
        series: xr.Dataset,
        profiles: xr.Dataset | None = None,
        file: str | Path | None = None,
    ) -> None:
        self.path, self.series, self.profiles = Path(path), series, profiles
        self.attrs = foreign.check_attributes(series.attrs, path)
        self.whole: Run = self
        self._file = file
        self._tree: xr.DataTree | None = None
        self._record_before: int | None = None  # number of the last record before a stage
        self.stage_name = ""

    def __repr__(self) -> str:
        stage = f", stage {self.stage_name}" if self.stage_name else ""
        words = [word for word in ("grains", "particles") if word in self.attrs]
        size = "".join(f"{int(self.attrs[word]):,} {word}, " for word in words[:1])
        times = self.series.time.values
        time = quantities.format(float(times[-1]) if len(times) else 0.0, "time", digits=4)
        size += f"{len(times):,} records to t = {time}"
        return f"<Run {self.name}{stage}: {self.status}; {size}; {self.path}>"

    @property
    def tree(self) -> xr.DataTree | None:
        """xr.DataTree of the whole file, opened when first used; None without a file."""
        root = self.whole
        if root._tree is None and root._file is not None:
            root._tree = open_tree(root._file)
        return root._tree

    @property
    def name(self) -> str:
        """Name for people: of a point of a study by its changed keys; marked for a draft.

        Its base is the title of the run, or the name of its folder.
        """
        folder = self.path.resolve().parent.name
        return add_draft_reason(format_run_name(self.title, self.scene, folder), self.scene)

    @property
    def title(self) -> str:
        """Name of the scene of the run, or of its folder."""
        return str(self.attrs.get("title") or self.path.resolve().parent.name)

    @property
    def status(self) -> str:
        """State of the run: "running", "finished: ...", "interrupted" ..."""
        return str(self.attrs.get("status", "unknown"))

    @property
    def scene(self) -> dict[str, Any]:
        """The resolved scene as plain dicts, {} where the file has none."""
        return foreign.parse_block(self.attrs, "scene_resolved", self.path)

    @property
    def sample(self) -> dict[str, Any]:
        """Description of the sample in the result, a dict; {} where there is none."""
        return foreign.parse_block(self.attrs, "sample", self.path)

    @property
    def method(self) -> Method:
        """The Method that computed it; a mere name where that is not installed."""
        return method.of_result(self.scene)

    @property
    def boundary(self) -> str:
        """Kind of the boundary: "box", "plates", "periodic", "open", or "" if unknown."""
        return str(self.scene.get("boundary", {}).get("kind", ""))

    @property
    def material(self) -> Material | None:
        """Material of the grains (SI), or None where the file has none."""
        numbers = self.scene.get("material")
        return None if numbers is None else Material.model_validate(numbers)

    @property
    def grains(self) -> int | None:
        """Number of grains, or None if unknown."""
        return int(self.attrs["grains"]) if "grains" in self.attrs else None

    # Stages.

    @property
    def stages(self) -> tuple[str, ...]:
        """Names of the stages of the scene, in order; () where it has none."""
        return tuple(self.attrs.get("stages", "").split()) if "stage" in self.series else ()

    def stage(self, name_or_number: str | int) -> Run:
        """The stage with this name or number (from 0) as a Run: its series, profiles, snapshots.

        Its `start` is the last record of the stage before.

        Raises
        ------
        DustError
            The stage does not exist or has not begun.
        """
        names, number = self.whole.stages, name_or_number
        if isinstance(number, str) and number in names:
            number = names.index(number)
        if isinstance(number, str) or number not in range(len(names)):
            stages = f"its stages are {', '.join(names)}" if names else "it has no stages"
            raise DustError(f"{self.path} has no stage {name_or_number!r}: {stages}.")
        series = self.whole.series
        records = np.flatnonzero(series.stage.values == number)
        if not len(records):
            raise DustError(f"{self.path}: stage {names[number]} has not begun.")
        view = copy.copy(self.whole)
        view.stage_name = names[number]
        view._record_before = records[0] - 1 if records[0] else None
        view.series = take_records(series, "time", records)
        if view.profiles is not None:
            inside = np.flatnonzero(view._holds(view.profiles.step.values))
            view.profiles = take_records(view.profiles, "profile", inside) if len(inside) else None
        return view

    def beyond(self, filling_factor: float) -> Run:
        """This run with the records of a larger filling factor only."""
        view = copy.copy(self)
        records = np.flatnonzero(self.series.filling_factor.values > filling_factor)
        view.series = take_records(self.series, "time", records)
        return view

    @property
    def parts(self) -> list[Run]:
        """The stages that have begun, or the run itself without stages."""
        if self.whole is not self or not self.stages:
            return [self]
        started = set(self.series.stage.values.tolist())
        return [self.stage(number) for number in range(len(self.stages)) if number in started]

    def part_that(self, condition: str) -> Run:
        """The first stage that fulfils a property of a Run such as "compresses", else the run."""
        return next((stage for stage in self.parts if getattr(stage, condition)), self)

    @property
    def start(self) -> xr.Dataset:
        """The initial record: the last of the stage before, or the first."""
        if self._record_before is None:
            return take_record(self.series, "time", 0)
        return take_record(self.whole.series, "time", self._record_before)

    def _holds(self, steps: NDArray[np.integer]) -> NDArray[np.bool_]:
        """True for `steps` between the start and the last record, both included."""
        if not len(self.series.time):
            return np.zeros(len(steps), dtype=bool)
        return (steps >= int(self.start.step)) & (steps <= int(self.series.step.values[-1]))

    # Snapshots.

    @property
    def snapshots(self) -> xr.Dataset | None:
        """/snapshots as an xr.Dataset read when used, or None: position (snapshot, grain, xyz) ...

        A stage has those from its start to its end.
        """
        numbers, tree = self._snapshot_numbers(), self.tree
        if not len(numbers) or tree is None:
            return None
        return take_records(tree.children["snapshots"].to_dataset(), "snapshot", numbers)

    @property
    def snapshot_count(self) -> int:
        """Number of the snapshots that `snapshots` has, 0 without any."""
        return len(self._snapshot_numbers())

    def _snapshot_numbers(self) -> NDArray[np.intp]:
        steps = self._read_snapshot_steps()
        return np.arange(len(steps)) if self.whole is self else np.flatnonzero(self._holds(steps))

    def _read_snapshot_steps(self) -> NDArray[np.integer]:
        root = self.whole
        if root._file is not None and root._tree is None:  # opens no tree, which takes longer
            return load_variable(root._file, "snapshots", "step")
        if root._tree is None or "snapshots" not in root._tree.children:
            return np.zeros(0, dtype=int)
        steps: NDArray[np.integer] = root._tree["snapshots"].step.values
        return steps

    def period(self, snapshot: int = -1) -> NDArray[np.float64]:
        """Edges of the cell in a snapshot [m], (3,), nan along an axis that is not periodic.

        Raises
        ------
        DustError
            The cell is periodic, and there are no snapshots.
        """
        edges, snapshots = np.full(3, np.nan), self.snapshots
        for n in map("xyz".index, self.attrs.get("periodic_axes", "").split()):
            if snapshots is None:
                raise DustError(f"{self.path} has no snapshots: set output: snapshots.")
            box = snapshots.box.isel(snapshot=snapshot)
            edges[n] = float(box.sel(wall=WALLS[2 * n + 1]) - box.sel(wall=WALLS[2 * n]))
        return edges

    def contacts(
        self, snapshot: int = -1, group: str = "contacts", names: Sequence[str] | None = None
    ) -> xr.Dataset:
        """Contacts of one snapshot.

        Parameters
        ----------
        snapshot : int
        group : str
            "contacts", "wall_contacts" or "sphere_contacts".
        names : sequence of str, optional
            Variables to read, of those that there are. Default: all.

        Returns
        -------
        xarray.Dataset

        Raises
        ------
        DustError
            The result has no contacts.
        IndexError
            There is no such snapshot.
        """
        tree = self.tree
        if tree is None or group not in tree.children:
            raise DustError(f"{self.path} has no {group} (output: contacts: false, or no walls).")
        number = self._snapshot_numbers()[snapshot]
        dim = group.removesuffix("s")
        counts = tree.children["snapshots"].dataset[f"{dim}_count"].values
        end = int(np.sum(counts[: number + 1]))
        rows = slice(end - int(counts[number]), end)
        # not with the labels of the root: `wall` there would replace that of the group
        contacts = tree.children[group].to_dataset(inherit=False).isel({dim: rows})
        if names is not None:
            contacts = contacts[[name for name in names if name in contacts.variables]]
        return contacts.assign_coords(xyz=self.series.xyz).load()

    # In a notebook.

    def view(self) -> Any:
        """The particles in 3-D, for the last line of a cell.

        Raises
        ------
        DustError
            There are no snapshots.
        """
        return importlib.import_module(SHOWN_BY).view_particles(self)

    def _repr_html_(self) -> str:
        """HTML for a notebook: status, numbers and main figure of the run."""
        html: str = importlib.import_module(SHOWN_BY).render_run(self)
        return html

    def close(self) -> None:
        """Close the file. `series` and `profiles` stay usable."""
        root = self.whole
        if root._tree is not None:
            root._tree.close()
            root._tree = None

    def __exit__(self, *_: object) -> None:
        self.close()


def open_run(path: str | Path) -> Run:
    """The run at `path`, a result file or the directory with result.nc.

    Bundled extensions of its scene are imported, so that their numbers and figures are known.

    Raises
    ------
    DustError
        There is none, or it cannot be read.
    """
    path = user_path(path)
    file = path / "result.nc" if path.is_dir() else path
    if not file.exists() or file.suffix in (".yaml", ".yml"):
        raise explain_missing_result(path)
    try:
        groups = load_groups(file, "series", "profiles")
    except (OSError, RuntimeError, ValueError, KeyError) as error:
        raise DustError(f"{file} cannot be read as a result: {error}.") from error
    series, profiles = groups["series"], groups.get("profiles")
    if "time" not in series.dims or "step" not in series:
        some_result = next(file.parent.rglob("result.nc"), None)
        hint = (
            ""
            if some_result is None
            else f" The runs of a study are beside it, such as {some_result}."
        )
        raise DustError(f"{file} is not the result of a run: it has no time series.{hint}")
    written = profiles is not None and profiles.sizes.get("profile", 0)
    extensions.import_bundled(str(series.attrs.get(extensions.KEY, "")))
    return Run(file, series, profiles if written else None, file)
