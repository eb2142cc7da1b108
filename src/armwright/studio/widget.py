"""The page of a studio in a notebook: in a frame of its own, without a server, moved by the kernel of the notebook."""

from __future__ import annotations

import asyncio
import contextlib
import html
import json
import time
from typing import Any

from armwright.arm.model import Arm
from armwright.arm.positions import degrees_by_mistake
from armwright.arrays import ArrayLike, joint_array
from armwright.cell.model import Cell, CellArm
from armwright.errors import InvalidValueError, KindError, shown
from armwright.extras import import_extra
from armwright.kinematics.inverse_kinematics.revolutions import mid_range
from armwright.kinematics.inverse_kinematics.solution import violations
from armwright.motion.moves import Move
from armwright.motion.trajectory import Trajectory
from armwright.program.vm.recording import Recording
from armwright.report.motion_page import along_trajectory, motion_page
from armwright.report.page import run_page
from armwright.report.run_data import run_page_data
from armwright.studio.page import studio_page
from armwright.studio.project import Project
from armwright.studio.studio import Studio
from armwright.studio.workbench import Workbench

# What the frame may do: its own style and script, and no address at all.
_POLICY = "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data: blob:"
_HEIGHT = 620
_TICK = 1 / 30
# After a longer pause of the kernel it does not leap [s].
_LONGEST_TICK = 0.1
# The only page of a widget.
_PAGE = 1
_SCRIPT = """
export default {
  render({ model, el }) {
    const frame = document.createElement("iframe");
    frame.sandbox = "allow-scripts allow-forms allow-downloads";
    frame.style = `width:100%;height:${model.get("height")}px;border:0`;
    frame.srcdoc = model.get("page");
    const listen = (event) => {
      if (event.source === frame.contentWindow) model.send(event.data);
    };
    const push = (message) => frame.contentWindow?.postMessage(message, "*");
    window.addEventListener("message", listen);
    model.on("msg:custom", push);
    el.append(frame);
    return () => {
      window.removeEventListener("message", listen);
      model.off("msg:custom", push);
    };
  },
};
"""


class PageFrame:
    """A page that a notebook shows as it is."""

    def __init__(self, page: str) -> None:
        """Take a page."""
        self.page = page

    def _repr_html_(self) -> str:
        """Show the page in a frame that may use no address."""
        content = html.escape(self.page, quote=True)
        style = f"width:100%;height:{_HEIGHT}px;border:0"
        return f'<iframe sandbox="allow-scripts" style="{style}" srcdoc="{content}"></iframe>'


def show(
    thing: Arm | Cell | Recording | Move | Trajectory, *, q: ArrayLike | None = None, arm: Arm | None = None
) -> Any:
    """Return what a notebook shows of a thing.

    Arms and cells are moved by hand; recordings, moves and trajectories are played.

    Args:
        thing: an arm, a cell, the recording of a run, a move, or a trajectory of joints.
        q: (n,) joint positions of an arm; the middle of its limits when left out.
        arm: whose joints a trajectory is of.

    Raises:
        KindError: it is something else, or a trajectory of no arm.
        InvalidValueError: joint positions are beyond the limits of the arm.
        MissingExtraError: anywidget is not installed.
    """
    if isinstance(thing, Recording):
        return PageFrame(run_page(run_page_data(thing, (), "")))
    if isinstance(thing, Move):
        return PageFrame(run_page(motion_page(thing)))
    if isinstance(thing, Trajectory):
        if arm is None:
            raise KindError("a trajectory is shown of an arm: show(trajectory, arm=arm)")
        return PageFrame(run_page(motion_page(along_trajectory(arm, thing))))
    if isinstance(thing, Arm):
        start = mid_range(thing) if q is None else joint_array(q, thing.n)
        if mistake := degrees_by_mistake(thing, start):
            raise InvalidValueError(f"q: {mistake}")
        for fault in violations(thing, start):
            raise InvalidValueError(f"q: {fault}")
        return live_widget(Cell(name=thing.name, arms={"ARM_1": CellArm(arm=thing, start=start)}))
    if isinstance(thing, Cell):
        return live_widget(thing)
    raise KindError(f"expected an arm, a cell, a recording, a move or a trajectory, got {shown(thing)}")


def live_widget(cell: Cell) -> Any:
    """Return a widget with the page of a studio, without files.

    Raises:
        MissingExtraError: anywidget is not installed.
    """
    anywidget = import_extra("anywidget", "a live view in a notebook", "notebook")
    traitlets = import_extra("traitlets", "a live view in a notebook", "notebook")
    studio = Studio(Project(Workbench(cell)))
    studio.workbench.warm_up()
    studio.page_opened(_PAGE)

    class StudioWidget(anywidget.AnyWidget):  # type: ignore[misc, name-defined] # of the extra
        """The page, and what it shows."""

        _esm = _SCRIPT
        page = traitlets.Unicode(studio_page(studio.workbench, "", _POLICY)).tag(sync=True)
        height = traitlets.Int(_HEIGHT).tag(sync=True)

    widget = StudioWidget()
    widget.studio = studio
    widget.on_msg(_Connection(studio, widget).receive)
    return widget


class _Connection:
    """Does for the page of a widget what a server does for the pages of a browser."""

    def __init__(self, studio: Studio, widget: Any) -> None:
        self._studio, self._widget = studio, widget
        self._ticking: asyncio.Task[None] | None = None

    def receive(self, _: object, content: object, __: object) -> None:
        """Do what the page asks for."""
        if not isinstance(content, str):
            return
        studio = self._studio
        if content == "hello":
            # Another view of the widget, or the same one again: it has nothing yet.
            studio.page_closed(_PAGE)
            studio.page_opened(_PAGE)
            self._push()
        elif studio.receive(content, _PAGE, time.monotonic()):
            self._push()
        self._answer()
        if studio.moves and (self._ticking is None or self._ticking.done()):
            # Without a loop, as in a script, nothing moves by itself.
            with contextlib.suppress(RuntimeError):
                self._ticking = asyncio.get_running_loop().create_task(self._tick())

    def _push(self) -> None:
        self._widget.send(json.dumps(self._studio.state(_PAGE), separators=(",", ":"), allow_nan=False))

    def _answer(self) -> None:
        for _, job in self._studio.take_jobs():
            made = job()
            if made is None:
                self._push()
            else:
                self._widget.send(json.dumps(made))

    async def _tick(self) -> None:
        before = time.monotonic()
        while self._studio.moves:
            await asyncio.sleep(_TICK)
            now = time.monotonic()
            if self._studio.tick(now, min(now - before, _LONGEST_TICK)):
                self._push()
            before = now
