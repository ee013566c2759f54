"""What the page of a large run costs: `PYTHONPATH=tests python tests/report/measure.py
[GRAINS SNAPSHOTS]...`.

Made-up runs of grains on a lattice with holes, pressed from above, each with the contacts of its
neighbours: the size of the page, and in headless Chromium the shortest time of many that the page's
own code takes to turn the picture (with its calls of WebGL) and to move the slider by one, the draw
calls, and the bytes that then go to the graphics card. What that card would do is not in it.
"""

import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import snapshots
from pages import ARGUMENTS, BROWSER, RADIUS, SCENE
from playwright.sync_api import sync_playwright
from scipy.spatial import cKDTree

from dusttaichi import report
from dusttaichi.analysis import open_run

CASES = ((10_000, 50), (100_000, 6))
COUNT_BYTES = """
for (const name of ["bufferData", "bufferSubData"]) {
  const own = WebGL2RenderingContext.prototype[name];
  WebGL2RenderingContext.prototype[name] = function (...given) {
    const data = given.find((one) => ArrayBuffer.isView(one));
    window.uploaded = (window.uploaded || 0) + (data ? data.byteLength : 0);
    return own.apply(this, given);
  };
}
"""
MEASURE = """
async ({ shown, repeats }) => {
  const viewer = window.dust.viewers[0];
  viewer.state.show = shown;
  viewer.update();
  const rest = () => new Promise((done) => setTimeout(done, 40));
  const timed = (act) => {
    const start = performance.now();
    act();
    return performance.now() - start;
  };
  const turning = [], moving = [], bytes = [];
  for (let n = 0; n < repeats; n++) {
    await rest();
    turning.push(timed(() => {
      viewer.camera.position.x += 0.01 * viewer.extent;
      viewer.controls.update();
      viewer.renderer.render(viewer.scene, viewer.camera);
    }));
    await rest();
    const before = window.uploaded;
    moving.push(timed(() => viewer.go((viewer.frame + 1) % viewer.data.frames)));
    viewer.renderer.render(viewer.scene, viewer.camera);
    bytes.push(window.uploaded - before);
  }
  const { calls, triangles } = viewer.renderer.info.render;
  const least = { turning: Math.min(...turning), moving: Math.min(...moving) };
  return { ...least, bytes: Math.max(...bytes), calls, triangles };
}
"""
REPEATS = 24


def write_result(path, grains, count):
    """A result with `count` snapshots of some `grains` grains: half of a lattice, pressed."""
    rng = np.random.default_rng(1)
    edge = round((2 * grains) ** (1 / 3)) + 1
    lattice = np.stack(np.meshgrid(*[np.arange(edge)] * 3, indexing="ij"), -1).reshape(-1, 3)
    positions = rng.permutation(lattice)[:grains] * 1.94 * RADIUS
    frames = []
    for _ in range(count):
        # each on its own way, the higher the farther: what moves costs room in the page
        positions = positions + rng.normal(scale=0.02 * RADIUS, size=positions.shape)
        positions[:, 2] *= 1.0 - 0.3 / count
        pairs = cKDTree(positions).query_pairs(2.2 * RADIUS, output_type="ndarray")
        apart = np.linalg.norm(positions[pairs[:, 0]] - positions[pairs[:, 1]], axis=1)
        frames.append(
            {
                "position": positions,
                "velocity": rng.normal(size=positions.shape),
                "pairs": pairs,
                "overlap": np.clip(2.0 * RADIUS - apart, 1e-11, 3e-9),
                "box": np.array([-1, 2 * edge, -1, 2 * edge, -1, 2 * edge]) * RADIUS,
            }
        )
    return snapshots.write(path, frames, RADIUS, box=np.zeros(6), scene=SCENE)


def main(cases):
    """Entry point: one paragraph a case."""
    folder = Path(tempfile.mkdtemp())
    with sync_playwright() as driver:
        for grains, count in cases:
            result = write_result(folder / f"{grains}.nc", grains, count)
            began = time.process_time()
            with open_run(result) as run:
                data = report.collect_report_data([run])
            path = report.write(data, folder / f"{grains}.html")
            took = time.process_time() - began
            contacts = data["runs"][0]["particles"]["pairs"]["counts"][-1]
            frames = data["runs"][0]["particles"]["frames"]
            print(f"{grains} grains, {contacts} contacts, {frames} of {count} snapshots: ", end="")
            print(f"{path.stat().st_size / 1e6:.1f} MB, made in {took:.0f} s of one core")
            opened = driver.chromium.launch(executable_path=BROWSER, args=ARGUMENTS)
            view = opened.new_page(viewport={"width": 900, "height": 500})
            view.set_default_timeout(300_000)
            view.add_init_script(COUNT_BYTES)
            start = time.perf_counter()
            view.goto(path.as_uri())
            view.wait_for_function("window.dust && window.dust.ready")
            print(f"  opened after {time.perf_counter() - start:.1f} s")
            for shown in ("particles", "forces"):
                times = view.evaluate(MEASURE, {"shown": shown, "repeats": REPEATS})
                print(
                    f"  {shown}: turning {times['turning']:.1f} ms, slider {times['moving']:.1f} ms"
                    f" and {times['bytes'] / 1e6:.2f} MB, {times['calls']} draw calls, "
                    f"{times['triangles']} triangles"
                )
            opened.close()


if __name__ == "__main__":
    words = [int(word) for word in sys.argv[1:]]
    main(list(zip(words[::2], words[1::2], strict=True)) or CASES)
