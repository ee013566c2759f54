"""Studies of collisions: what is made, what is known of it afterwards, how a study goes on."""

import csv
import json
import os
import signal
from concurrent.futures import Future
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from program import dust
from scenes import make_scene
from snapshots import collision_row

from dusttaichi import analysis, samples
from dusttaichi.analysis.collisions import AXES
from dusttaichi.analysis.thresholds import find_thresholds
from dusttaichi.errors import DustError
from dusttaichi.grains.collision_parameters import Rings
from dusttaichi.running import execute
from dusttaichi.scene import Scene, from_yaml, load
from dusttaichi.studies import collide_task as task
from dusttaichi.studies import pool
from dusttaichi.studies import study_engine as engine
from dusttaichi.studies.collide import Collisions
from dusttaichi.studies.collide_batch import make_collisions
from dusttaichi.studies.collide_course import Collision
from dusttaichi.studies.result_store import ResultStore
from dusttaichi.studies.study_types import PointResult
from dusttaichi.studies.workers import Answer

BODY = {"kind": "pca", "grains": 12}
COLLISION = {
    "kind": "collision",
    "target": {**BODY, "seed": 1},
    "projectile": {**BODY, "seed": 2},
    "speed": "0.5 m/s",
    "impact_parameter": 0.2,
    "gap": "5 nm",
}


def study_scene(**keys):
    """A scene with the same parts as those of test_batch, and a study of two speeds."""
    block = {"speed": ["0.5 m/s", "8 m/s"], "impact_parameter": [0, 0.9], "seeds": 1} | keys
    scene = make_scene(damping="viscous", dt="0.2 ns", threads=1, sample=COLLISION)
    data = scene.input_data | {"stop": {"time": "20 us"}, "collisions": block, "name": "study"}
    return Scene.from_dict(data)


# -- what is asked for ---------------------------------------------------------------------------


def test_rings_stand_for_equal_areas():
    """Each ring of outer radius b_k holds as much area inside of its value as outside of it."""
    values = np.array(Rings(rings=4, largest=0.8).values())
    edges = 0.8 * np.sqrt(np.arange(5) / 4)
    np.testing.assert_allclose(values**2 - edges[:-1] ** 2, edges[1:] ** 2 - values**2)


def keys_of(scene, folder):
    return [point.label for point in Collisions(scene, folder).points({})]


def samples_of(study):
    return [point.arguments["sample"] for point in study.points({})]


def test_the_collisions_of_a_study(tmp_path):
    bodies = {"loose": {"kind": "bcca", "grains": 30, "seed": 5}, "dense": {**BODY, "seed": 7}}
    scene = study_scene(bodies=bodies, mass_ratio=[1, 3], seeds=2)
    collisions = Collisions(scene, tmp_path).points({})
    assert len(collisions) == scene.collisions.count == 2 * 2 * 2 * 2 * 2
    last = collisions[-1].arguments["sample"]
    assert last["speed"] == "8 m/s" and last["impact_parameter"] == 0.9
    assert (last["target"]["grains"], last["projectile"]["grains"]) == (12, 4)
    assert last["target"]["seed"] == 8 and last["projectile"]["seed"] > 1000
    # what differs in anything is another collision, and the rest is the same in another process
    keys = [collision.label for collision in collisions]
    assert len(set(keys)) == 32
    assert keys_of(from_yaml(scene.to_yaml()), tmp_path / "b") == keys
    for change in (("material.surface_energy", "50 mJ/m^2"), ("collisions.phases", True)):
        assert not {*keys_of(scene.with_value(*change), tmp_path)} & {*keys}


def test_filling_factors_are_those_of_both_bodies(tmp_path):
    body = {"kind": "cutout", "of": {"kind": "space_filling", "grains": 300}, "diameter": "4 um"}
    keys = {"filling_factor": [0.1, 0.2], "impact_parameter": [0], "seeds": 2}
    with pytest.raises(DustError, match="sample.target.*a body of kind pca has no filling_factor"):
        study_scene(**keys)
    data = study_scene(impact_parameter=[0], seeds=2).input_data
    data["collisions"] = data["collisions"] | keys
    scene = Scene.from_dict(data | {"sample": {**COLLISION, "target": body, "projectile": body}})
    study = Collisions(scene, tmp_path)
    assert study.axes["body"] == ("phi_0.1", "phi_0.2")
    bodies_of_samples = samples_of(study)
    assert len(bodies_of_samples) == scene.collisions.count == 2 * 2 * 2
    for number, sample in enumerate(bodies_of_samples):
        for name in ("target", "projectile"):
            assert sample[name]["of"]["filling_factor"] == (0.1, 0.2)[number // 4]
    with pytest.raises(DustError, match="filling_factor.*a number of at most 0.4|at most 0.4"):
        Collisions(scene.with_value("collisions.filling_factor", [0.1, 0.5]), tmp_path)
    with pytest.raises(DustError, match="use one of the two"):
        scene.with_value("collisions.bodies", {"a": BODY})


def test_bodies_with_seeds_at_any_depth_are_two(tmp_path):
    """A body whose seed is that of the sample it is cut from does not meet itself."""
    of = {"kind": "space_filling", "grains": 300, "seed": 3}
    body = {"kind": "cutout", "of": of, "diameter": "4 um"}
    study = Collisions(study_scene(bodies={"cut": body}, seeds=2), tmp_path)
    seeds = {c[n]["of"]["seed"] for c in samples_of(study) for n in ("target", "projectile")}
    assert seeds == {3, 4, 1_000_003, 1_000_004}
    # each pair has two spheres of the run, by their seeds
    sample_block = {"kind": "explicit", "file": str(tmp_path / "run")}
    body = {"kind": "cutout", "of": sample_block, "grains": 12}
    study = Collisions(study_scene(bodies={"a": {**body, "seed": 4}}, mass_ratio=[3]), tmp_path)
    sample = samples_of(study)[0]
    assert sample["target"]["seed"] == 4 and sample["projectile"]["seed"] > 1000
    assert (sample["target"]["grains"], sample["projectile"]["grains"]) == (12, 4)
    assert samples_of(Collisions(study_scene(bodies={"a": sample_block}), tmp_path))


@pytest.mark.parametrize(
    "keys, words",
    [
        ({"speed": ["3"]}, 'collisions.speed[0] = "3": it has no unit'),
        ({"speed": []}, "collisions.speed = []: at least one value is needed"),
        ({"speed": ["1 m/s", "1000 mm/s"]}, "a value is given twice"),
        ({"speed": {"lowest": "2 m/s", "highest": "1 m/s", "count": 3}}, "highest must be above"),
        ({"impact_parameter": [1.5]}, "a number of at least 0 and at most 1 is needed"),
        ({"mass_ratio": [0.5]}, "a number of at least 1 is needed"),
        ({"mass_ratio": [7]}, "sample.projectile: 12 grains over 7"),
        ({"bodies": {"a": {"kind": "cube"}}}, "collisions.bodies.a.kind"),
        ({"seeds": 10**6}, "at most 100,000 are allowed"),
        ({"refine": 31}, "collisions.refine"),
        ({"speeds": ["1 m/s"]}, 'unknown key; did you mean "speed"?'),
    ],
)
def test_what_cannot_be_a_study(keys, words):
    with pytest.raises(DustError) as error:
        study_scene(**keys)
    assert words in str(error.value)


def test_a_scene_that_is_no_study(tmp_path):
    with pytest.raises(DustError, match="has no block `collisions`"):
        Collisions(make_scene(sample=COLLISION), tmp_path)
    data = study_scene().input_data
    with pytest.raises(DustError, match="it needs two bodies: kind: collision"):
        Scene.from_dict(data | {"sample": {"kind": "pca", "grains": 10}})
    with pytest.raises(DustError, match="it needs stop: {time: ...}"):
        Scene.from_dict(data | {"stop": {"steps": 10}})


# -- one collision -------------------------------------------------------------------------------


def make_collision(scene, phases=False):
    """The row of the collision of a scene."""
    rows, collision = [], Collision("", scene, samples.make(scene), phases=phases)
    make_collisions([collision], lambda label, row: rows.append(row))
    return rows[0]


def test_a_collision_is_the_run_of_its_scene(tmp_path):
    """Followed over the same time, both say the same, by the same definitions."""
    scene = study_scene().with_value("stop.time", "100 ns")
    row = make_collision(scene)
    touch = 5e-9 / 0.5
    scene = scene.with_value("stop.time", f"{touch + row['time']:.17g} s")
    execute(scene, tmp_path / "run")
    with analysis.open_run(tmp_path / "run") as run:
        numbers, last = analysis.summarise(run), run.series.isel(time=-1)
        assert row["outcome"] == numbers["outcome"]
        assert row["growth_efficiency"] == pytest.approx(numbers["growth_efficiency"])
        assert len(row["fragments"]) == numbers["fragments"]
        # the touch is a whole number of steps here or one less: losses are of the same step or its
        # neighbour, and change by little in a step of 0.2 ns
        for name, lost in row["loss"].items():
            loss = float(last.loss.sel(channel=name))
            assert lost == pytest.approx(loss, rel=1e-2, abs=1e-3 * row["impact_energy"])
    total = sum(row["loss"].values()) + row["kinetic"] + row["potential"]
    # in a ledger that closes the impact energy is all there is to lose, within its residual
    assert total / row["impact_energy"] == pytest.approx(1.0, abs=2e-3 + abs(row["residual"]))


def test_compression_and_stretching_of_two_grains():
    """Two grains at five times their sticking speed: contacts form in compression and break in
    stretching, after which nothing is dissipated."""
    grain = {"kind": "explicit", "positions": [["0 m", "0 m", "0 m"]]}
    pair = {**COLLISION, "target": grain, "projectile": grain, "impact_parameter": 0}
    # a contact of 10 ns is followed in steps of 1.25 ns
    scene = study_scene().with_value("numerics.time_step", "0.05 ns")
    row = make_collision(scene.with_value("sample", pair), phases=True)
    assert row["outcome"] == "bouncing"
    first, second, loss = row["compression_loss"], row["stretching_loss"], row["loss"]
    assert first + second == pytest.approx(sum(loss.values()), rel=1e-9)
    assert row["collision_loss"] == pytest.approx(first + second, rel=1e-9)
    assert first > loss["forming"] > 0.0 and second > loss["breaking"] > 0.0
    # the damping of both directions is the same, as far as the contact is symmetric: a third
    damped = [first - loss["forming"], second - loss["breaking"]]
    assert damped[0] == pytest.approx(damped[1], rel=1 / 3)


def test_compression_ends_where_the_bodies_turn(tmp_path):
    """The loss until then is that of the run at the record of the turn."""
    scene = study_scene().with_value("sample.speed", "8 m/s")
    row = make_collision(scene, phases=True)
    # only on request, and the same collision without
    phase_losses = {"compression_loss": None, "stretching_loss": None}
    assert make_collision(scene) == row | phase_losses
    scene = scene.with_value("stop.time", "1 us").with_value("output.series", {"steps": 25})
    execute(scene, tmp_path / "run")
    with analysis.open_run(tmp_path / "run") as run:
        apart = run.series.body_position.isel(body=0) - run.series.body_position.isel(body=1)
        speed = run.series.body_velocity.isel(body=0) - run.series.body_velocity.isel(body=1)
        turned = int(np.argmax((apart * speed).sum("xyz").values > 0.0))
        lost = run.series.loss.sum("channel").values
    # between two times there, and between two records here, all 25 steps apart
    assert turned > 1 and lost[turned - 2] <= row["compression_loss"] <= lost[turned + 1]
    assert row["compression_loss"] < sum(row["loss"].values())


def test_bodies_that_miss_and_what_cannot_be_made():
    base = study_scene().to_yaml()
    none = {"kind": "explicit", "positions": []}
    calls = [
        {"label": name, "scene": base, "sample": COLLISION | sample_keys, "phases": False}
        for name, sample_keys in (("miss", {"impact_parameter": 1.0}), ("none", {"target": none}))
    ]
    parent, answers = SimpleNamespace(report=lambda answered: answers.append(answered)), []
    task.run(parent, calls=calls, abreast=2, room=100)
    none, miss = sorted(answers, key=lambda answer: -answer["code"])
    assert miss["values"]["outcome"] == "miss" and "loss" not in miss["values"]
    assert none["label"] == "none" and none["code"] == 2 and "sample" in none["text"]


# -- the study -----------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def finished_study(tmp_path_factory, two_cores):
    folder = tmp_path_factory.mktemp("collide")
    text = study_scene(phases=True).to_yaml()
    (folder / "study.yaml").write_text(text, encoding="utf-8")
    words = ["collide", folder / "study.yaml", "-o", folder / "out", "-q"]
    dust(*words)
    return folder, words


def test_files_of_a_study(finished_study):
    folder, _ = finished_study
    with xr.open_dataset(folder / "out/collisions.nc") as data:
        assert data.outcome.dims == AXES and data.outcome.shape == (1, 1, 2, 2, 1)
        # head-on at 70 times the sticking speed of two grains nothing is left of 12 and 12
        assert str(data.outcome.values[0, 0, 1, 0, 0]) == "fragmentation"
        assert data.growth_efficiency.values[0, 0, 1, 0, 0] < -0.5
        # numbers are there where the bodies touched, and nowhere else
        hit = data.outcome.values != "miss"
        assert np.array_equal(np.isfinite(data.growth_efficiency.values), hit)
        assert np.array_equal(np.isfinite(data.loss.sum("channel", skipna=False).values), hit)
        assert data.fragment_mass.sum() == pytest.approx(hit.sum())
    with (folder / "out/collisions.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 4 and float(rows[2]["share_fragmentation"]) == 1.0
    assert float(rows[2]["growth_efficiency"]) < -0.5 and rows[2]["growth_efficiency_error"] == ""
    names = {path.name for path in (folder / "out").glob("*.png")}
    assert names == {"outcomes.png", "growth.png", "spectrum.png", "phases.png"}


def test_the_tools_know_the_folder_of_a_study(finished_study, capsys):
    folder, _ = finished_study
    out = folder / "out"
    drawn = {path.name for path in out.glob("*.png")}
    dust("plot", out, "-o", folder / "drawn")
    assert {path.name for path in (folder / "drawn").glob("*.png")} == drawn
    for words in (("compare", out), ("render", out)):
        with pytest.raises(DustError, match="is the folder of a study of collisions, not of a run"):
            dust(*words)
    with pytest.raises(DustError, match="`dust plot .*` draws it, .* in Python .*open_collisions"):
        analysis.open_run(out)
    data, file = analysis.open_collisions(out)
    assert file == out / "collisions.nc" and data.outcome.dims == AXES
    dust("run", folder / "study.yaml", "-o", folder / "one", "--no-figures")
    hint = "one collision, that of `sample`; all of `collisions`: dust collide"
    assert hint in capsys.readouterr().err


def test_a_limit_of_the_model_is_said(tmp_path, monkeypatch, capsys):
    """Before anything is computed: here nothing is."""

    def stop(study, **options):
        raise DustError("stopped")

    monkeypatch.setattr(engine, "run", stop)
    path = tmp_path / "study.yaml"
    path.write_text(study_scene(speed=["1 m/s", "200 m/s"]).to_yaml(), encoding="utf-8")
    with pytest.raises(DustError, match="stopped"):
        dust("collide", path, "-o", tmp_path / "out")
    output = capsys.readouterr().err
    assert "collisions.speed: speeds from 200 m/s on (1 of 2) exceed" in output
    assert "Impact speed of two grains: up to 200 m/s" in output


def test_parts_of_a_study_make_the_whole(finished_study, capsys):
    """Each part writes a file of its own, so that they may run at the same time."""
    folder, _ = finished_study
    words = ["collide", folder / "study.yaml", "-o", folder / "parts", "-q", "--no-figures"]
    for number in (1, 2):
        dust(*words, "--part", f"{number}/2")
    assert "2 of 4 collisions; when all are done: dust" in capsys.readouterr().out
    assert not (folder / "parts/collisions.nc").exists()
    with pytest.raises(DustError, match="collisions.1-of-2.jsonl exists already"):
        dust(*words, "--part", "1/2")
    with pytest.raises(DustError, match="exists already"):
        dust(*words)
    dust(*words, "--resume")
    rows = [(folder / name / "collisions.jsonl").read_text() for name in ("out", "parts")]
    assert sorted(rows[0].splitlines()) == sorted(rows[1].splitlines())
    assert "4 of 4 are already finished" in capsys.readouterr().err
    dust(*words, "--resume", "--part", "2/3")  # other parts later: nothing is computed again
    assert (folder / "parts/collisions.2-of-3.jsonl").read_text() == ""


def test_an_interrupted_study_continues_its_checkpoints(finished_study, tmp_path):
    """A signal when a pair is over: it is stored, and those under way continue."""
    folder, _ = finished_study
    study, answers = Collisions(load(folder / "study.yaml"), tmp_path), []
    points = {point.label: point for point in study.requests()}

    def make(store):
        """Make the missing ones as a worker does."""
        tasks = [p.to_task(1, store) for p in points.values() if p.find_answer(store) is None]
        calls = [{"label": call.label, **call.arguments} for call in tasks]
        task.run(SimpleNamespace(report=take), calls=calls, **study.side_by_side)

    def take(answered):
        answers.append(Answer(**{name: v for name, v in answered.items() if name != "label"}))
        points[answered["label"]].save_answer(answers[-1], store)
        if len(answers) == 1:
            os.kill(os.getpid(), signal.SIGINT)

    store = ResultStore(force=False, resume=False, timed=False)
    with pytest.raises(KeyboardInterrupt):
        make(store)
    assert [answer.code for answer in answers] == [0, 0, 130, 130]  # both misses are over at once
    assert (tmp_path / "collisions.unfinished").exists()
    store = ResultStore(force=False, resume=True, timed=False)
    assert len(store.open_rows(study.file.with_suffix(".jsonl")).unfinished) == 2
    make(store)
    assert {file.name for file in tmp_path.iterdir()} == {"collisions.jsonl"}
    rows = [collision_rows(path) for path in (folder / "out", tmp_path)]
    assert rows[0].keys() == rows[1].keys()
    for key, row in rows[0].items():
        for name in ("outcome", "time", "masses", "restitution", "kinetic"):
            assert row.get(name) == rows[1][key].get(name)


def collision_rows(folder):
    """Row of each collision of a study by its key."""
    lines = (folder / "collisions.jsonl").read_text().splitlines()
    return {row["key"]: row for row in map(json.loads, lines)}


@pytest.mark.long  # runs of an ensemble go there in every suite
def test_a_study_on_a_dask_cluster(finished_study, cluster):
    """Without a shared disk, bit for bit what this machine has made."""
    folder, _ = finished_study
    words = ["collide", folder / "study.yaml", "-o", folder / "dask", "-q", "--no-figures"]
    dust(*words, "--scheduler", cluster.scheduler_address)
    rows = [(folder / name / "collisions.jsonl").read_text() for name in ("out", "dask")]
    assert sorted(rows[0].splitlines()) == sorted(rows[1].splitlines())
    assert (folder / "dask/collisions.csv").exists()


@pytest.mark.parametrize(
    "options, workers, batch",
    [((), 8, 5), (("--threads", 4), 2, 20), (("--jobs", 3), 3, 14), (("--jobs", 9), 8, 5)],
)
def test_collisions_at_a_time(options, workers, batch, tmp_path, monkeypatch):
    """Eighty on eight cores: at least two jobs for each process."""
    sizes = []

    class Counted(pool.ThreadPool):
        def __init__(self, scheduler, count, heard, idle):
            assert count == workers
            super().__init__(count, heard, idle)

        def submit(self, point, inputs):
            sizes.append(len(point.labels))
            future = Future()
            future.set_exception(DustError("not made"))
            return future

    monkeypatch.setattr(engine, "open_pool", Counted)
    monkeypatch.setattr(engine, "usable_cores", lambda: 8)
    path = tmp_path / "study.yaml"
    path.write_text(study_scene(seeds=20).to_yaml(), encoding="utf-8")
    with pytest.raises(DustError, match="80 of 80 collisions failed.*--resume.*not made"):
        dust("collide", path, "-o", tmp_path / "out", "-q", "--no-figures", *options)
    assert sizes[0] == max(sizes) == batch


def test_speeds_are_added_where_growth_ends(tmp_path):
    """Bisection: each further speed halves the interval about the threshold; none below 2 %."""

    def refine_speeds(number):
        study, answers, rounds = Collisions(scene_of(number), tmp_path), {}, 0
        while points := [point for point in study.points(answers) if point.label not in answers]:
            rounds += 1
            for point in points:
                speed = float(point.arguments["sample"]["speed"].removesuffix(" m/s"))
                row = collision_row(growth_efficiency=np.log(21.0 / speed))
                answers[point.label] = PointResult(point, measured=row)
        return study, answers, rounds

    def scene_of(number):
        return study_scene(speed=["5 m/s", "80 m/s"], refine=number)

    assert scene_of(4).collisions.count == 6 * 2
    study, results, rounds = refine_speeds(4)
    assert study.axes["speed"] == (5.0, 20.0, 23.8, 28.3, 40.0, 80.0)
    assert rounds == 5 and len(results) == 12
    assert find_thresholds(study.dataset(results))[1].speed == pytest.approx(21.0, rel=1e-9)
    speeds = np.array(refine_speeds(30)[0].axes["speed"])
    assert speeds[speeds > 21].min() / speeds[speeds < 21].max() < 1.03 and len(speeds) < 12


def test_the_bundled_study_is_the_map_of_two_hundred():
    scene = load("collide")
    assert scene.collisions.count == 200 and scene.sample.target.grains == 500
