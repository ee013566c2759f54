"""The page of a run: what is in it, and that a JavaScript engine reads it."""

import base64
import json
import re
import subprocess
import zlib
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from urllib.error import HTTPError
from urllib.request import Request, urlopen

import numpy as np
import pytest
import snapshots
import synthetic
import xarray as xr
from matplotlib.figure import Figure
from pages import RADIUS, SCENE, result_at

from dusttaichi import method, plots, report
from dusttaichi.analysis import find_study, open_ensemble, open_run
from dusttaichi.analysis.run import Run
from dusttaichi.errors import DustError
from dusttaichi.report import page, viewer_contacts, viewer_particles
from dusttaichi.report.interactive import convert_label, make_interactive
from dusttaichi.report.packing import pack_array, quantise
from dusttaichi.report.selection import select_particles
from dusttaichi.report.viewer_particles import (
    choose_colour,
    choose_snapshots,
    collect_particles,
    list_dissipation,
)
from dusttaichi.scene import load

ROOT = Path(__file__).parents[2]
SOURCE = ROOT / "dusttaichi/report/source"


# -- data ----------------------------------------------------------------------------------------


def unpack(result):
    """The numbers of `pack_array` or `quantise`, flat; as data.js does."""
    size = int(result["type"][1])
    planes = np.frombuffer(zlib.decompress(base64.b64decode(result["data"])), np.uint8)
    values = np.ascontiguousarray(planes.reshape(size, -1).T).view(f"<{result['type']}").ravel()
    if result["type"][0] == "u" and result["rows"] > 1:
        rows = values.reshape(result["rows"], -1)
        values = np.cumsum(rows, axis=0, dtype=values.dtype).ravel()
    if "low" not in result:
        return values
    return result["low"] + values * (result["high"] - result["low"]) / (2 ** (8 * size) - 1)


def test_numbers_are_packed_and_come_back():
    rng = np.random.default_rng(1)
    integers = rng.integers(0, 2**16, (3, 40)).astype("u2")
    assert np.array_equal(unpack(pack_array(integers, 3)), integers.ravel())
    reals = rng.normal(size=(5, 30)).astype("f4")
    assert np.array_equal(unpack(pack_array(reals)), reals.ravel())
    back = unpack(quantise(reals, 5))
    assert np.abs(back - reals.ravel()).max() <= 0.51 * np.ptp(reals) / 65535
    packed = quantise([1.0, np.nan, 3.0])
    assert (
        unpack(packed) == pytest.approx([1.0, packed["low"], 3.0])
        and packed["low"] < packed["gap"] < 1
    )


def test_the_viewer_has_what_the_snapshots_have(data):
    view = data["runs"][0]["particles"]
    assert (view["count"], view["frames"], view["length_unit"]) == (27, 4, "µm")
    labels = [q["label"] for q in view["quantities"]]
    expected = {"coordination number", "fragment", "sum of contact forces", "speed", "height"}
    assert expected <= set(labels)
    x = unpack(view["position"]).reshape(4, 27, 3)
    assert x[0].max() == pytest.approx(2.4, rel=1e-3) and x[3, :, 2].max() < 2.1
    assert view["room"][3][5] == pytest.approx(4.4 * 0.6) and view["said"][0].startswith("t = 0")
    # a corner of the cube touches three, its middle six
    coordination = unpack(view["quantities"][labels.index("coordination number")]["data"])
    assert coordination[:27].min() == pytest.approx(3) and coordination.max() == pytest.approx(6)
    # deeper than at rest: pushed apart, by less than the pull-off force of 56.5 nN
    force = unpack(view["pairs"]["force"])
    assert 5 < force.min() and force.max() < 56.5


def test_the_pressure_of_a_snapshot_is_that_of_the_table():
    """Between walls that on the top wall, also where the stress of the cell is recorded."""
    stress = np.diag([-130e3, -130e3, -212e3]) * np.array([0.0, 1.0])[:, None, None]
    frames = xr.Dataset({"snapshot_time": ("snapshot", [1e-6]), "step": ("snapshot", [1])})
    walled = synthetic.make_run(pressure=np.array([0.0, 212e3]), stress=stress)
    assert viewer_particles.describe_snapshots(walled, frames) == ["t = 1 µs, P = 212 kPa"]
    cell = synthetic.make_run(stress=stress)
    assert viewer_particles.describe_snapshots(cell, frames) == ["t = 1 µs, P = 157 kPa"]


def test_force_chains_go_on_to_the_walls(tmp_path):
    """Two grains on top of each other, the lower one on the floor, pressed with 5 and 9 nN."""
    frame = {
        "position": np.array([[0, 0, 1], [0, 0, 3]]) * RADIUS,
        "pairs": [(1, 0)],
        "overlap": np.zeros(1),
        "force": np.array([[0, 0, 5e-9]]),
        "normal_force": np.array([5e-9]),
        "torque_i": np.zeros((1, 3)),
        "torque_j": np.zeros((1, 3)),
        "touching": [(0, 4)],
        "wall_force": np.array([[0, 0, 9e-9]]),
        "wall_normal_force": np.array([9e-9]),
        "wall_torque": np.zeros((1, 3)),
    }
    box = np.array([-4, 4, -4, 4, 0, 8]) * RADIUS
    path = snapshots.write(tmp_path / "result.nc", [frame], RADIUS, box=box, scene=SCENE)
    with open_run(path) as run:
        view = collect_particles(run)
    assert view["pairs"]["counts"] == [2]
    assert unpack(view["pairs"]["ends"]).reshape(2, 2).tolist() == [[1, 0], [0, 2 + 4]]
    assert unpack(view["pairs"]["force"]) == pytest.approx([5.0, 9.0], rel=1e-4)
    (load,) = (q for q in view["quantities"] if q["label"] == "sum of contact forces")
    assert unpack(load["data"]) == pytest.approx([14.0, 5.0], rel=1e-4)


def test_a_page_of_many_grains_shows_a_slice(tmp_path, monkeypatch):
    """A row of five grains along y on the floor, pressed with 1 to 4 nN, of which the three in the
    middle are shown, with their own contacts and the numbers that they have in the whole row."""
    count, middle = 5, [1, 2, 3]
    frame = {
        "position": np.column_stack([np.zeros(count), 2.0 * np.arange(count), np.ones(count)])
        * RADIUS,
        "pairs": [(n, n + 1) for n in range(count - 1)],
        "overlap": np.zeros(count - 1),
        "force": np.zeros((count - 1, 3)),
        "normal_force": np.arange(1.0, count) * 1e-9,
        "torque_i": np.zeros((count - 1, 3)),
        "torque_j": np.zeros((count - 1, 3)),
        "touching": [(n, 4) for n in range(count)],
        "wall_force": np.zeros((count, 3)),
        "wall_normal_force": np.arange(count) * 1e-9,
        "wall_torque": np.zeros((count, 3)),
    }
    box = np.array([-4, 4, -4, 12, 0, 8]) * RADIUS
    path = snapshots.write(tmp_path / "result.nc", [frame, frame], RADIUS, box=box, scene=SCENE)
    monkeypatch.setattr(select_particles, "__defaults__", (False, len(middle)))
    with open_run(path) as run:
        view = collect_particles(run)
    assert view["count"] == 3 and view["frames"] == 2
    assert all("a slice of 3 of 5 grains" in text for text in view["said"])
    x = unpack(view["position"]).reshape(2, 3, 3)
    np.testing.assert_allclose(x[1, :, 1], 2.0 * np.array(middle) * 0.6, rtol=1e-4)
    ends = unpack(view["pairs"]["ends"]).reshape(-1, 2)[:5].astype(int)
    assert ends.tolist() == [[0, 1], [1, 2], [0, 3 + 4], [1, 3 + 4], [2, 3 + 4]]
    force = unpack(view["pairs"]["force"])[:5]
    np.testing.assert_allclose(force, [2.0, 3.0, 1.0, 2.0, 3.0], rtol=1e-4)
    quantities = {q["label"]: unpack(q["data"]) for q in view["quantities"]}
    assert quantities["coordination number"][:3] == pytest.approx([2.0] * 3)
    # of both neighbours and the floor
    assert quantities["sum of contact forces"][:3] == pytest.approx([4.0, 7.0, 10.0], rel=1e-4)


def test_a_flat_body_has_random_particles():
    x = np.zeros((1, 50, 3))
    frames = xr.Dataset({"position": (("snapshot", "particle", "xyz"), x)})
    selection = select_particles(frames, flat=True, max_count=20)
    assert selection.size == 20 == len(set(selection.numbers))
    assert selection.text == "20 random ones of 50 particles"
    assert select_particles(frames, flat=True, max_count=50).text == ""


def test_pages_of_many_particles_keep_fewer_snapshots():
    frames = xr.Dataset({"position": (("snapshot", "grain", "xyz"), np.zeros((50, 40_000, 1)))})
    numbers = choose_snapshots(frames)
    assert len(numbers) == 15 and numbers[0] == 0 and numbers[-1] == 49
    series = xr.Dataset({"shear_strain": ("time", [0.0, 0.1])})
    assert Run("run", series, None, None).sheared
    assert not Run("run", xr.Dataset(), None, None).sheared


def test_runs_have_their_figures_and_numbers_one_alone_or_side_by_side(tmp_path, monkeypatch):
    monkeypatch.setattr(page, "collect_particles", lambda run: None)
    synthetic.compression_run(tmp_path / "result.nc")
    with open_run(tmp_path) as run:
        data = report.collect_report_data([run])
    (run_data,) = data["runs"]
    assert {"compression", "ledger", "profile"} <= {f["name"] for f in run_data["figures"]}
    assert dict((row[0], row[1]) for row in run_data["table"])["grains"] == "1,000"
    monkeypatch.setattr(page, "collect_particles", lambda run: None)
    monkeypatch.setattr(page.plots, "draw_run", lambda run: [])
    paths = [tmp_path / name / "result.nc" for name in "ab"]
    for seed, path in enumerate(paths):
        path.parent.mkdir()
        synthetic.compression_run(path, seed=seed)
    runs = [open_run(path) for path in paths]
    data = report.collect_report_data(runs)
    assert len(data["runs"]) == 2 and len(data["table"][0]) == 3
    assert [f["name"] for f in data["figures"]] == ["compression"]


def test_a_figure_that_fails_is_named_and_the_others_are_drawn(tmp_path, monkeypatch):
    monkeypatch.setattr(page, "collect_particles", lambda run: None)

    def broken(run):
        raise IndexError("index 3 is out of bounds")

    own, grains = plots.coordination.row, method.load_method("grains")
    rows = [replace(row, draw=broken) if row is own else row for row in plots.list_figures(grains)]
    monkeypatch.setattr(plots.figure_registry, "list_figures", lambda of_method=None: rows)
    synthetic.compression_run(tmp_path / "result.nc")
    with open_run(tmp_path) as run:
        (run_data,) = report.collect_report_data([run])["runs"]
    assert {f["name"] for f in run_data["figures"]} == {"compression", "ledger", "profile"}
    failed = [row for row in run_data["table"] if row[0] == "figure not drawn"]
    assert failed == [["figure not drawn", "Contacts: IndexError: index 3 is out of bounds", ""]]


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
    interactive = make_interactive(figure, "one", "One")
    names = {trace["name"]: trace for trace in interactive["data"]}
    law = names["law, φ<sup>1.8</sup>"]
    assert law["line"]["color"] == "#ff0000" and "px" in law["line"]["dash"]
    assert names["bar"]["fill"] == "toself" and max(v or 0 for v in names["bar"]["y"]) == 3
    assert names["scatter"]["fill"] == "toself" and not names[""]["showlegend"]
    assert names[""]["y"] == [2.0, None] and names[""]["mode"] == "markers"
    assert interactive["layout"]["xaxis"]["type"] == "log"
    assert interactive["layout"]["xaxis"]["title"]["text"] == "pressure p<sub>m</sub> (kPa)"
    assert names["steps"]["line"]["shape"] == "vh" and names["with a bar"]["showlegend"]
    assert "px" in interactive["layout"]["shapes"][0]["line"]["dash"]
    assert [s["type"] for s in interactive["layout"]["shapes"]] == ["line", "rect"]
    assert (
        convert_label(r"$-1 \pm 2$, $E_{\rm roll}/r^3$") == "−1 ± 2, E<sub>roll</sub>/r<sup>3</sup>"
    )


def test_histograms_keep_all_their_steps():
    """matplotlib leaves out of a long path what is finer than a pixel; here a pixel is no unit."""
    figure, fractions = Figure(), np.linspace(0.0, 1.0, 100) ** 2
    figure.subplots().stairs(fractions, np.linspace(0.1, 0.6, 101), label="end")
    (trace,) = make_interactive(figure, "one", "One")["data"]
    heights = {y for y in trace["y"] if y is not None}
    assert heights == {float(f"{fraction:.5g}") for fraction in fractions}
    figure = Figure()
    axes = figure.subplots()
    axes.plot([0, 1], [2.0, 3.0])
    axes.set_xticks([0, 1], ["none", "viscous"])
    layout = make_interactive(figure, "one", "One")["layout"]
    assert layout["xaxis"]["ticktext"] == ["none", "viscous"]
    assert layout["xaxis"]["tickvals"] == [0.0, 1.0] and "tickvals" not in layout["yaxis"]


def test_pictures_stay_pictures():
    """A wide one has a row of the page to itself."""
    for width, wide in ((5.0, False), (10.0, True)):
        figure = Figure(figsize=(width, 1.0))
        figure.subplots().imshow(np.zeros((2, 2)))
        shown = json.loads(page.format_json(make_interactive(figure, "one", "One")))
        assert shown["image"].startswith("data:image/png") and shown["wide"] is wide


def test_a_sweep_has_its_curves_its_numbers_and_its_runs(sweep, tmp_path):
    assert (
        sweep["lead"] == "wall speed (boundary.wall_speed) at 3 values"
        and "silicate_s12" in sweep["scene"]
    )
    figures = {figure["name"]: figure for figure in sweep["figures"]}
    assert set(figures) >= {"sweep", "points"} and figures["points"]["wide"]
    assert sweep["members"][3] == ["wall speed = 3 m/s", "a guard stopped it"]
    assert [row[0] for row in sweep["table"]] == ["wall speed", "1 m/s", "2 m/s", "3 m/s"]
    assert [view["particles"]["frames"] for view in sweep["views"]] == [2, 3]
    assert find_study(tmp_path) is None
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
    process = subprocess.run(
        [engine, "--input-type=module", "-"], input=script, capture_output=True, text=True
    )
    assert process.returncode == 0, process.stderr
    return process.stdout


def test_the_engine_reads_what_python_has_packed(data):
    """The page's own code for its data, run by itself; and the bundle is sound JavaScript."""
    view = data["runs"][0]["particles"]
    code = (SOURCE / "data.js").read_text(encoding="utf-8")
    code += f"const a = await unpack({json.dumps(view['position'])});\n"
    code += f"const b = await unpack({json.dumps(view['pairs']['ends'])});\n"
    for name in ("plotly.js", "report.js"):
        code += f"new Function({json.dumps(page.read_asset(name))});\n"
    code += "console.log(JSON.stringify([[...a], [...b]]));"
    position, ends = json.loads(node(code))
    assert np.allclose(position, unpack(view["position"]), atol=1e-6)
    assert np.array_equal(ends, unpack(view["pairs"]["ends"]))


def test_figures_fit_a_narrow_and_a_dark_page():
    """Columns of axes below one another with their ticks, the legend in rows; no dark line."""
    figure = Figure(figsize=(10.0, 3.0))
    for number, axes in enumerate(figure.subplots(1, 3, sharey=True)):
        axes.plot([1, 2], [number, 2], color="black", label=f"a name of some length, {number}")
    interactive = make_interactive(figure, "three", "Three")
    code = (SOURCE / "figures.js").read_text(encoding="utf-8")
    code += f"const figure = {json.dumps(interactive)};\n"
    code += "const made = [arranged(figure, 1100, false), arranged(figure, 360, true)];\n"
    code += "console.log(JSON.stringify(made));"
    wide, narrow = json.loads(node(code))
    assert wide["data"][0]["line"]["color"] == "#000000" and wide["layout"]["width"] == 1100
    axes = [narrow["layout"][name] for name in ("xaxis", "xaxis2", "xaxis3")]
    assert [a["domain"] for a in axes] == [[0, 1]] * 3
    assert all(narrow["layout"][name]["showticklabels"] for name in ("yaxis", "yaxis2", "yaxis3"))
    lows = [narrow["layout"][name]["domain"][0] for name in ("yaxis", "yaxis2", "yaxis3")]
    assert lows == sorted(lows, reverse=True) and lows[-1] == 0
    # room for a name a row, where a wide page has all in one
    extra_margins = [
        figure_data["layout"]["margin"]["b"] - interactive["layout"]["margin"]["b"]
        for figure_data in (wide, narrow)
    ]
    assert extra_margins[1] > 2.0 * extra_margins[0] > 0
    red, green, blue, _ = map(float, narrow["data"][0]["line"]["color"][5:-1].split(","))
    assert min(red, green, blue) > 200


def test_what_was_asked_for_colours_at_first(data):
    view = data["runs"][0]["particles"]
    assert view["quantities"][view["colour"]]["label"] == "coordination number"
    lost = xr.Dataset({"loss": (("contact", "channel"), [[1.0, 1.0], [4.0, 0.0]])})
    frame = SimpleNamespace(
        radius=np.ones(3), contacts=lost, wall_contacts=None, pairs=np.array([[0, 1], [1, 2]])
    )
    frame.require_contacts = lambda: lost
    run = SimpleNamespace(tree=SimpleNamespace(children=()))
    assert viewer_contacts.sum_dissipation(run, frame).tolist() == [1.0, 3.0, 2.0]
    labels = ["coordination number", viewer_contacts.BODY, viewer_contacts.DISSIPATED]
    of_grains = xr.DataArray(
        [[[1.0, 0.0, 2.0]] * 3], {"channel": ["rolling", "sliding", "damping"]},
        ("snapshot", "grain", "channel"),
    )  # fmt: skip
    labels += [quantity["label"] for quantity in list_dissipation(of_grains, 1)]
    assert labels[3:] == [
        "energy dissipated since the start", "dissipated by rolling", "dissipated by damping",
    ]  # fmt: skip
    for collides, frame_count, first in ((True, 2, 1), (False, 2, 0), (True, 3, 2), (True, 6, 3)):
        assert choose_colour(SimpleNamespace(collides=collides), labels[:frame_count]) == first


def ask_server(url, host=None):
    try:
        with urlopen(Request(url, headers={"Host": host} if host else {})) as answer:
            return answer.status, answer.read().decode()
    except HTTPError as error:
        return error.code, error.read().decode()


def test_the_page_grows_with_its_result(server):
    path = server.source.path
    assert server.url.startswith("http://127.0.0.1:")
    assert ask_server(server.url)[0] == 503  # there is nothing yet
    result_at(path, 2)
    code, text = ask_server(server.url)
    assert code == 200 and '"live": true' in text
    assert ask_server(f"{server.url}data.json?after=1")[0] == 204
    result_at(path, 3)
    assert ask_server(f"{server.url}data.json?after=1")[0] == 204  # it was made a moment ago
    server.source._next = 0.0
    code, text = ask_server(f"{server.url}data.json?after=1")
    data = json.loads(text)
    assert code == 200 and data["stamp"] == 2 and data["runs"][0]["particles"]["frames"] == 3
    assert ask_server(f"{server.url}etc/passwd")[0] == 404


def test_notebooks_show_runs_and_scenes(tmp_path):
    result_at(tmp_path / "result.nc", 2)
    with open_run(tmp_path) as run:
        shown = run._repr_html_()
        assert "<b>made</b>" in shown and "grains" in shown
        words = "running; 2 grains, 2 records to t = 1 ns"
        assert repr(run) == f"<Run made: {words}; {tmp_path}/result.nc>"
        view = run.view()._repr_html_()
    assert view.startswith("<iframe srcdoc=") and len(view) < 1e6  # no plotly.js
    scene = load("smoke")._repr_html_()
    assert "silicate_s12" in scene and "wall_speed: 5 m/s" in scene and "<details>" in scene


def test_pages_from_elsewhere_cannot_read_a_run(server):
    """Their own name may lead to this machine (DNS rebinding): it is in the header."""
    result_at(server.source.path, 2)
    port = server.server_address[1]
    assert ask_server(server.url, f"localhost:{port}")[0] == 200
    for host in ("evil.example", f"evil.example:{port}", "127.0.0.1", "localhost:1"):
        code, text = ask_server(server.url, host)
        assert code == 403 and "live" not in text
