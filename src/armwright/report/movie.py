"""A motion as a film: the bodies of its view, and the paths of the tools, as GIF or MP4."""

from __future__ import annotations

import io
import shutil
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import attrs
import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.motion.trajectory import Trajectory
from armwright.report.animation import Animation, ArmFigure
from armwright.report.arm_figure import Placed, arm_figure
from armwright.report.film_view import FilmView
from armwright.report.shape_table import ShapeTable

# Images per second, and images at least and at most; a longer move is shown faster.
_FPS, _FEWEST_FRAMES, _MAX_FRAMES = 20, 24, 90
_SIZE, _DPI = (4.8, 4.4), 100
# Colours of a GIF, and from how many of its images they are chosen.
_COLOURS, _OF_PALETTE = 255, 8


def render_films(
    arm: Arm, trajectory: Trajectory, poses: Array, progress: Callable[[int, int], None] | None = None
) -> dict[str, bytes]:
    """Return films of a move by the name of their file: a GIF, and an MP4 where ffmpeg is installed.

    Args:
        arm: the arm.
        trajectory: of its joints.
        poses: (k, 4, 4) poses to mark.
        progress: called with the number of finished images and the number of all.
    """
    t, shapes = film_times(trajectory.duration), ShapeTable()
    figure = arm_figure("ARM", Placed(arm), trajectory(t), None, shapes)
    animation = Animation(fps=_FPS, t=t, arms={"ARM": figure}, shapes=shapes.as_data())
    with tempfile.TemporaryDirectory() as folder:
        video = Path(folder) / "move.mp4" if shutil.which("ffmpeg") else None
        films = {"move.gif": _gif(_images(animation, poses[:, :3, 3], progress, video))}
        return films if video is None else {**films, video.name: video.read_bytes()}


def render_gif(animation: Animation, progress: Callable[[int, int], None]) -> bytes:
    """Return the GIF of a view in motion.

    Args:
        animation: of the view.
        progress: called with the number of finished images and the number of all; what it raises ends the work.
    """
    t = film_times(float(animation.t[-1]))
    rows = np.abs(animation.t[:, None] - t).argmin(axis=0)
    arms = {name: _at(figure, rows) for name, figure in animation.arms.items()}
    return _gif(_images(attrs.evolve(animation, t=animation.t[rows], arms=arms), np.empty((0, 3)), progress))


def film_times(duration: float) -> Array:
    """Return the instants of the images of a film [s]."""
    return np.linspace(0.0, duration, int(np.clip(np.ceil(duration * _FPS), _FEWEST_FRAMES, _MAX_FRAMES)))


def _at(figure: ArmFigure, rows: Array) -> ArmFigure:
    return attrs.evolve(figure, q=figure.q[rows], grip=None if figure.grip is None else figure.grip[rows], planned=None)


def _images(
    animation: Animation, marks: Array, progress: Callable[[int, int], None] | None, video: Path | None = None
) -> list[Any]:
    """Return the images of a film, and write them into an MP4 file too where one is named."""
    from matplotlib.animation import FFMpegWriter  # noqa: PLC0415
    from matplotlib.backends.backend_agg import FigureCanvasAgg  # noqa: PLC0415 - takes half a second
    from matplotlib.figure import Figure  # noqa: PLC0415
    from PIL import Image  # noqa: PLC0415

    figure = Figure(figsize=_SIZE, dpi=_DPI)
    canvas: Any = FigureCanvasAgg(figure)
    axes = figure.add_axes((0, 0, 1, 1))
    size = canvas.get_width_height()
    view = FilmView(animation, axes, size, marks)
    clock = axes.text(0.03, 0.94, "", transform=axes.transAxes, color="#1b2430")
    writer = FFMpegWriter(fps=_FPS)
    if video is not None:
        writer.setup(figure, str(video), dpi=_DPI)
    images = []
    for i, t in enumerate(animation.t.tolist()):
        view.show(i)
        clock.set_text(f"{t:.2f} s")
        canvas.draw()
        images.append(Image.frombuffer("RGBA", size, canvas.buffer_rgba(), "raw", "RGBA", 0, 1).convert("RGB"))
        if video is not None:
            writer.grab_frame()
        if progress is not None:
            progress(i + 1, len(animation.t))
    if video is not None:
        writer.finish()
    return images


def _gif(images: list[Any]) -> bytes:
    from PIL import Image  # noqa: PLC0415 - with matplotlib

    # One palette for all, so that nothing flickers: of some images, below one another.
    some = images[:: -(-len(images) // _OF_PALETTE)]
    width, height = images[0].size
    strip = Image.new("RGB", (width, height * len(some)))
    for i, image in enumerate(some):
        strip.paste(image, (0, height * i))
    palette = strip.quantize(_COLOURS)
    frames = [image.quantize(palette=palette, dither=Image.Dither.NONE) for image in images]
    content = io.BytesIO()
    frames[0].save(content, "GIF", save_all=True, append_images=frames[1:], duration=1000 // _FPS, loop=0)
    return content.getvalue()
