"""Pages that several tests look at."""

import threading

import numpy as np
import pytest
import snapshots
import xarray as xr
from pages import RADIUS, SCENE, result_at

from dusttaichi import report
from dusttaichi.analysis import gather, open_ensemble, open_run, save_ensemble
from dusttaichi.report.watch import Server


@pytest.fixture(scope="session")
def data(tmp_path_factory):
    """The data of a page: four snapshots of 27 grains in a box whose top comes down."""
    corner = np.stack(np.meshgrid(*[np.arange(3)] * 3), -1).reshape(-1, 3) * 2 * RADIUS
    pairs = [(i, j) for i in range(27) for j in range(i) if 0 < np.sum((corner[i] - corner[j]) ** 2)
             < 6 * RADIUS**2]  # fmt: skip
    frames = [
        {
            "position": corner * [1, 1, 1 - 0.05 * n],
            "velocity": np.full((27, 3), 0.1 * n),
            "pairs": pairs,
            "overlap": np.full(len(pairs), 0.2e-9),
            "box": np.array([-1, 5, -1, 5, -1, 5 - 0.2 * n]) * RADIUS,
        }
        for n in range(4)
    ]
    path = tmp_path_factory.mktemp("report") / "result.nc"
    snapshots.write(path, frames, RADIUS, box=np.zeros(6), scene=SCENE)
    with open_run(path) as run:
        return report.collect_report_data([run])


@pytest.fixture(scope="session")
def written(data, tmp_path_factory):
    return report.write(data, tmp_path_factory.mktemp("page") / "report.html")


@pytest.fixture(scope="session")
def sweep(tmp_path_factory):
    """The page of a sweep of three runs, one of which has failed."""
    folder = tmp_path_factory.mktemp("sweep")
    names = ["speed=1m_s", "speed=2m_s", "speed=3m_s"]
    for number, name in enumerate(names[:2]):
        (folder / name).mkdir()
        result_at(folder / name / "result.nc", 2 + number)
    runs = [open_run(folder / name) for name in names[:2]] + [None]
    axes = {
        "boundary.wall_speed": xr.Variable("boundary.wall_speed", [1.0, 2.0, 3.0], {"units": "m/s"})
    }
    labels = {"status": ["finished", "finished", "a guard stopped it"], "directory": names}
    data = gather(runs, axes, labels, {"title": "made", "scene_resolved": [SCENE]})
    save_ensemble(data, folder / "sweep.nc")
    return report.collect_ensemble_data(*open_ensemble(folder))


@pytest.fixture(scope="module")
def server(tmp_path_factory):
    path = tmp_path_factory.mktemp("watched") / "result.nc"
    with Server(path) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        yield server
        server.shutdown()
        thread.join()
