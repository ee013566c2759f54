"""Studies from Python: the runs, files and numbers of the commands of the same names."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import xarray as xr

from dusttaichi import analysis
from dusttaichi.analysis import Run
from dusttaichi.analysis.foreign import writing
from dusttaichi.errors import DustError, naming_keywords, with_keywords
from dusttaichi.running import execute, run_directory, study_directory
from dusttaichi.running.interrupts import resumable
from dusttaichi.running.progress import open_bar, show_run
from dusttaichi.scene import Scene, as_scene
from dusttaichi.scene.paths import user_path
from dusttaichi.studies import finish, sweep_study, user_study
from dusttaichi.studies.collide import Collisions
from dusttaichi.studies.finish import run_study
from dusttaichi.studies.scene_settings import apply_common_settings
from dusttaichi.studies.user_study import UserStudy

SceneSource = Scene | str | Path | Mapping[str, Any]
CONTINUE_HINT = "resume=True"  # continues after an interruption


def run(
    scene: SceneSource,
    directory: str | Path | None = None,
    *,
    force: bool = False,
    resume: bool = False,
    figures: bool = True,
    progress: bool | None = None,
    **changes: Any,
) -> Run:
    """Run a scene to its end, as `dust run` does.

    Parameters
    ----------
    scene : Scene, str, path or dict
        A Scene, a YAML file, the name of a bundled scene, YAML as text, or a dictionary.
    directory : path, optional
        Folder of the result. Default: that of the scene, runs/NAME.
    force : bool
        Overwrite an existing result.
    resume : bool
        Continue an existing result; nothing of a finished one is computed again.
    figures : bool
        Save the figures of the run beside the result.
    progress : bool, optional
        Show the progress in one line. Default: in a notebook or on a terminal.
    **changes
        New values of keys, such as stop={"steps": 100} or **{"sample.seed": 2}.

    Returns
    -------
    Run
        The result, as of `open_run`.

    Raises
    ------
    DustError
        Bad input, an existing result, or a full disk.
    GuardStop
        The run is not valid; the result until then is on disk.
    Interrupted
        Ctrl-C; the result until then is on disk, and `resume` continues it.
    """
    with _study(scene, changes, force, resume) as scene, open_bar(progress is False) as bar:
        if scene.replicas is not None:
            raise DustError(f"replicas = {scene.replicas}: for many runs there is dt.sweep(scene)")
        if getattr(scene, "collisions", None) is not None:
            bar.log("one collision, that of `sample`; all of `collisions`: dt.collide(scene)")
        folder = user_path(run_directory(scene, directory))
        with resumable(CONTINUE_HINT):
            options: dict[str, Any] = {"report": show_run(bar), "log": bar.log}
            execute(scene, folder, force=force, resume=resume, **options)
        result = analysis.open_run(folder)
        bar.show(f"step {int(result.series.step[-1]):,}", 1, 1, f"end: {result.status}")
        if figures:
            from dusttaichi import plots  # with matplotlib, which the run does not wait for

            undrawn: list[tuple[str, str]] = []
            plots.save_figures(result, folder, failed=undrawn)
            _warn(undrawn)
    return result


def sweep(
    scene: SceneSource,
    values: Mapping[str, Any] | None = None,
    directory: str | Path | None = None,
    *,
    jobs: int | None = None,
    scheduler: str | None = None,
    force: bool = False,
    resume: bool = False,
    figures: bool = True,
    progress: bool | None = None,
    **changes: Any,
) -> xr.Dataset:
    """Run a scene over a grid of values, as `dust sweep` does, and gather the runs.

    Parameters
    ----------
    scene : Scene, str, path or dict
        As in `run`.
    values : dict, optional
        Key -> its values, such as {"sample.seed": [1, 2, 3]}; all combinations are run. Without it
        the scene must have `replicas`, as for `dust run`.
    directory : path, optional
        Folder of the results. Default: runs/NAME-sweep, of replicas alone runs/NAME.
    jobs : int, optional
        Runs at a time. Default: as many as the cores allow.
    scheduler : str, optional
        Address of a Dask scheduler, whose workers make the runs.
    force : bool
        Overwrite existing results.
    resume : bool
        Compute the missing runs only.
    figures : bool
        Save the figures of all runs together beside the dataset.
    progress : bool, optional
        As in `run`.
    **changes
        New values of keys for all runs, as in `run`.

    Returns
    -------
    xarray.Dataset
        Also written to sweep.nc, or ensemble.nc, of the folder. Runs that failed are NaN, with the
        reason in `status` and in a RuntimeWarning.

    Raises
    ------
    DustError
        Bad input, existing results, or no run succeeded.
    Interrupted
        Ctrl-C; the results until then are on disk, and `resume` continues them.
    """
    with _study(scene, changes, force, resume) as scene, open_bar(progress is False) as bar:
        scene, axes = apply_common_settings(scene, values or {})
        if not axes and scene.replicas is None:
            raise DustError(
                'nothing to vary: give values of keys, such as {"sample.seed": [1, 2, 3]}, or '
                "replicas=3"
            )
        if axes:
            study = sweep_study.sweep(scene, axes, _folder(scene, "sweep", directory))
        else:
            study = sweep_study.replicas(scene, user_path(run_directory(scene, directory)))
        options: Any = dict(jobs=jobs, scheduler=scheduler, force=force, resume=resume)
        point_results = run_study(study, bar, onward=CONTINUE_HINT, **options)
        results = finish.finish_sweep(study, point_results, figures)
    _warn(results.undrawn, results.failure)
    return results.data


def collide(
    scene: SceneSource,
    directory: str | Path | None = None,
    *,
    jobs: int | None = None,
    scheduler: str | None = None,
    batch: int | str = "auto",
    force: bool = False,
    resume: bool = False,
    figures: bool = True,
    progress: bool | None = None,
    **changes: Any,
) -> xr.Dataset:
    """Run all collisions of the block `collisions` of a scene, as `dust collide` does.

    Parameters
    ----------
    scene : Scene, str, path or dict
        As in `run`.
    directory : path, optional
        Folder of the results. Default: runs/NAME-collisions.
    jobs : int, optional
        Collisions at a time. Default: as many as the cores allow.
    scheduler : str, optional
        Address of a Dask scheduler, whose workers make the collisions.
    batch : int or str
        Collisions side by side in one simulation: "auto", a number, or "off".
    force : bool
        Overwrite existing results.
    resume : bool
        Compute the missing collisions only.
    figures : bool
        Save figures beside the dataset.
    progress : bool, optional
        As in `run`.
    **changes
        New values of keys, as in `run`.

    Returns
    -------
    xarray.Dataset
        Outcomes and threshold speeds, also written to collisions.nc of the folder. Collisions that
        failed are NaN, with a RuntimeWarning.

    Raises
    ------
    DustError
        Bad input, existing results, or no collision succeeded.
    Interrupted
        Ctrl-C; the results until then are on disk, and `resume` continues them.
    """
    with _study(scene, changes, force, resume) as scene, open_bar(progress is False) as bar:
        study = Collisions(scene, _folder(scene, "collisions", directory), batch)
        options: Any = dict(jobs=jobs, scheduler=scheduler, force=force, resume=resume)
        point_results = run_study(study, bar, onward=CONTINUE_HINT, noun="collisions", **options)
        results = finish.finish_collisions(study, point_results, figures)
        if text := finish.describe_unfinished_collisions(results.data):
            bar.log(text)
    _warn(results.undrawn, results.failure)
    return results.data


def study(
    program: str | Path | type[UserStudy],
    scene: SceneSource,
    directory: str | Path | None = None,
    *,
    jobs: int | None = None,
    scheduler: str | None = None,
    force: bool = False,
    resume: bool = False,
    progress: bool | None = None,
    **changes: Any,
) -> xr.Dataset:
    """Run a study of your own, as `dust study` does.

    Parameters
    ----------
    program : path or class
        A Python file with a class `Study`, or that class, a subclass of
        `dusttaichi.studies.user_study.UserStudy`.
    scene : Scene, str, path or dict
        As in `run`.
    directory : path, optional
        Folder of the results. Default: runs/NAME-PROGRAM, with the name of the file or class.
    jobs : int, optional
        Runs at a time. Default: as many as the cores allow.
    scheduler : str, optional
        Address of a Dask scheduler, whose workers make the runs.
    force : bool
        Overwrite existing results.
    resume : bool
        Compute the missing runs only.
    progress : bool, optional
        As in `run`.
    **changes
        New values of keys, as in `run`.

    Returns
    -------
    xarray.Dataset
        Also written to study.nc of the folder. Runs that failed are NaN, with a RuntimeWarning.

    Raises
    ------
    DustError
        Bad input, existing results, or no run succeeded.
    Interrupted
        Ctrl-C; the results until then are on disk, and `resume` continues them.
    """
    with _study(scene, changes, force, resume) as scene, open_bar(progress is False) as bar:
        if isinstance(program, type):
            mine = program(scene, _folder(scene, program.__name__.lower(), directory))
        else:
            path = user_path(program)
            mine = user_study.load_study(path, scene, _folder(scene, path.stem, directory))
        options: Any = dict(jobs=jobs, scheduler=scheduler, force=force, resume=resume)
        results = finish.finish_study(mine, run_study(mine, bar, onward=CONTINUE_HINT, **options))
    _warn(results.undrawn, results.failure)
    return results.data


@contextmanager
def _study(
    source: SceneSource, changes: dict[str, Any], force: bool, resume: bool
) -> Iterator[Scene]:
    """Context that yields the scene with its changes, and in which its files are not overwritten.

    Raises DustError.
    """
    with naming_keywords():
        if force and resume:
            raise DustError("force starts again, resume continues: give only one of them")
        scene = as_scene(source)
        if changes:
            scene = scene.with_values(changes)
        with writing(force=force, inputs=[] if scene.path is None else [scene.path]):
            yield scene


def _folder(scene: Scene, word: str, directory: str | Path | None) -> Path:
    return user_path(study_directory(scene, word, directory))


def _warn(undrawn: list[tuple[str, str]], failure: DustError | None = None) -> None:
    """Warn the caller of a public function of figures not drawn, (title, reason), and failures."""
    texts = [f"figure not drawn: {title}: {reason}" for title, reason in undrawn]
    for text in [*texts, *([] if failure is None else [str(failure)])]:
        warnings.warn(with_keywords(text), RuntimeWarning, stacklevel=3)
