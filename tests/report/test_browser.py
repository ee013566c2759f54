"""The page works in a browser, where there is one."""

import io

import numpy as np
import pytest
from pages import ARGUMENTS, BROWSER, result_at
from PIL import Image

from dusttaichi import report


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
