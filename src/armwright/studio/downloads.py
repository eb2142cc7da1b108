"""What a page can keep of a run: its page, a 3-D file of the motion, a film."""

from __future__ import annotations

import base64
from typing import Literal, NamedTuple, TypeAlias

import numpy as np

from armwright.arrays import Array
from armwright.errors import ArmwrightError
from armwright.program.vm.recording import Recording
from armwright.report.gltf_motion import gltf_motion
from armwright.report.movie import render_films
from armwright.report.page import run_page
from armwright.report.run_data import run_page_data

Kind: TypeAlias = Literal["page", "gltf", "gif"]


class DownloadError(ArmwrightError, ValueError):
    """There is nothing to keep."""


class _Played:
    """The motion of an arm in a run, as a film needs it."""

    def __init__(self, t: Array, q: Array) -> None:
        self._t, self._q, self.duration = t, q, float(t[-1])

    def __call__(self, t: Array) -> Array:
        return np.asarray(self._q[np.clip(np.searchsorted(self._t, t), 0, len(self._t) - 1)])


class Download(NamedTuple):
    """A file for the browser to keep.

    Attributes:
        name: of the file.
        type: its media type.
        content: of the file.
    """

    name: str
    type: str
    content: bytes

    def message(self) -> dict[str, dict[str, str]]:
        """Return the message that brings it to a page."""
        data = base64.b64encode(self.content).decode()
        return {"download": {"name": self.name, "type": self.type, "data": data}}


def download(recording: Recording, kind: Kind, arm: str) -> Download:
    """Return a file of a run.

    Args:
        recording: of the run.
        kind: ``page``, the page of results; ``gltf``, a 3-D file that moves; ``gif``, a film of one arm.
        arm: the arm of the film.

    Raises:
        DownloadError: no time has gone by in the run.
    """
    if recording.duration <= 0:
        raise DownloadError("nothing has moved yet that could be kept")
    if kind == "gif":
        stream = next(stream for stream in recording.streams if stream.arm == arm)
        model = recording.cell.arms[arm].arm
        films = render_films(model, _Played(stream.t, stream.q), np.empty((0, 4, 4)))  # type: ignore[arg-type]
        return Download("motion.gif", "image/gif", films["move.gif"])
    data = run_page_data(recording, (), "armwright studio")
    if kind == "page":
        return Download("report.html", "text/html", run_page(data).encode())
    assert data.animation is not None  # noqa: S101 - a run has one
    return Download("motion.glb", "model/gltf-binary", gltf_motion(data.animation))
