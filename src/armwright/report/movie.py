"""A move as a film: the stick figure of the arm and the path of its tool, as GIF or MP4."""

import shutil
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.kinematics.forward_kinematics import link_poses
from armwright.motion.trajectory import Trajectory
from armwright.report.figures import set_equal_scales
from armwright.report.stick_figure import skeleton_points

if TYPE_CHECKING:
    from matplotlib.animation import AbstractMovieWriter
    from matplotlib.figure import Figure

# Images per second, and images at most; a longer move is shown faster.
_FPS, _MAX_FRAMES = 20, 90
_SIZE, _DPI = (4.8, 4.4), 100
# Length of the approach vector relative to half the scene.
_APPROACH = 0.25


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
    from matplotlib.animation import FFMpegWriter, PillowWriter  # noqa: PLC0415

    count = int(np.clip(np.ceil(trajectory.duration * _FPS), 24, _MAX_FRAMES))
    t = np.linspace(0, trajectory.duration, count)
    X = link_poses(arm, trajectory(t))
    writers: dict[str, AbstractMovieWriter] = {"move.gif": PillowWriter(fps=_FPS)}
    if shutil.which("ffmpeg"):
        writers["move.mp4"] = FFMpegWriter(fps=_FPS)
    figure, show = _prepare_figure(t, skeleton_points(arm, X), X[:, -1], poses)
    with tempfile.TemporaryDirectory() as folder:
        for name, writer in writers.items():
            writer.setup(figure, str(Path(folder) / name), dpi=_DPI)
        for i in range(count):
            show(i)
            for writer in writers.values():
                writer.grab_frame()
            if progress is not None:
                progress(i + 1, count)
        for writer in writers.values():
            writer.finish()
        return {name: (Path(folder) / name).read_bytes() for name in writers}


def _prepare_figure(t: Array, points: Array, tool_poses: Array, poses: Array) -> "tuple[Figure, Callable[[int], None]]":
    """Return a figure with the arm, and a function that sets it to any of m instants.

    Args:
        t: (m,) instants [s].
        points: (m, k, 3) the corners of the arm [m].
        tool_poses: (m, 4, 4) poses of the tool.
        poses: (k, 4, 4) poses to mark.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg  # noqa: PLC0415
    from matplotlib.figure import Figure  # noqa: PLC0415

    figure = Figure(figsize=_SIZE)
    FigureCanvasAgg(figure)
    axis: Any = figure.add_axes((0, 0, 1, 1), projection="3d")
    cm = points * 100
    low, high = cm.min(axis=(0, 1)), cm.max(axis=(0, 1))
    half = set_equal_scales(axis, low, high)
    axis.tick_params(labelsize=7)
    axis.plot(*(poses[:, :3, 3] * 100).T, "o", color="C3", markersize=5)
    (trail,) = axis.plot([], [], [], color="C1", linewidth=1.6)
    (arm,) = axis.plot([], [], [], "-o", color="C0", linewidth=4.5, markersize=4, solid_capstyle="round")
    (approach,) = axis.plot([], [], [], color="C2", linewidth=2.5)
    clock = axis.text2D(0.03, 0.94, "", transform=axis.transAxes)
    tips = cm[:, -1] + tool_poses[:, :3, 2] * _APPROACH * half

    def show(i: int) -> None:
        arm.set_data_3d(*cm[i].T)
        trail.set_data_3d(*cm[: i + 1, -1].T)
        approach.set_data_3d(*np.stack([cm[i, -1], tips[i]], axis=1))
        clock.set_text(f"{t[i]:.2f} s")

    return figure, show
