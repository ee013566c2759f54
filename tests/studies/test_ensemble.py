"""Ensembles: the grid of scenes, tasks; runs by a pool of threads and by Dask."""

import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
import xarray as xr
from bits import assert_same_bits
from program import dust, wait_for
from scenes import scene

from dusttaichi.errors import DustError, GuardStop
from dusttaichi.running import execute
from dusttaichi.scene import Scene, from_yaml
from dusttaichi.studies import pool
from dusttaichi.studies import study_engine as engine
from dusttaichi.studies.finish import build_failure_error
from dusttaichi.studies.jobs import Job, Task
from dusttaichi.studies.points import Point
from dusttaichi.studies.scene_settings import apply_settings, list_input_files
from dusttaichi.studies.study_types import PointResult
from dusttaichi.studies.sweep_study import replicas, sweep

pytestmark = pytest.mark.usefixtures("one_core")

# -- scenes --------------------------------------------------------------------------------------


def cake(**blocks):
    return scene(sample="{kind: rbd, grains: 100, seed: 7}", **blocks)


def test_replicas_differ_in_their_seed_only(tmp_path):
    plan = replicas(cake().with_value("replicas", 3), tmp_path)
    assert [m.directory.name for m in plan.members] == ["replica_0", "replica_1", "replica_2"]
    assert [m.seeds for m in plan.members] == [{"seed": 7}, {"seed": 8}, {"seed": 9}]
    single = cake()
    for number, member in enumerate(plan.members):
        assert member.scene.replicas is None
        assert member.scene.output.directory == member.directory
        blocks = set(Scene.model_fields) - {"name", "sample", "output"}
        assert all(getattr(member.scene, b) == getattr(single, b) for b in blocks)
        assert member.scene.sample == single.with_value("sample.seed", 7 + number).sample
    # the scene of a run can be run again by itself
    assert from_yaml(plan.members[1].scene.to_yaml()) == plan.members[1].scene
    text = "{kind: explicit, positions: [[0 m, 0 m, 0 m]]}"
    with pytest.raises(DustError, match=r"replicas = 2.*no seed"):
        replicas(scene(sample=text).with_value("replicas", 2), tmp_path)
    with pytest.raises(DustError, match=r"replicas = 0"):
        cake().with_value("replicas", 0)
    last = cake().with_value("sample.seed", 2**32 - 1).with_value("replicas", 2)
    with pytest.raises(DustError, match=r"sample\.seed = 4294967296"):
        replicas(last, tmp_path)


def test_replicas_take_their_samples_from_those_of_another_run(tmp_path, monkeypatch):
    """Number k that of number k, also in a sweep and from another directory."""
    for number in range(2):
        (tmp_path / f"press/replica_{number}").mkdir(parents=True)
        (tmp_path / f"press/replica_{number}/result.nc").touch()
    monkeypatch.chdir(tmp_path)
    own_scene = scene(sample="{kind: explicit, file: press}").with_value("replicas", 2)
    folders = [tmp_path / f"press/replica_{number}" for number in range(2)]
    members = replicas(own_scene, tmp_path / "pull").members
    assert [m.scene.sample.file.resolve() for m in members] == folders
    members = sweep(own_scene, ["boundary.wall_speed=1cm/s,5cm/s"], tmp_path / "pull").members
    assert [m.scene.sample.file.resolve() for m in members] == 2 * folders
    assert list_input_files(members[1].scene) == ["press/replica_1/result.nc"]


def test_sweep_is_the_full_grid(tmp_path):
    settings = ["boundary.wall_speed=1cm/s,5 cm/s", "interaction.rolling=on,off"]
    plan = sweep(cake().with_value("replicas", 2), settings, tmp_path)
    assert [axis.key for axis in plan.axes] == ["boundary.wall_speed", "interaction.rolling"]
    speed, rolling = plan.axes
    np.testing.assert_array_equal(speed.coordinate, [0.01, 0.05])
    assert speed.unit == "m/s" and rolling.unit is None
    assert rolling.coordinate.tolist() == ["on", "off"]
    assert len(plan.members) == 8 and len({m.directory for m in plan.members}) == 8
    labels = [m.label for m in plan.members]
    assert labels[0] == "boundary.wall_speed=1cm_s__interaction.rolling=on/replica_0"
    for n, member in enumerate(plan.members):
        assert member.scene.boundary.wall_speed == (0.01, 0.05)[n // 4]
        assert (member.scene.interaction.rolling is None) == (n // 2 % 2 == 1)
        assert member.seeds == {"seed": 7 + n % 2}


def test_values_of_a_sweep(tmp_path):
    def axis(setting):
        return sweep(cake(), [setting], tmp_path).axes[0]

    sizes = axis("boundary.size=[40um,40um,40um],[60um,60um,60um]")
    assert sizes.values == (["40um"] * 3, ["60um"] * 3) and sizes.unit is None
    mixed = axis("boundary.size=fit,[60um,60um,60um]")
    assert mixed.coordinate.tolist() == ["fit", "[60um,60um,60um]"]
    counts = axis("sample.grains=100,1e3")
    assert counts.coordinate.tolist() == [100, 1000] and counts.unit is None
    one = axis("material.surface_energy=20 mJ/m^2,0.03 J/m^2")
    np.testing.assert_array_equal(one.coordinate, [0.02, 0.03])
    assert one.unit == "J/m^2"
    common = axis("material.surface_energy=10,20,40 mJ/m^2")  # the unit of the last is that of all
    assert common.texts == ("10 mJ/m^2", "20 mJ/m^2", "40 mJ/m^2")
    np.testing.assert_array_equal(common.coordinate, [0.01, 0.02, 0.04])
    steps = axis("numerics.time_step=auto,0.1,2e-1ns")  # words have none
    assert steps.texts == ("auto", "0.1 ns", "2e-1ns")
    assert apply_settings(cake(), ["name=1.10"]).name == "1.10"  # a shell drops its quotes
    assert axis("interaction.rolling.modifier=1,8").coordinate.tolist() == [1.0, 8.0]
    assert axis("material=silicate_s12,ice_t19").coordinate.tolist() == ["silicate_s12", "ice_t19"]
    assert axis("stop.pressure=1kPa,10kPa").unit == "Pa"  # an optional key


def test_settings_that_need_each_other(tmp_path):
    """Softened contacts are refused in a collision, unless the scene says that they are wanted."""
    both = ["numerics.stiffness_scaling=0.1", "numerics.scaling_anyway=true"]
    bodies = "{kind: collision, target: {kind: pair}, projectile: {kind: pair}, speed: 5 m/s}"
    collision = scene(sample=bodies, boundary="{kind: open}", stop="{time: 1 us}")
    for settings in (both, both[::-1]):
        numerics = apply_settings(collision, settings).numerics
        assert numerics.stiffness_scaling == 0.1 and numerics.scaling_anyway
    swept = sweep(collision, [both[0] + ",0.3", both[1]], tmp_path)
    assert [m.scene.numerics.stiffness_scaling for m in swept.members] == [0.1, 0.3]
    with pytest.raises(DustError, match="scaling_anyway: true beside it"):
        apply_settings(collision, both[:1])


def test_long_or_equal_names_of_points_become_numbers(tmp_path):
    sizes = ",".join(f"[{n}.123456789um,40.123456789um,40um]" for n in (40, 50))
    settings = [
        f"boundary.size={sizes}",
        "boundary.wall_speed=1 cm/s,2 cm/s",
        "material.surface_energy=20.123456789 mJ/m^2,30.123456789 mJ/m^2",
        "material.density=2.651234567 g/cm^3",
    ]
    plan = sweep(cake(), settings, tmp_path)
    assert [m.label for m in plan.members] == [f"point_{n}" for n in range(8)]
    of_a_long_name = sweep(cake().with_value("name", "x" * 100), settings[1:2], tmp_path)
    assert len({m.scene.name for m in of_a_long_name.members}) == 2


@pytest.mark.parametrize(
    ("settings", "fault"),
    [
        (
            ["boundary.wall_speed=1 cm"],
            r'boundary\.wall_speed = "1 cm": a speed of at least 0 is needed',
        ),
        (["boundary.wall_speed=1 cm/s,2,3 m/s"], r"wall_speed = 2: it has no unit"),
        (["boundary.wall_speed=1 cm/s,2"], r"wall_speed = 2: it has no unit"),
        (["boundary.wall_sped=1 cm/s"], r'did you mean "wall_speed"'),
        (["boundary.wall_speed=1 cm/s,-1 m/s,x"], r'"-1 m/s"[\s\S]*= "x"'),  # all at once
        (["boundary.wall_speed=x", "sample.grains=a"], r'= "a"[\s\S]*= "x"'),  # as in the scene
        (["sample.grains=1.5"], r"sample\.grains = 1\.5: a whole number"),
        (["boundary.size=[1 um, 2 um"], "not valid YAML"),
        (["boundary.wall_speed"], "a key and its values"),
        (["boundary.wall_speed="], "a key and its values"),
        (["boundary.wall_speed=1cm/s,,2cm/s"], "a key and its values"),
        ([], "a sweep needs --set"),
        (["sample.seed=1", "sample.seed=2"], "given twice; separate"),
        (["boundary.wall_speed=1 cm/s,0.01 m/s"], "a value is given twice"),
        (["output.directory=a,b"], "use --output instead"),
    ],
)
def test_what_cannot_be_swept_is_said_before_anything_runs(settings, fault, tmp_path):
    with pytest.raises(DustError, match=fault):
        sweep(cake(), settings, tmp_path / "sweep")
    assert not (tmp_path / "sweep").exists()


def test_files_of_samples_keep_one_path(tmp_path, monkeypatch):
    (tmp_path / "a").mkdir()
    (tmp_path / "grains.csv").write_text("x,y,z\n0,0,0\n")
    text = "{kind: explicit, file: ../grains.csv}"
    data = scene(sample=text, boundary="{kind: open}", stop="{steps: 10}")
    monkeypatch.chdir(tmp_path / "a")
    given = from_yaml(data.to_yaml(), tmp_path / "a")
    (member,) = sweep(given, ["stop.steps=5"], tmp_path / "s").members
    assert list_input_files(member.scene) == [os.path.join("..", "grains.csv")]


def test_workers_never_exceed_the_cores(tmp_path):
    def choose_processes(scene, count, cores, remote=False):
        return Point.from_changes(scene, tmp_path, "one").choose_processes(
            count, cores, remote=remote
        )

    auto, two = cake(), cake().with_value("numerics.threads", 2)
    assert choose_processes(auto, 6, 4) == (4, 1)  # a thread each
    assert choose_processes(auto, 3, 8) == (3, 2)
    assert choose_processes(auto, 1, 8) == (1, "auto")
    assert choose_processes(auto, 6, 4, remote=True)[1] == 1
    assert choose_processes(two, 6, 8) == (4, 2)
    assert choose_processes(two, 6, 1) == (1, 2)
    assert choose_processes(cake().with_value("numerics.backend", "cuda"), 6, 8) == (1, "auto")


# -- tasks ---------------------------------------------------------------------------------------


class Stopped:
    def is_stopped(self):
        return True


def test_a_task_that_comes_after_the_stop_does_not_begin(tmp_path):
    task = Task("3", "dusttaichi.studies.jobs:run", {"directory": str(tmp_path / "run")})
    assert Job((task,)).run(Stopped(), {}, []) == {} and not (tmp_path / "run").exists()
    plan = replicas(cake().with_value("replicas", 2), tmp_path)
    plan.members[1].directory.mkdir()
    (plan.members[1].directory / "result.nc").write_text("precious")
    with pytest.raises(DustError, match=r"replica_1/result\.nc exists already.*--force"):
        engine.run(plan)
    assert (plan.members[1].directory / "result.nc").read_text() == "precious"


def test_failures_are_told_by_reason(tmp_path):
    plan = replicas(cake().with_value("replicas", 3), tmp_path)
    first, second, third = plan.members
    same = [PointResult(first, 2, "too long a step"), PointResult(third, 2, "too long a step")]
    error = build_failure_error(same, 3)
    assert "2 of 3 runs failed" in str(error) and "replica_0, replica_2: too long" in str(error)
    assert error.exit_code == 2
    assert isinstance(build_failure_error([*same, PointResult(second, 3, "runaway")], 3), GuardStop)


TINY = """
name: tiny
material: silicate_s12
interaction: {rolling: {modifier: 8}, sliding: {modifier: 2.5}, damping: viscous}
sample: {kind: rbd, grains: 60, seed: 3}
boundary: {kind: box, wall_speed: 1 m/s}
stop: {steps: 300}
numerics: {time_step: 0.3 ns, threads: 1}
output: {series: {steps: 50}, profiles: off, snapshots: off, checkpoint: 1000 s}
"""


@pytest.fixture(scope="module")
def finished_runs(tmp_path_factory):
    """Two replicas done by `dust run`."""
    folder = tmp_path_factory.mktemp("replicas")
    (folder / "tiny.yaml").write_text(TINY + "replicas: 2\n")
    dust("run", folder / "tiny.yaml", "-q", "-o", folder / "runs")
    return folder


def test_replicas_are_the_single_runs_with_these_seeds(finished_runs, tmp_path):
    single = from_yaml(TINY).with_value("sample.seed", 4)
    execute(single, tmp_path)
    assert_same_bits(tmp_path / "result.nc", finished_runs / "runs/replica_1/result.nc")
    names = {path.name for path in (finished_runs / "runs/replica_1").iterdir()}
    assert {"result.nc", "scene.yaml", "checkpoint.bin"} <= names
    assert "ledger.png" not in names  # six runs of a second would take a minute


def test_ensemble_holds_all_and_their_mean(finished_runs):
    with xr.open_dataset(finished_runs / "runs/ensemble.nc") as data:
        assert data.seed.values.tolist() == [3, 4]
        assert set(data.status.values) == {"finished: 300 steps"}
        assert data.attrs["coordinate"] == "filling_factor"
        assert "replicas: 2" in data.attrs["scene_resolved"]
        for number in range(2):
            with xr.open_dataset(finished_runs / f"runs/replica_{number}/result.nc") as single:
                assert float(data.final_height[number]) == float(single.height[-1])
                # the height is as smooth as it can be: interpolation errs in the second order,
                # by (spacing / filling factor)^2 of it
                heights = data.height[number].dropna("filling_factor")
                expected = np.interp(heights.filling_factor, single.filling_factor, single.height)
                np.testing.assert_allclose(heights, expected, rtol=1e-12)
        np.testing.assert_allclose(data.mean_final_height, data.final_height.mean(), rtol=1e-12)
        np.testing.assert_allclose(data.std_final_height, data.final_height.std(ddof=1), rtol=1e-12)
    assert (finished_runs / "runs/ensemble.png").stat().st_size > 10_000


def test_resume_keeps_what_is_finished(finished_runs):
    files = [finished_runs / f"runs/replica_{n}/result.nc" for n in range(2)]
    st_mtime_ns_before = files[0].stat().st_mtime_ns
    renamed = files[1].rename(finished_runs / "whole.nc")
    (finished_runs / "runs/replica_1/checkpoint.bin").unlink()
    (finished_runs / "runs/ensemble.nc").unlink()
    words = ["-q", "-o", finished_runs / "runs", "--resume", "--no-figures"]
    dust("run", finished_runs / "tiny.yaml", *words)
    assert (finished_runs / "runs/ensemble.nc").exists()
    assert files[0].stat().st_mtime_ns == st_mtime_ns_before
    assert_same_bits(renamed, files[1])


def test_a_run_that_fails_does_not_end_the_others(tmp_path, capsys):
    """A lid at 20 m/s drives the grains into each other until a guard stops the run."""
    text = TINY.replace("{steps: 300}", "{filling_factor: 0.74, time: 0.3 us}")
    (tmp_path / "tiny.yaml").write_text(text)
    setting = ["--set", "boundary.wall_speed=1m/s,20m/s", "--no-figures"]
    with pytest.raises(GuardStop, match=r"1 of 2 runs failed:\n.*wall_speed=20m_s: At .* µs"):
        dust("sweep", tmp_path / "tiny.yaml", *setting, "-q", "-o", tmp_path / "s")
    assert "wall speed" in capsys.readouterr().out
    with xr.open_dataset(tmp_path / "s/sweep.nc") as data:
        np.testing.assert_array_equal(data.boundary_wall_speed, [1.0, 20.0])
        assert data.boundary_wall_speed.attrs["units"] == "m/s"
        assert data.height.dims[:2] == ("boundary_wall_speed", "replica")
        assert data.height[0].notnull().all() and data.height[1].isnull().all()
        assert data.status.values[0, 0].startswith("finished")
        assert data.status.values[1, 0].startswith("At ")
    with pytest.raises(
        DustError, match=r"no time series\. The runs of a study are beside it, such"
    ):
        dust("compare", tmp_path / "s/sweep.nc")
    assert (tmp_path / "s/boundary.wall_speed=20m_s/result.nc").exists()


def test_an_interruption_reaches_the_runs(tmp_path):
    # a slow wall, so that nothing else ends the run before
    text = TINY.replace("300", "60000000").replace("wall_speed: 1 m/s", "wall_speed: 1 mm/s")
    (tmp_path / "long.yaml").write_text(text + "replicas: 1\n")
    code = "from dusttaichi.commands.app import main; main()"
    process = subprocess.Popen(
        [sys.executable, "-c", code, "run", "long.yaml", "-q", "--threads", "1"],
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    first = tmp_path / "runs/tiny/replica_0/result.nc"
    wait_for(first, process)
    time.sleep(0.5)
    process.send_signal(signal.SIGTERM)
    _, output = process.communicate(timeout=300)
    assert process.returncode == 130, output
    assert "dust run long.yaml -q --threads 1 --resume" in output and "Traceback" not in output
    with xr.open_dataset(first) as series:
        assert series.attrs["status"] == "interrupted"
        assert int(series.step[-1]) < 60_000_000
    assert (first.parent / "checkpoint.bin").exists()
    assert not (tmp_path / "runs/tiny/ensemble.nc").exists()


def test_dask_cluster_without_a_shared_disk(tmp_path, monkeypatch, cluster):
    """Files of the sample go there, results come back; the same bits as here."""
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    execute(from_yaml(TINY.replace("snapshots: off, ", "")), tmp_path / "frames")
    last_frame = os.path.relpath(tmp_path / "frames")
    from_file = from_yaml(
        TINY.replace("{kind: rbd, grains: 60, seed: 3}", f"{{kind: explicit, file: {last_frame}}}")
    )
    execute(from_file.with_value("stop.steps", 50), tmp_path / "alone")
    heard = []
    address = cluster.scheduler_address
    assert address.startswith("tcp://")
    plan = sweep(from_file, ["stop.steps=50"], tmp_path / "sweep")
    outcomes = engine.run(plan, scheduler=address, report=lambda p: heard.append(p.finished))
    assert [o.code for o in outcomes.values()] == [0] and heard[-1] == 1
    run = plan.members[0].directory
    assert_same_bits(tmp_path / "alone/result.nc", run / "result.nc")
    assert plan.dataset(outcomes).sizes["replica"] == 1
    assert (run / "checkpoint.bin").exists()
    with xr.open_dataset(run / "result.nc") as series:
        assert int(series.step[-1]) == 50 and series.attrs["grains"] == 60


def test_a_scheduler_that_is_not_there(tmp_path, monkeypatch):
    monkeypatch.setattr(pool, "CONNECT_TIMEOUT", "0.5 s")
    plan = replicas(from_yaml(TINY + "replicas: 2\n"), tmp_path / "runs")
    with pytest.raises(DustError, match="no scheduler answers"):
        engine.run(plan, scheduler="tcp://127.0.0.1:1")
    with pytest.raises(DustError, match="no scheduler answers.*unknown address scheme"):
        engine.run(plan, scheduler="nowhere://1")
    monkeypatch.setattr(pool.importlib.util, "find_spec", lambda name: None)
    plan = replicas(from_yaml(TINY + "replicas: 2\n"), tmp_path / "runs")
    with pytest.raises(DustError, match=r"dusttaichi\[cluster\]"):
        engine.run(plan, scheduler="tcp://127.0.0.1:1")
    (tmp_path / "tiny.yaml").write_text(TINY)
    with pytest.raises(DustError, match="replicas, or dust sweep"):
        dust("run", tmp_path / "tiny.yaml", "--scheduler", "tcp://127.0.0.1:1")
