"""Limits of the tool in programs: VELOCITY, ROTATION and ACCELERATION of a MOVE."""

import numpy as np
import pytest

from armwright.arrays import Array
from armwright.kinematics import forward, jacobian
from armwright.program import Source
from armwright.program.formatter.format import formatted
from armwright.program.language.position_codec import PositionCodec
from armwright.program.language_server.analysis import Settings, analyse
from armwright.program.language_server.cell_lookup import CellCache
from armwright.program.language_server.completions import completions
from armwright.program.language_server.hover import hover
from armwright.program.vm.interpreter import motion_warnings
from armwright.program.vm.recording import Recording, RunStage
from program.running import cell_of, failure, run

FRAMES = """UNITS MM ; VAR f, g, h : FRAME ; n : SCALAR ; BEGIN
 n = -1 ;
 f = (1,0,0, 0,-1,0, 0,0,-1, 400,-150,200) ;
 g = (1,0,0, 0,-1,0, 0,0,-1, 480,   0,200) ;
 h = (1,0,0, 0,-1,0, 0,0,-1, 400, 150,200) * ROTZ(60) ;
 MOVE ARM_1 TO f ;
"""


def ran(motion: str) -> Recording:
    return run(f"{FRAMES} {motion} END.")


def tool_speeds(recording: Recording, stage: RunStage) -> tuple[Array, Array]:
    """Speed [m/s] and turning [rad/s] of the tool along a stage, by the Jacobian."""
    arm = recording.cell.arms[stage.arm].arm
    t = np.linspace(0.0, stage.motion.duration, 3000)
    v = (jacobian(arm, stage.motion(t)) @ stage.motion(t, 1)[..., None])[..., 0]
    return np.linalg.norm(v[:, :3], axis=1), np.linalg.norm(v[:, 3:], axis=1)


def test_units_of_the_program() -> None:
    """Lengths and angles per second count in the units of the program, or in their own."""
    recording = ran("""MOVE ARM_1 TO h STRAIGHTLY, WITH VELOCITY = 60, WITH ROTATION = 0.2rad ;
    MOVE ARM_1 TO f STRAIGHTLY, WITH ROTATION = 6, WITH VELOCITY = 0.1m ;""")
    _, there, back = recording.stages
    speed, turning = tool_speeds(recording, there)

    assert 0.059 < speed.max() <= 0.06 or 0.198 < turning.max() <= 0.2
    assert speed.max() <= 0.06
    assert turning.max() <= 0.2
    speed, turning = tool_speeds(recording, back)
    assert np.radians(5.9) < turning.max() <= np.radians(6)
    assert motion_warnings(recording.stages, recording.cell) == ()


@pytest.mark.parametrize("way", ["DIRECTLY", "STRAIGHTLY", "CIRCULARLY, VIA (g)", "VIA (g)", "WITH APPROACH = g"])
def test_every_kind_of_stage(way: str) -> None:
    """All stages of a MOVE keep the speed, and reach it."""
    recording = ran(f"MOVE ARM_1 TO h {way}, WITH VELOCITY = 40, WITH ACCELERATION = 200 ;")

    for stage in recording.stages[1:]:
        speed, _ = tool_speeds(recording, stage)
        assert 0.0395 < speed.max() <= 0.04
    assert "@40 mm/s" in recording.trace()[-1]


def test_with_a_duration() -> None:
    """A DURATION that is too short for the limits of the tool is refused, a longer one is kept."""
    recording = ran("MOVE ARM_1 TO h STRAIGHTLY, WITH DURATION = 8, WITH ACCELERATION = 100 ;")

    assert recording.stages[-1].motion.duration == pytest.approx(8, abs=2e-3)
    error = failure(f"{FRAMES} MOVE ARM_1 TO h STRAIGHTLY, WITH DURATION = 4, WITH ACCELERATION = 20 ; END.")
    assert error.diagnostic.code == "E405"


def test_a_value_out_of_range() -> None:
    """A limit that is not above 0 is an error of the run where it is computed."""
    error = failure(f"{FRAMES} MOVE ARM_1 TO h WITH VELOCITY = n ; END.")

    assert error.diagnostic.code == "E231"
    assert "velocity" in error.diagnostic.message


def test_a_speed_beyond_the_limits() -> None:
    """A speed that the arm does not reach is told, with the limit."""
    recording = ran("MOVE ARM_1 TO h WITH VELOCITY = 20000 ;")
    (warning,) = motion_warnings(recording.stages, recording.cell)
    speed, _ = tool_speeds(recording, recording.stages[-1])

    assert warning.code == "W405"
    told = float(warning.message.rpartition("reaches ")[2].removesuffix(" mm/s"))
    assert told == pytest.approx(speed.max() * 1e3, rel=1e-3)
    assert "speed limit of joint" in warning.notes[0]


def test_a_part_is_moved() -> None:
    """The limits are those of the tool point, also where a part moves with it."""
    cell = cell_of("cell1")
    recording = run(
        f"{FRAMES} AFFIX g TO ARM_1 AT XYZ(0, 0, 50) ; MOVE g TO h STRAIGHTLY, WITH VELOCITY = 50 ; END.", cell
    )
    speed, _ = tool_speeds(recording, recording.stages[-1])

    assert 0.049 < speed.max() <= 0.05
    X = recording.cell.arms["ARM_1"].base @ forward(cell.arms["ARM_1"].arm, recording.configurations["ARM_1"])
    np.testing.assert_allclose(X, recording.tree.world("ARM_1"), atol=1e-9)


def test_tools() -> None:
    """The words are offered behind WITH, but VELOCITY not beside SPEED; explained; and written in upper case."""
    text = "VAR f : FRAME ; BEGIN f = ARM_1 ; MOVE ARM_1 TO f with velocity = 0.1, with rotation = 5 ; END."
    analysis = analyse("t.rlo", PositionCodec(text), None, CellCache(), Settings(cell=None))

    shown = hover(analysis, text.index("velocity"), markdown=False)
    assert shown is not None
    assert "per second" in str(shown.contents)
    assert "WITH VELOCITY = 0.1, WITH ROTATION = 5" in formatted(Source("t.rlo", text))
    for written, words in (("WITH ", {"VELOCITY", "ROTATION"}), ("WITH SPEED = 5, WITH ", {"ROTATION"})):
        begun = f"{text[: text.index('with')]}{written}"
        labels = {item.label for item in completions(PositionCodec(begun), analysis, len(begun), snippets=False)}
        assert words <= labels
        assert ("VELOCITY" in labels) is ("VELOCITY" in words)
