"""What notebooks show: a page of its own that a kernel moves, and pages of what has been run."""

import html
import json
from typing import Any

import attrs
import numpy as np
import pytest

import armwright as aw
from armwright.cell.model import Cell, CellArm
from armwright.errors import InvalidValueError, KindError, MissingExtraError, ShapeError
from armwright.program.api import run
from armwright.program.language.source import Source


@pytest.fixture(scope="module")
def arm() -> aw.Arm:
    return aw.load_arm("puma560")


class Kernel:
    """A widget, with what it sends kept instead of sent."""

    def __init__(self, widget: Any) -> None:
        self.widget, self.sent = widget, list[dict[str, Any]]()
        widget.send = lambda text: self.sent.append(json.loads(text))

    def receive(self, **message: Any) -> dict[str, Any]:
        """Give it a message of its page; return its answer."""
        text = message["text"] if "text" in message else json.dumps(message)
        self.widget._handle_custom_msg(text, [])
        return self.sent[-1]


def test_an_arm_is_moved(arm: aw.Arm) -> None:
    """The page asks, the kernel moves the arm; the page is complete in itself, and may load nothing."""
    pytest.importorskip("anywidget")
    q = np.array([0.1, -0.5, 0.6, 0.2, 0.3, 0.4])
    kernel = Kernel(aw.show(arm, q=q))
    state = kernel.receive(text="hello")
    np.testing.assert_allclose(state["arms"]["ARM_1"]["q"], q, atol=1e-6)
    state = kernel.receive(do="joint", arm="ARM_1", joint=1, value=0.7)
    assert state["arms"]["ARM_1"]["q"][0] == pytest.approx(0.7)
    assert kernel.widget.studio.workbench.arms["ARM_1"].q[0] == pytest.approx(0.7)
    assert "default-src 'none'" in html.unescape(kernel.widget.page)
    assert "http" not in kernel.widget.page.replace("http-equiv", "").replace("http://www.w3.org", "").replace(
        "ws://${location.host}", ""
    )


def test_without_anywidget(arm: aw.Arm, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without the extra it is told in one line."""
    monkeypatch.setitem(__import__("sys").modules, "anywidget", None)
    with pytest.raises(MissingExtraError, match=r"armwright\[notebook\]"):
        aw.show(arm)


def test_what_is_played(arm: aw.Arm) -> None:
    """A run, a move and a trajectory are pages in a frame that may load nothing."""
    start, end = np.zeros(6), np.full(6, 0.3)
    trajectory = aw.motion.quintic(start, end, 2.0)
    move = aw.motion.joint_move(arm, [aw.kinematics.forward(arm, q) for q in (start + 0.2, end)])
    cell = Cell(name="bench", arms={"ARM_1": CellArm(arm=attrs.evolve(arm, name="one"), start=end)})
    recording = run(Source("p.rlo", "BEGIN MOVE ARM_1 TO ARM_1 * XYZ(0, 0, -0.05) END.\n"), cell)
    for shown in (aw.show(recording), aw.show(move), aw.show(trajectory, arm=arm)):
        frame = shown._repr_html_()
        assert frame.startswith('<iframe sandbox="allow-scripts"')
        assert html.escape("<!DOCTYPE html>") in frame


def test_wrong_things() -> None:
    """What cannot be shown is refused, with what can."""
    trajectory = aw.motion.quintic(np.zeros(6), np.ones(6), 2.0)
    with pytest.raises(KindError, match="of an arm"):
        aw.show(trajectory)
    with pytest.raises(KindError, match="expected an arm, a cell"):
        aw.show("puma560")  # type: ignore[arg-type]
    with pytest.raises(InvalidValueError, match="degrees are meant"):
        aw.show(aw.load_arm("ur5"), q=[0, -90, 90, -90, -90, 0])
    with pytest.raises(ShapeError, match="3 joints, got 6"):
        aw.show(trajectory, arm=aw.load_arm("ntu-3r"))
