"""MOVE CIRCULARLY: an arc through a frame to the goal, by the tool or by what it carries."""

import numpy as np
import pytest

from armwright.arrays import Array
from armwright.kinematics import forward
from armwright.program import Source
from armwright.program.formatter.format import formatted
from armwright.program.language.position_codec import PositionCodec
from armwright.program.language_server.analysis import Settings, analyse
from armwright.program.language_server.cell_lookup import CellCache
from armwright.program.language_server.completions import completions
from armwright.program.language_server.hover import hover
from armwright.program.vm.recording import Recording
from program.running import failure, run

FRAMES = """VAR f, g, h, part : FRAME ; BEGIN
 f = (1,0,0, 0,-1,0, 0,0,-1, 0.40,-0.15,0.20) ;
 g = (1,0,0, 0,-1,0, 0,0,-1, 0.50, 0.00,0.20) ;
 h = (1,0,0, 0,-1,0, 0,0,-1, 0.40, 0.15,0.20) ;
 MOVE ARM_1 TO f ;
"""
# The circle through the three positions above: 0.1 m are the height of its segment, 0.3 m its chord.
RADIUS = (0.15**2 + 0.1**2) / (2 * 0.1)
CENTRE = np.array([0.5 - RADIUS, 0.0, 0.2])


def tool(recording: Recording, number: int = -1) -> Array:
    """The poses of the tool on a stage."""
    stage, placed = recording.stages[number], recording.cell.arms["ARM_1"]
    return placed.base @ forward(placed.arm, stage.motion(np.linspace(0.0, stage.motion.duration, 400)))


def test_arc_of_an_arm() -> None:
    """The tool goes on the circle, through the frame, and turns evenly on the way."""
    recording = run(FRAMES + "MOVE ARM_1 TO h * ROTZ(40) CIRCULARLY, VIA (g * ROTZ(90)) ; END.")
    X = tool(recording)
    stage = recording.stages[-1].stage

    distances = np.linalg.norm(X[:, :3, 3] - CENTRE, axis=1)
    assert stage.deviation is not None
    assert np.abs(distances - RADIUS).max() <= stage.deviation <= recording.cell.deviation
    assert np.ptp(X[:, 2, 3]) <= 2 * stage.deviation
    assert np.linalg.norm(X[:, :3, 3] - (0.5, 0.0, 0.2), axis=1).min() < 2e-3
    angle = np.arctan2(X[:, 1, 3], X[:, 0, 3] - CENTRE[0])
    along = (angle - angle[0]) / (angle[-1] - angle[0])
    turned = np.degrees(np.arctan2(-X[:, 1, 0], X[:, 0, 0]))
    np.testing.assert_allclose(turned, 40 * along, atol=0.3)
    assert [line.split(": ")[1] for line in recording.trace()] == ["PTP f @100", "ARC g * ROTZ(90) h * ROTZ(40) @100"]


def test_the_other_way_round() -> None:
    """The frame says which of the two arcs it is; more than half a circle too."""
    recording = run(FRAMES + "MOVE ARM_1 TO f * XYZ(0, -0.02, 0) CIRCULARLY, VIA (f * XYZ(-0.06, -0.01, 0)) ; END.")
    p = tool(recording)[:, :3, 3]

    assert p[:, 0].min() < 0.345
    assert recording.stages[-1].stage.length > 1.5 * np.pi * 0.0308


def test_a_part_on_an_arc() -> None:
    """A frame that hangs on the arm comes to the goal too."""
    text = """AFFIX part TO ARM_1 AT XYZ(0, 0, 0.05) ;
    MOVE part TO h * XYZ(0, 0, 0.05) CIRCULARLY, VIA (g * XYZ(0, 0, 0.05)), WITH DURATION = 4 ; END."""
    recording = run(FRAMES + text)

    assert np.abs(np.linalg.norm(tool(recording)[:, :3, 3] - CENTRE, axis=1) - RADIUS).max() < 1e-3
    assert recording.stages[-1].motion.duration == pytest.approx(4, abs=2e-3)


def test_guard_on_an_arc() -> None:
    """A guard ends the motion on the arc."""
    recording = run(FRAMES + "MOVE ARM_1 TO h CIRCULARLY, VIA (g), ON X(ARM_1) > 0.45 DO HALT ; END.")
    p = recording.tree.world("ARM_1")[:3, 3]

    assert abs(np.linalg.norm(p - CENTRE) - RADIUS) < 1e-3
    assert p[1] < 0


@pytest.mark.parametrize(
    ("motion", "code", "says"),
    [
        ("MOVE ARM_1 TO h CIRCULARLY, VIA (f * XYZ(0, -0.1, 0.00001)) ;", "E407", "on one line"),
        ("MOVE ARM_1 TO h CIRCULARLY, VIA (f) ;", "E407", "on one line"),
        ("MOVE ARM_1 TO h * XYZ(3, 0, 0) CIRCULARLY, VIA (g) ;", "E402", "cannot be reached"),
        ("MOVE ARM_1 TO h CIRCULARLY, VIA (g * XYZ(1.5, 0, 0)) ;", "E402", "leads joint 3"),
    ],
)
def test_what_cannot_be_done(motion: str, code: str, says: str) -> None:
    """An arc through positions on a line, or out of reach, is refused before it begins, and can be recovered."""
    error = failure(f"{FRAMES} {motion} END.")

    assert error.diagnostic.code == code
    assert says in error.diagnostic.message
    assert run(f"{FRAMES} TRY {motion} RECOVER (MOTION) MOVE ARM_1 TO h END ; END.").failure is None


def test_tools() -> None:
    """The word is offered where no other way is told, explained where it stands, and written in upper case."""
    before = "VAR f, g : FRAME ; BEGIN f = ARM_1 ; g = f ; MOVE ARM_1 TO f circularly, VIA (g)"
    text = f"{before} ; END."
    analysis = analyse("t.rlo", PositionCodec(text), None, CellCache(), Settings(cell=None))

    shown = hover(analysis, text.index("circularly"), markdown=False)
    assert shown is not None
    assert "arc of a circle" in str(shown.contents)
    assert "CIRCULARLY, VIA (g)" in formatted(Source("t.rlo", text))
    for written, is_offered in (("MOVE ARM_1 TO f ", True), ("MOVE ARM_1 TO f STRAIGHTLY, ", False)):
        begun = text[: text.index("MOVE")] + written
        labels = [item.label for item in completions(PositionCodec(begun), analysis, len(begun), snippets=False)]
        assert ("CIRCULARLY" in labels) is is_offered
