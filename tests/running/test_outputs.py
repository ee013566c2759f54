"""No file of the user's is overwritten unasked, and no input at all."""

import numpy as np
import pytest
import synthetic
import toy
from matplotlib.figure import Figure
from typer.testing import CliRunner

from dusttaichi import plots, report
from dusttaichi.analysis import compare, open_run
from dusttaichi.analysis.summary import to_csv
from dusttaichi.commands.app import app
from dusttaichi.errors import DustError
from dusttaichi.results.outputs import is_ours, writing

OWN = "# mine, run by dusttaichi\n"


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    directory = tmp_path_factory.mktemp("made") / "run"
    directory.mkdir()
    (directory / "scene.yaml").write_text(OWN)
    synthetic.plates_run(directory / "result.nc")
    return directory


def dust(*words):
    result = CliRunner().invoke(app, [str(word) for word in words])
    return result.exception


@pytest.fixture
def user_folder(tmp_path, monkeypatch, toys):
    """The current directory, with a scene of the user's that has a comment."""
    monkeypatch.chdir(tmp_path)
    toy.prepare()
    (tmp_path / "scene.yaml").write_text(OWN + toy.SCENES["plain"])
    return tmp_path


@pytest.mark.parametrize("force", ([], ["--force"]))
def test_a_run_spares_its_own_scene(user_folder, force):
    error = dust("run", "scene.yaml", "-o", ".", "-q", *force)
    assert isinstance(error, DustError), error
    assert "scene.yaml" in str(error) and "--output" in str(error)
    assert (user_folder / "scene.yaml").read_text().startswith(OWN)
    assert not (user_folder / "result.nc").exists()


@pytest.mark.parametrize("name", ("scene.yaml", "checkpoint.bin"))
def test_a_run_spares_files_of_others(user_folder, name):
    (user_folder / "place").mkdir()
    (user_folder / "place" / name).write_text(OWN)
    for options in ([], ["--resume"]) if name == "scene.yaml" else ([],):
        error = dust("run", "scene.yaml", "-o", "place", "-q", *options)
        assert isinstance(error, DustError) and "--force overwrites it" in str(error)
        assert (user_folder / "place" / name).read_text() == OWN
    assert dust("run", "scene.yaml", "-o", "place", "-q", "--force") is None
    assert (user_folder / "place" / name).read_bytes()[: len(OWN)] != OWN.encode()


def test_the_scene_of_a_run_runs_again_in_its_place(user_folder):
    assert dust("run", "scene.yaml", "-o", "place", "-q") is None
    text = (user_folder / "place/scene.yaml").read_text()
    assert dust("run", "place/scene.yaml", "-o", "place", "-q", "--force") is None
    assert (user_folder / "place/scene.yaml").read_text() == text


@pytest.mark.parametrize(
    "words",
    (
        ["report", "RUN", "-o", "RUN/result.nc"],
        ["report", "RUN", "-o", "RUN/result.nc", "--force"],
        ["compare", "RUN", "-o", "RUN/result.nc", "--force"],
        ["report", "RUN", "-o", "RUN/scene.yaml"],
        ["report", "RUN", "-o", "notes.txt"],
        ["compare", "RUN", "-o", "notes.txt"],
        ["plot", "RUN", "-o", "figures"],
    ),
)
def test_commands_spare_inputs_and_files_of_others(user_folder, run, words):
    (user_folder / "figures").mkdir()
    files = [
        user_folder / "notes.txt",
        user_folder / "figures/ledger.png",
        run / "result.nc",
        run / "scene.yaml",
    ]
    for path in files[:2]:
        path.write_text(OWN)
    bytes_before = [path.read_bytes() for path in files]
    error = dust(*(word.replace("RUN", str(run)) for word in words))
    assert isinstance(error, DustError), error
    assert [path.read_bytes() for path in files] == bytes_before


@pytest.mark.parametrize("suffix", (".png", ".pdf", ".svg"))
def test_figures_are_drawn_again(tmp_path, suffix):
    path = tmp_path / f"figure{suffix}"
    for _ in range(2):
        plots.save(Figure(), path)
    path.write_bytes(b"of somebody else")
    with pytest.raises(DustError, match="--force overwrites it"):
        plots.save(Figure(), path)
    with writing(force=True):
        plots.save(Figure(), path)
    assert is_ours(path)


def test_figures_films_pages_and_tables(tmp_path, run):
    with open_run(run) as result:
        for _ in range(2):
            report.write(report.collect_report_data([result]), tmp_path / "page.html")
            to_csv(compare([result]), tmp_path / "table.csv")
    from dusttaichi.plots.animation import _write_gif

    images = [np.full((8, 8, 3), level, np.uint8) for level in (0, 200)]
    _write_gif(tmp_path / "film.gif", images, 5.0)
    assert is_ours(tmp_path / "film.gif")
