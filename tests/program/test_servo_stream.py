"""The servo stream of arms that are stopped on their way, by differences from tick to tick."""

import numpy as np
import pytest

from armwright.cell.simulator import Simulator
from armwright.program.running.interpret import Machine, RunError
from armwright.program.running.interpret import run as go
from armwright.program.running.recording import Recording, motion_rows
from program.running import cell_of, code_of, corpus_text

# What a limit may be exceeded by.
AT_MOST = 1.001
HEAD = "VAR f, g : FRAME ; n : SCALAR ; BEGIN f = (1,0,0, 0,-1,0, 0,0,-1, 0.45,0,0.01) ; g = f * XYZ(0, 0.2, -0.1) ; "
PROGRAMS = {
    "peg": corpus_text("p07"),
    "too deep": HEAD + "MOVE ARM_1 TO f STRAIGHTLY, WITH SPEED = 100, ON FORCE(Z) > 8 DO HALT END.",
    "halted": HEAD + "MOVE ARM_1 TO g WITH SPEED = 120, ON DIST(ARM_1, g) < 0.1 DO HALT END.",
    "failing": HEAD + "n = 0 ; MOVE ARM_1 TO g WITH SPEED = 120, ON DIST(ARM_1, g) < 0.1 DO n = 1 / n END.",
}


def recorded(text: str) -> tuple[Recording, RunError | None]:
    """Run a program above a plane to its end or to its failure."""
    cell = cell_of("jam")
    machine = Machine(code_of(text, cell), cell, Simulator(cell))
    try:
        go(machine)
    except RunError as error:
        return machine.recording(), error
    return machine.recording(), None


@pytest.mark.parametrize("name", PROGRAMS)
def test_a_stopped_arm_keeps_its_limits(name: str) -> None:
    """At contact, at HALT and after an error no joint passes its limits from tick to tick, and all come to rest."""
    recording, _ = recorded(PROGRAMS[name])
    table = np.array([[float(x) for x in row.split(",")[2:]] for row in list(motion_rows(recording.streams))[1:]])
    arm, period = recording.cell.arms["ARM_1"].arm, recording.cell.period
    q, qd, qdd = (table[:, i * arm.n : (i + 1) * arm.n] for i in range(3))

    assert (np.abs(np.diff(q, axis=0)) <= AT_MOST * arm.limit("speed") * period).all()
    assert (np.abs(np.diff(qd, axis=0)) <= AT_MOST * arm.limit("acceleration") * period).all()
    assert (np.abs(qdd) <= AT_MOST * arm.limit("acceleration")).all()
    assert any(stage.stopped for stage in recording.stages)
    assert not qd[-1].any()


def test_too_deep() -> None:
    """An arm that comes down too fast is stopped all the same; the message says how deep it came and what helps."""
    recording, error = recorded(PROGRAMS["too deep"])
    assert error is not None
    said = error.diagnostic

    assert (said.code, "deeper than 5 mm" in said.message) == ("E404", True)
    assert any("cannot be avoided" in note for note in said.notes)
    assert "come down more slowly" in said.helps[0]
    (stop,) = (effect for effect in recording.effects if effect.kind == "STOP")
    depth = 0.045 - recording.tree.world("ARM_1")[2, 3]
    assert depth > 0.005
    assert stop.data["contact"] == {
        "depth": pytest.approx(depth, abs=1e-6),
        "force": pytest.approx(2e4 * depth, rel=1e-3),
    }
