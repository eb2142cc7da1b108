"""What a page can keep of a run: its page, a 3-D file of the motion, a film."""

from __future__ import annotations

import base64
from collections.abc import Callable
from typing import Literal, NamedTuple, TypeAlias

from armwright.errors import ArmwrightError
from armwright.program.vm.recording import Recording
from armwright.report.gltf_motion import gltf_motion
from armwright.report.movie import render_gif
from armwright.report.page import run_page
from armwright.report.run_data import run_page_data

Kind: TypeAlias = Literal["page", "gltf", "gif"]


class DownloadError(ArmwrightError, ValueError):
    """There is nothing to keep."""


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


def download(recording: Recording, kind: Kind, has_ended: Callable[[], bool]) -> Download:
    """Return a file of a run.

    Args:
        recording: of the run.
        kind: ``page``, the page of results; ``gltf``, a 3-D file that moves; ``gif``, a film.
        has_ended: asked again and again while a film is drawn, whether anybody still waits for it.

    Raises:
        DownloadError: no time has gone by in the run, or nobody waits any longer.
    """
    if recording.duration <= 0:
        raise DownloadError("nothing has moved yet that could be kept")

    def go_on(_done: int, _all: int) -> None:
        if has_ended():
            raise DownloadError("the studio has ended")

    data = run_page_data(recording, (), "armwright studio")
    if kind == "page":
        return Download("report.html", "text/html", run_page(data).encode())
    assert data.animation is not None  # noqa: S101 - a run has one
    if kind == "gif":
        return Download("motion.gif", "image/gif", render_gif(data.animation, go_on))
    return Download("motion.glb", "model/gltf-binary", gltf_motion(data.animation))
