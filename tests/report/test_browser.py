"""The page works in a browser, where there is one."""

import io
from itertools import product

import numpy as np
import pytest
from pages import ARGUMENTS, BROWSER, result_at
from PIL import Image

from dusttaichi import report

# what a page holds: test_report
pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(BROWSER is None, reason="there is no browser"),
]
READY = "window.dust && window.dust.ready"
DRAWN = "document.querySelectorAll('.js-plotly-plot .main-svg').length > 0"


@pytest.fixture(scope="module")
def browser():
    from playwright.sync_api import sync_playwright

    with sync_playwright() as driver:
        opened = driver.chromium.launch(executable_path=BROWSER, args=ARGUMENTS)
        yield opened
        opened.close()


@pytest.fixture
def open_page(browser):
    """A function that opens an address in a page of a width and a colour scheme; nothing may be
    said on its console."""
    pages, messages = [], []

    def open_page(address, width=1100, scheme="light", height=800):
        size = {"width": width, "height": height}
        view = browser.new_page(viewport=size, color_scheme=scheme)
        view.on("console", lambda message: messages.append(message.text))
        view.on("pageerror", lambda error: messages.append(str(error)))
        view.goto(address)
        view.wait_for_function(READY)
        view.wait_for_function(DRAWN)
        pages.append(view)
        return view

    yield open_page
    assert not messages, messages
    for view in pages:
        assert view.evaluate("window.dust.problems") == []
        view.close()


def test_the_page_works_in_a_browser(open_page, written, sweep, server, tmp_path):
    view = open_page(written.as_uri())
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
    turn_through_a_sweep(view, report.write(sweep, tmp_path / "sweep.html"))
    watch_it_grow(view, server)
    inked = {name: np.mean(picture.min(axis=-1) < 250) for name, picture in shots.items()}
    assert inked["last"] > 0.2 and inked["first"] > inked["last"]  # what is pressed takes less room
    assert 0.01 < inked["forces"] < 0.95 * inked["first"]  # rods instead of spheres
    # by height: from the violet of the lowest to the yellow of the highest
    red, blue = shots["height"][..., 0].astype(int), shots["height"][..., 2].astype(int)
    assert np.any(red - blue > 90) and np.any(blue - red > 50)
    for first, second in (("last", "first"), ("first", "cut"), ("cut", "height")):
        assert np.mean(np.abs(shots[first].astype(int) - shots[second])) > 0.5, (first, second)


def turn_through_a_sweep(view, path):
    """Curves and numbers are drawn, and the particles are those of the run that is chosen."""
    view.goto(path.as_uri())
    view.wait_for_function(READY)
    view.wait_for_function("document.querySelectorAll('.js-plotly-plot .main-svg').length >= 2")
    view.get_by_label("run", exact=True).select_option(label="wall speed = 2 m/s")
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
    script = "s => s.options[s.selectedIndex].text"
    assert view.get_by_label("colour").evaluate(script) == "height"


def shot(view):
    """The picture of the particles, (height, width, 3) bytes, once it is drawn."""
    view.evaluate("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
    picture = view.locator(".viewer-frame canvas").screenshot()
    return np.asarray(Image.open(io.BytesIO(picture)).convert("RGB"))


# -- light and dark, wide and narrow ---------------------------------------------------------------

WIDTHS = (1400, 400)


def test_light_and_dark_pages_show_the_same(open_page, written):
    """Screenshots compared by what is where and by the colours of grains, not by pixels: the same
    grains in the same colours, the same lines of the figure, on white and on black."""
    for width in WIDTHS:
        views = {scheme: open_page(written.as_uri(), width, scheme) for scheme in ("light", "dark")}
        grains = {scheme: shot(view).astype(int) for scheme, view in views.items()}
        papers = {scheme: picture[0, 0] for scheme, picture in grains.items()}
        assert papers["light"].min() > 250 and papers["dark"].max() < 60
        inked_parts = {scheme: find_ink(picture, 12) for scheme, picture in grains.items()}
        assert inked_parts["light"].mean() > 0.05
        # edges blend with the paper, and shade is near it on a dark page
        assert np.mean(inked_parts["light"] == inked_parts["dark"]) > 0.95
        both = inked_parts["light"] & inked_parts["dark"]
        assert np.median(np.abs(grains["light"] - grains["dark"])[both]) <= 1
        lines = {
            scheme: find_ink(picture_of(view, ".figure .main-svg").astype(int))
            for scheme, view in views.items()
        }
        assert coarse(lines["light"]).mean() > 0.1
        assert np.mean(coarse(lines["light"]) == coarse(lines["dark"])) > 0.9
        for view in views.values():
            text = view.evaluate("getComputedStyle(document.body).color")
            ground = view.evaluate("getComputedStyle(document.body).backgroundColor")
            assert abs(brightness(text) - brightness(ground)) > 150
            assert view.evaluate("document.documentElement.scrollWidth") == width


def test_every_snapshot_is_in_the_picture(open_page, written):
    """At any width, whichever is shown first: nothing is at the edge but the paper."""
    for width, height in product(WIDTHS, (500, 1000)):
        view = open_page(written.as_uri(), width, height=height)
        for number in ("3", "0"):
            view.get_by_label("snapshot", exact=True).fill(number)
            seen = find_ink(shot(view).astype(int))
            assert seen.any() and not (seen[0].any() or seen[-1].any())
            assert not (seen[:, 0].any() or seen[:, -1].any())


def test_a_cut_grain_has_its_own_colour(open_page, written):
    """The cut is as the legend has the colour, without light and shade."""
    view = open_page(written.as_uri())
    view.get_by_label("look from").select_option("front")
    flat = flat_share(shot(view))
    view.get_by_label("cut across").select_option("y")
    assert flat_share(shot(view)) > flat + 0.05
    view = open_page(written.as_uri())
    view.get_by_role("button", name="light / dark").click()
    assert shot(view)[0, 0].max() < 60


def test_what_is_shown_is_explained(open_page, written):
    view = open_page(written.as_uri())
    assert (
        view.get_by_label("colour").locator("option:checked").inner_text() == "coordination number"
    )
    assert [t.text_content() for t in view.locator(".viewer-triad text").all()] == ["x", "y", "z"]
    view.get_by_label("show").select_option("forces")
    legend = view.locator(".viewer-legend").nth(1).inner_text()
    assert "pushed apart" in legend and "pulled together" in legend and "nN" in legend
    view.get_by_label("show").select_option("particles")
    view.locator(".viewer-frame canvas").click()
    table = view.locator(".viewer-panel table").inner_text()
    rows = dict(line.split("\t") for line in table.splitlines())
    assert rows["position"].endswith(" µm") and rows["speed"].endswith("m/s")
    view.locator(".figure").first.hover()
    titles = [b.get_attribute("data-title") for b in view.locator(".modebar-btn").all()]
    assert titles and not any("Share" in title for title in titles)


def test_a_view_is_kept_as_picture_and_as_address(open_page, written):
    view = open_page(written.as_uri())
    view.get_by_label("snapshot", exact=True).fill("1")
    view.get_by_label("colour").select_option(label="height")
    view.get_by_label("cut across").select_option("x")
    view.get_by_label("look from").select_option("side")
    seen = shot(view)
    with view.expect_download() as download:
        view.get_by_role("button", name="save picture").click()
    picture = np.asarray(Image.open(download.value.path()).convert("RGB"))
    # the legend below
    assert abs(picture.shape[1] - seen.shape[1]) <= 1 and picture.shape[0] > seen.shape[0] + 20
    view.get_by_role("button", name="copy view").click()
    assert "colour=height" in view.url and "snapshot=1" in view.url
    second_view = open_page(view.url)
    assert np.mean(np.abs(shot(second_view).astype(int) - seen)) < 1.0


def find_ink(picture, least=40):
    """Where a picture (height, width, 3) differs from its paper by more than `least`."""
    return np.abs(picture - picture[0, 0]).max(axis=-1) > least


def coarse(mask, cells=24):
    """Whether something is there, in each cell of a grid over a mask."""
    rows, columns = (np.arange(n) * cells // n for n in mask.shape)
    count = np.zeros((cells, cells))
    np.add.at(count, (rows[:, None], columns[None, :]), mask)
    return count > 2


def flat_share(picture):
    """Share of the pixels off the paper that have the colour of all their neighbours."""
    values = picture.astype(int)
    same = np.ones(values.shape[:2], bool)
    for axis, by in product((0, 1), (-1, 1)):
        same &= (values == np.roll(values, by, axis)).all(axis=-1)
    seen = find_ink(values)
    return np.mean(same[seen])


def brightness(colour):
    """Mean of the three numbers of a colour of CSS."""
    return np.mean([float(v) for v in colour.split("(")[1].rstrip(")").split(",")[:3]])


def picture_of(view, selector):
    """What is at the first place of a selector, (height, width, 3) bytes."""
    picture = view.locator(selector).first.screenshot()
    return np.asarray(Image.open(io.BytesIO(picture)).convert("RGB"))
