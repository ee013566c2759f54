"""The page of a run: what is in it, and that it works: in a browser where there is one, and always
in a JavaScript engine."""

import io
import json
import os
import re
import shutil
import subprocess
import threading
from pathlib import Path
from urllib.error import HTTPError
from urllib.request import urlopen

import netCDF4
import numpy as np
import pytest
import snapshots
import synthetic
import xarray as xr
from matplotlib.figure import Figure
from PIL import Image

from dusttaichi import report
from dusttaichi.analysis import gather, is_ensemble, open_ensemble, open_run, save_ensemble
from dusttaichi.analysis.run import Run
from dusttaichi.errors import DustError
from dusttaichi.report import page
from dusttaichi.report.interactive import html, interactive
from dusttaichi.report.packing import packed, quantised, unpacked
from dusttaichi.report.particles import chosen
from dusttaichi.report.watch import Server
from dusttaichi.scene import load

ROOT = Path(__file__).parents[2]
SOURCE = ROOT / "dusttaichi/report/source"
NAMES = ("chromium", "chromium-browser", "google-chrome", "chrome")
BROWSER = os.environ.get("DUST_BROWSER") or next(filter(None, map(shutil.which, NAMES)), None)
# no sandbox, since tests may be run by root; WebGL in software
ARGUMENTS = ["--no-sandbox", "--disable-background-networking", "--disable-component-update"]
ARGUMENTS += ["--disable-quic", "--no-first-run", "--disable-sync", "--use-gl=angle"]
ARGUMENTS += ["--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
RADIUS = 0.6e-6
SCENE = """name: made
material:
  name: silicate_s12
  radius: 0.6 um
  density: 2650 kg/m^3
  surface_energy: 20 mJ/m^2
  young_modulus: 54 GPa
  poisson_ratio: 0.17
  critical_rolling: 2 nm
"""


@pytest.fixture(scope="module")
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
        return report.report_data([run])


@pytest.fixture(scope="module")
def written(data, tmp_path_factory):
    return report.write(data, tmp_path_factory.mktemp("page") / "report.html")


# -- data ----------------------------------------------------------------------------------------


def test_numbers_are_packed_and_come_back():
    rng = np.random.default_rng(1)
    whole = rng.integers(0, 2**16, (3, 40)).astype("u2")
    assert np.array_equal(unpacked(packed(whole, 3)), whole.ravel())
    real = rng.normal(size=(5, 30)).astype("f4")
    assert np.array_equal(unpacked(packed(real)), real.ravel())
    back = unpacked(quantised(real, 5))
    assert np.abs(back - real.ravel()).max() <= 0.51 * np.ptp(real) / 65535
    kept = quantised([1.0, np.nan, 3.0])
    assert (
        unpacked(kept) == pytest.approx([1.0, kept["low"], 3.0]) and kept["low"] < kept["gap"] < 1
    )


def test_the_viewer_has_what_the_snapshots_have(data):
    view = data["runs"][0]["particles"]
    assert (view["count"], view["frames"], view["length_unit"]) == (27, 4, "µm")
    labels = [q["label"] for q in view["quantities"]]
    wanted = {"coordination number", "fragment", "sum of contact forces", "speed", "height"}
    assert wanted <= set(labels)
    x = unpacked(view["position"]).reshape(4, 27, 3)
    assert x[0].max() == pytest.approx(2.4, rel=1e-3) and x[3, :, 2].max() < 2.1
    assert view["room"][3][5] == pytest.approx(4.4 * 0.6) and view["said"][0].startswith("t = 0")
    # a corner of the cube touches three, its middle six
    coordination = unpacked(view["quantities"][labels.index("coordination number")]["data"])
    assert coordination[:27].min() == pytest.approx(3) and coordination.max() == pytest.approx(6)
    # deeper than at rest: pushed apart, by less than the pull-off force of 56.5 nN
    force = unpacked(view["pairs"]["force"])
    assert 5 < force.min() and force.max() < 56.5


def test_pages_of_many_particles_keep_fewer_snapshots():
    frames = xr.Dataset({"position": (("snapshot", "grain", "xyz"), np.zeros((50, 40_000, 1)))})
    numbers = chosen(frames)
    assert len(numbers) == 15 and numbers[0] == 0 and numbers[-1] == 49


def test_what_is_sheared_is_known():
    series = xr.Dataset({"shear_strain": ("time", [0.0, 0.1])})
    assert Run("run", series, None, None).sheared
    assert not Run("run", xr.Dataset(), None, None).sheared


def test_a_run_has_its_figures_and_numbers(tmp_path, monkeypatch):
    monkeypatch.setattr(page, "particles", lambda run: None)
    synthetic.compression_run(tmp_path / "result.nc")
    with open_run(tmp_path) as run:
        data = report.report_data([run])
    (one,) = data["runs"]
    assert {"compression", "ledger", "profile"} <= {f["name"] for f in one["figures"]}
    assert dict((row[0], row[1]) for row in one["table"])["grains"] == "1,000"


def test_several_runs_stand_side_by_side(tmp_path, monkeypatch):
    monkeypatch.setattr(page, "particles", lambda run: None)
    monkeypatch.setattr(page.plots, "figures_of", lambda run: {})
    paths = [tmp_path / name / "result.nc" for name in "ab"]
    for seed, path in enumerate(paths):
        path.parent.mkdir()
        synthetic.compression_run(path, seed=seed)
    runs = [open_run(path) for path in paths]
    data = report.report_data(runs)
    assert len(data["runs"]) == 2 and len(data["table"][0]) == 3
    assert [f["name"] for f in data["figures"]] == ["compression"]


def test_figures_become_interactive():
    figure = Figure()
    axes = figure.subplots()
    axes.plot([1, 10], [2, 3], "--", color="red", label=r"law, $\phi^{1.8}$")
    axes.plot([1, 2], [2, np.nan], "o", label="_unnamed")
    axes.fill_between([1, 2], [1, 1], [2, 2], alpha=0.2, label="scatter")
    axes.bar([5], [3], label="bar")
    axes.step([3, 4, 5], [1, 2, 3], label="steps")
    axes.errorbar([1], [2], [0.5], fmt="o", label="with a bar")
    axes.axhline(2.5, linestyle="--")
    axes.axvspan(3, 4, color="grey")
    axes.set(xscale="log", xlabel=r"pressure $p_{\rm m}$ (kPa)")
    found = interactive(figure, "one", "One")
    names = {trace["name"]: trace for trace in found["data"]}
    law = names["law, φ<sup>1.8</sup>"]
    assert law["line"]["color"] == "#ff0000" and "px" in law["line"]["dash"]
    assert names["bar"]["fill"] == "toself" and max(v or 0 for v in names["bar"]["y"]) == 3
    assert names["scatter"]["fill"] == "toself" and not names[""]["showlegend"]
    assert names[""]["y"] == [2.0, None] and names[""]["mode"] == "markers"
    assert found["layout"]["xaxis"]["type"] == "log"
    assert found["layout"]["xaxis"]["title"]["text"] == "pressure p<sub>m</sub> (kPa)"
    assert names["steps"]["line"]["shape"] == "vh" and names["with a bar"]["showlegend"]
    assert "px" in found["layout"]["shapes"][0]["line"]["dash"]
    assert [s["type"] for s in found["layout"]["shapes"]] == ["line", "rect"]
    assert html(r"$-1 \pm 2$, $E_{\rm roll}/r^3$") == "−1 ± 2, E<sub>roll</sub>/r<sup>3</sup>"


@pytest.fixture(scope="module")
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
    return report.ensemble_data(*open_ensemble(folder))


def test_a_sweep_has_its_curves_its_numbers_and_its_runs(sweep, tmp_path):
    assert sweep["lead"] == "boundary.wall_speed at 3 values" and "silicate_s12" in sweep["scene"]
    figures = {figure["name"]: figure for figure in sweep["figures"]}
    assert set(figures) >= {"sweep", "points"} and figures["points"]["wide"]
    assert sweep["members"][3] == ["wall_speed = 3 m/s", "a guard stopped it"]
    assert [row[0] for row in sweep["table"]] == ["wall speed", "1 m/s", "2 m/s", "3 m/s"]
    assert [view["particles"]["frames"] for view in sweep["views"]] == [2, 3]
    assert not is_ensemble(tmp_path)
    with pytest.raises(DustError, match="cannot be read as an ensemble"):
        open_ensemble(tmp_path / "sweep.nc")


# -- the page ------------------------------------------------------------------------------------


def test_the_page_is_one_file_that_asks_nobody(written):
    text = written.read_text(encoding="utf-8")
    outside = re.sub(r"<script.*?</script>|<!--.*?-->", "", text, flags=re.DOTALL)
    assert not re.search(r"""(?:src|href)=["'](?!data:)""", outside)
    assert "Permission is hereby granted" in text  # the licences of what is bundled
    assert written.stat().st_size < 3e6


def node(script):
    """What a script (an ES module) prints in the JavaScript engine that Playwright brings."""
    from playwright._impl._driver import compute_driver_executable

    engine = compute_driver_executable()[0]
    done = subprocess.run(
        [engine, "--input-type=module", "-"], input=script, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_the_engine_reads_what_python_has_packed(data):
    """The page's own code for its data, run by itself; and the bundle is sound JavaScript."""
    view = data["runs"][0]["particles"]
    code = (SOURCE / "data.js").read_text(encoding="utf-8")
    code += f"const a = await unpack({json.dumps(view['position'])});\n"
    code += f"const b = await unpack({json.dumps(view['pairs']['ends'])});\n"
    for name in ("plotly.js", "report.js"):
        code += f"new Function({json.dumps(page.asset(name))});\n"
    code += "console.log(JSON.stringify([[...a], [...b]]));"
    position, ends = json.loads(node(code))
    assert np.allclose(position, unpacked(view["position"]), atol=1e-6)
    assert np.array_equal(ends, unpacked(view["pairs"]["ends"]))


def result_at(path, count):
    """A result that runs on, with so many snapshots of two grains."""
    frames = [{"position": np.array([[0, 0, 0], [0, 0, 2 + n]]) * RADIUS} for n in range(count)]
    beside = path.with_name("next.nc")
    beside.unlink(missing_ok=True)
    snapshots.write(beside, frames, RADIUS, scene=SCENE)
    with netCDF4.Dataset(beside, "a") as file:
        file.status = "running"
        file.delncattr("digest")
    beside.replace(path)


@pytest.fixture(scope="module")
def server(tmp_path_factory):
    path = tmp_path_factory.mktemp("watched") / "result.nc"
    with Server(path) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        yield server
        server.shutdown()
        thread.join()


def asked(url):
    try:
        with urlopen(url) as answer:
            return answer.status, answer.read().decode()
    except HTTPError as error:
        return error.code, error.read().decode()


def test_the_page_grows_with_its_result(server):
    path = server.source.path
    assert server.url.startswith("http://127.0.0.1:")
    assert asked(server.url)[0] == 503  # there is nothing yet
    result_at(path, 2)
    code, text = asked(server.url)
    assert code == 200 and '"live": true' in text
    assert asked(f"{server.url}data.json?after=1")[0] == 204
    result_at(path, 3)
    assert asked(f"{server.url}data.json?after=1")[0] == 204  # it was made a moment ago
    server.source._next = 0.0
    code, text = asked(f"{server.url}data.json?after=1")
    data = json.loads(text)
    assert code == 200 and data["stamp"] == 2 and data["runs"][0]["particles"]["frames"] == 3
    assert asked(f"{server.url}etc/passwd")[0] == 404


def test_notebooks_show_runs_and_scenes(tmp_path):
    result_at(tmp_path / "result.nc", 2)
    with open_run(tmp_path) as run:
        shown = run._repr_html_()
        assert "<b>made</b>" in shown and "grains" in shown
        view = run.view()._repr_html_()
    assert view.startswith("<iframe srcdoc=") and len(view) < 1e6  # no plotly.js
    scene = load("smoke")._repr_html_()
    assert "silicate_s12" in scene and "wall_speed: 5 m/s" in scene and "<details>" in scene


@pytest.mark.parametrize("browser", [BROWSER] if BROWSER else [])
def test_the_page_works_in_a_browser(browser, written, sweep, server, tmp_path):
    from playwright.sync_api import sync_playwright

    with sync_playwright() as driver:
        opened = driver.chromium.launch(executable_path=browser, args=ARGUMENTS)
        view = opened.new_page(viewport={"width": 1100, "height": 800})
        said = []
        view.on("console", lambda message: said.append(message.text))
        view.on("pageerror", lambda error: said.append(str(error)))
        view.goto(written.as_uri())
        view.wait_for_function("window.dust && window.dust.ready")
        shots = {"last": shot(view)}
        view.get_by_label("snapshot", exact=True).fill("0")
        assert view.locator(".viewer-said").inner_text().startswith("t = 0")
        shots["first"] = shot(view)
        view.get_by_label("show").select_option("forces")
        shots["forces"] = shot(view)
        view.get_by_label("show").select_option("particles")
        view.get_by_label("cut across").select_option("y")
        shots["cut"] = shot(view)
        view.get_by_label("colour").select_option(label="height")
        shots["height"] = shot(view)
        view.locator(".viewer-frame canvas").click()
        assert "coordination number" in view.locator(".viewer-panel table").inner_text()
        assert view.locator(".js-plotly-plot .main-svg").count() >= 1
        turn_through_a_sweep(view, report.write(sweep, tmp_path / "sweep.html"))
        watch_it_grow(view, server)
        assert view.evaluate("window.dust.problems") == [] and not said, said
        opened.close()
    inked = {name: np.mean(picture.min(axis=-1) < 250) for name, picture in shots.items()}
    assert inked["last"] > 0.2 and inked["first"] > inked["last"]  # what is pressed takes less room
    assert 0.01 < inked["forces"] < 0.95 * inked["first"]  # rods instead of spheres
    # by height: from the violet of the lowest to the yellow of the highest
    red, blue = shots["height"][..., 0].astype(int), shots["height"][..., 2].astype(int)
    assert np.any(red - blue > 90) and np.any(blue - red > 50)
    for one, other in (("last", "first"), ("first", "cut"), ("cut", "height")):
        assert np.mean(np.abs(shots[one].astype(int) - shots[other])) > 0.5, (one, other)


def turn_through_a_sweep(view, path):
    """Curves and numbers are drawn, and the particles are those of the run that is chosen."""
    view.goto(path.as_uri())
    view.wait_for_function("window.dust && window.dust.ready")
    assert view.locator(".js-plotly-plot .main-svg").count() >= 2
    view.get_by_label("run", exact=True).select_option(label="wall_speed = 2 m/s")
    view.wait_for_function("window.dust.viewers[0]?.data.frames === 3")
    assert np.mean(shot(view).min(axis=-1) < 250) > 0.02
    assert view.locator("canvas").count() == 1


def watch_it_grow(view, server):
    """What the reader has set stays while the page of a run takes a further snapshot."""
    server.source._next = 0.0
    result_at(server.source.path, 2)
    view.goto(server.url)
    view.wait_for_function("window.dust && window.dust.ready")
    view.get_by_label("colour").select_option(label="height")
    result_at(server.source.path, 3)
    server.source._next = 0.0
    view.wait_for_function("window.dust.grown > 0")
    assert view.get_by_label("snapshot", exact=True).get_attribute("max") == "2"
    chosen = "s => s.options[s.selectedIndex].text"
    assert view.get_by_label("colour").evaluate(chosen) == "height"


def shot(view):
    """The picture of the particles, (height, width, 3) bytes, once it is drawn."""
    view.evaluate("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
    picture = view.locator(".viewer-frame canvas").screenshot()
    return np.asarray(Image.open(io.BytesIO(picture)).convert("RGB"))
