"""A film of the grains over the snapshots of a run: GIF, or MP4 where there is ffmpeg."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Iterable
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, cast

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from dusttaichi.analysis.frame import count_frames
from dusttaichi.errors import DustError
from dusttaichi.plots.canvas import get_renderer
from dusttaichi.plots.figure_registry import picture_of
from dusttaichi.results.outputs import MARK, check

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from dusttaichi.analysis.run import Run
    from dusttaichi.plots.grain_picture import Colour, View

DPI = 110
SECONDS = 8.0  # of a film by default, and
SLOWEST, FASTEST = 4.0, 25.0  # frames a second that it may take
LAST = 1.2  # seconds that the last frame of a GIF stays


def animation(
    run: Run,
    path: str | Path,
    color: Colour | None = None,
    view: View = "oblique",
    *,
    rate: float | None = None,
    cell: bool = True,
    dpi: int = DPI,
) -> Path:
    """Write the snapshots of a run as a film, with the same colours and frame throughout.

    Parameters
    ----------
    run : Run
    path : path
        File to write, .gif or .mp4.
    color : str, optional
        As in `grains`; of a run of the continuum as in `dust`. Default: the usual quantity.
    view : str or tuple
        As in `grains`; not of the continuum.
    rate : float, optional
        Frames per second. Default: such that the film lasts some eight seconds.
    cell : bool
        As in `grains`.
    dpi : int
        Pixels per inch.

    Returns
    -------
    pathlib.Path
        Path of the film.

    Raises
    ------
    DustError
        There are fewer than two snapshots, the kind of file is unknown, ffmpeg is missing, or the
        film cannot be written.
    """
    path, count = Path(path), count_frames(run)
    writers = {".gif": _write_gif, ".mp4": _write_mp4}
    if path.suffix not in writers:
        raise DustError(f"A film cannot be written to {path}; allowed: .gif and .mp4.")
    if count < 2:
        raise DustError(f"{run.path} holds one snapshot only: set output: snapshots in the scene.")
    check(path)
    if rate is None:
        rate = min(max(count / SECONDS, SLOWEST), FASTEST)
    figures = picture_of(run).film(run, color, view, cell=cell, dpi=dpi)
    try:
        writers[path.suffix](path, map(_render_image, figures), rate)
    except OSError as error:
        raise DustError(f"The film cannot be written to {path}: {error}.") from error
    return path


def _render_image(figure: Figure) -> NDArray[np.uint8]:
    """A Figure as (height, width, 3) bytes."""
    figure.canvas.draw()
    renderer: Any = get_renderer(figure)  # without types
    return np.asarray(renderer.buffer_rgba())[..., :3].copy()


def _write_gif(path: Path, images: Iterable[NDArray[np.uint8]], rate: float) -> None:
    # each frame has its own 256 colours: dithering would flicker and not compress
    paletted = [Image.fromarray(i).quantize(256, dither=Image.Dither.NONE) for i in images]
    duration = [round(1000.0 / rate)] * (len(paletted) - 1) + [round(1000.0 * LAST)]
    paletted[0].save(
        path,
        save_all=True,
        append_images=paletted[1:],
        duration=duration,
        loop=0,
        optimize=True,
        comment=MARK.encode(),
    )


def _write_mp4(path: Path, images: Iterable[NDArray[np.uint8]], rate: float) -> None:
    program, process = _find_ffmpeg(), None
    for image in images:
        if process is None:
            height, width = image.shape[:2]
            # H.264 wants even numbers of pixels
            even = "pad=ceil(iw/2)*2:ceil(ih/2)*2:color=white"
            read = f"-f rawvideo -pix_fmt rgb24 -s {width}x{height} -r {rate:g} -i -"
            write = f"-vf {even} -c:v libx264 -crf 18 -pix_fmt yuv420p -metadata"
            command = [program, "-y", "-loglevel", "error", *read.split(), *write.split()]
            command += [f"comment={MARK}", str(path)]
            process = subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.PIPE)
        try:
            cast("IO[bytes]", process.stdin).write(image.tobytes())
        except BrokenPipeError:  # it says why below
            break
    if process is None:
        raise DustError(f"There are no pictures for {path}.")
    _, problem = process.communicate()
    if process.returncode:
        text = problem.decode(errors="replace").strip()
        raise DustError(f"ffmpeg could not write {path}: {text}. Try a .gif.")


def _find_ffmpeg() -> str:
    """Path of ffmpeg: the system's, or that of the package imageio-ffmpeg."""
    program = shutil.which("ffmpeg")
    if program:
        return program
    try:
        import imageio_ffmpeg

        return str(imageio_ffmpeg.get_ffmpeg_exe())
    except (ImportError, RuntimeError):
        raise DustError(
            "ffmpeg is not installed, and only .mp4 needs it; allowed: .gif. To get it: "
            "pip install 'dusttaichi[export]'"
        ) from None
