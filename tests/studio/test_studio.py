"""A studio without a browser: what its commands do, and which page may send them."""

import base64
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from armwright.cell.reader import read_cell
from armwright.cell.simulator import Simulator
from armwright.files.inputs import read_program
from armwright.kinematics.forward_kinematics import forward
from armwright.physics.world import PhysicsCell
from armwright.program.api import compile as compile_program
from armwright.program.vm.interpreter import interpret
from armwright.studio.cell_file import CellFile
from armwright.studio.live_arm import LiveArm, Solution
from armwright.studio.program_text import ProgramText
from armwright.studio.project import Project
from armwright.studio.studio import Studio
from armwright.studio.workbench import Workbench

EXAMPLES = Path(__file__).parents[2] / "examples"
PROGRAM = "{ Two stops. }\nVAR low, high : FRAME ;\nBEGIN\n  MOVE ARM_1 TO LOW ;\n  MOVE ARM_1 TO HIGH ;\nEND.\n"


class Pages:
    """A studio with its pages, whose time the test lets go by."""

    def __init__(self, folder: Path, program: str = PROGRAM, cell: str = "") -> None:
        (folder / "bench.toml").write_text(cell or CELL)
        (folder / "bench.rlo").write_text(program)
        self.file = CellFile(folder / "bench.toml")
        self.studio = Studio(Project(Workbench(self.file.cell), self.file, folder / "bench.rlo"))
        self.studio.workbench.warm_up()
        self.now = 0.0
        self.kept: dict[int, dict[str, Any]] = {}
        self.studio.page_opened(1)

    def send(self, word: str, page: int = 1, **fields: Any) -> str:
        """Send a command; return why it was not done."""
        self.studio.receive(json.dumps({"do": word, **fields}), page, self.now)
        return self.studio._refusals.get(page, "")

    def state(self, page: int = 1) -> dict[str, Any]:
        """Return what a page shows, with what it has from before."""
        new = json.loads(json.dumps(self.studio.state(page), allow_nan=False))
        kept = self.kept.setdefault(page, {})
        kept |= {name: new[name] for name in ("around", "file", "program", "modules") if name in new}
        return {**kept, **new}

    def wait(self, seconds: float) -> None:
        """Let time go by [s]."""
        for _ in range(round(seconds * 60)):
            self.now += 1 / 60
            self.studio.tick(self.now, 1 / 60)

    @property
    def tool(self) -> np.ndarray:
        """The pose of the tool in the world."""
        return self.studio.workbench.arms["ARM_1"].tool


TWO_ARMS = """
[arms.ARM_1]
model = "puma560"
joint_positions = [0, 0, 0, 0, 1, 0]

[arms.ARM_2]
model = "puma560"
joint_positions = [0, 0, 0, 0, 1, 0]
base = [1, 0, 0,  0, 1, 0,  0, 0, 1,  3, 0, 0]
"""


def test_worked_out_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What one page has been shown is not worked out again for another, nor for an arm that stands."""
    pages = Pages(tmp_path, "", TWO_ARMS)
    pages.studio.page_opened(2)
    worked_out: list[str] = []
    solutions = LiveArm.solutions

    def counted(arm: LiveArm) -> list[Solution]:
        worked_out.append(arm.name)
        return solutions(arm)

    monkeypatch.setattr(LiveArm, "solutions", counted)
    pages.state()
    pages.state(page=2)
    assert worked_out == ["ARM_1", "ARM_2"]
    assert not pages.send("joint", arm="ARM_2", joint=1, value=0.4)

    first, second = pages.state()["arms"], pages.state(page=2)["arms"]

    assert worked_out == ["ARM_1", "ARM_2", "ARM_2"]
    assert first == second
    assert first["ARM_2"]["q"][0] == 0.4
    assert not pages.send("grip", arm="ARM_1", open=False)
    assert [pages.state(page)["arms"]["ARM_1"]["grip"] for page in (1, 2)] == [0.0, 0.0]


CELL = """\
[arms.ARM_1]
model = "puma560"
tool = [1, 0, 0,  0, 1, 0,  0, 0, 1,  0, 0, 0.12]
hand = [1, 0, 0,  0,-1, 0,  0, 0,-1,  0.45, -0.15, 0.25]

[frames]
LOW = [1, 0, 0,  0,-1, 0,  0, 0,-1,  0.45, -0.1, 0.05]
HIGH = [1, 0, 0,  0,-1, 0,  0, 0,-1,  0.45, 0.1, 0.3]
"""


@pytest.fixture
def pages(tmp_path: Path) -> Pages:
    return Pages(tmp_path)


# ---- jogging ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("frame", "axis", "sign"), [("WORLD", 2, 1), ("TOOL", 0, -1), ("BASE", 1, 1), ("LOW", 4, -1)])
def test_jog(pages: Pages, frame: str, axis: int, sign: int) -> None:
    """A jog moves along one axis of its frame, at its speed, as long as it is kept going."""
    before = pages.tool
    for _ in range(5):
        assert pages.send("jog", arm="ARM_1", frame=frame, axis=axis, sign=sign, share=0.2) == ""
        pages.wait(0.1)
    after = pages.tool
    axes = {"WORLD": np.eye(3), "BASE": np.eye(3), "TOOL": before[:3, :3], "LOW": before[:3, :3]}[frame]
    if axis < 3:
        np.testing.assert_allclose(after[:3, 3] - before[:3, 3], sign * 0.25 * 0.2 * 0.5 * axes[:, axis], atol=1e-6)
        np.testing.assert_allclose(after[:3, :3], before[:3, :3], atol=1e-6)
    else:
        turned = after[:3, :3] @ before[:3, :3].T
        angle = np.arccos(np.clip((np.trace(turned) - 1) / 2, -1, 1))
        assert angle == pytest.approx(np.radians(45) * 0.2 * 0.5, abs=1e-5)
        np.testing.assert_allclose(turned @ axes[:, axis - 3], axes[:, axis - 3], atol=1e-6)


@pytest.mark.parametrize("end", ["halt", "silence", "page closed", "handed over"])
def test_a_jog_stops(pages: Pages, end: str) -> None:
    """A jog stops when its key is let go, when the page says nothing more, is lost, or has handed over control."""
    pages.send("jog", arm="ARM_1", frame="JOINT", axis=0, sign=1, share=1.0)
    pages.wait(0.1)
    if end == "halt":
        pages.send("halt")
    elif end == "page closed":
        pages.studio.page_closed(1)
    elif end == "handed over":
        pages.studio.page_opened(2)
        pages.send("ask", page=2)
        pages.send("answer", give=True)
    else:
        pages.wait(0.2)
    at = pages.studio.workbench.arms["ARM_1"].q.copy()
    pages.wait(1.0)
    np.testing.assert_array_equal(pages.studio.workbench.arms["ARM_1"].q, at)


def test_a_jog_to_a_limit(pages: Pages) -> None:
    """A joint that comes to its limit stays there, and that is said."""
    for _ in range(100):
        pages.send("jog", arm="ARM_1", frame="JOINT", axis=5, sign=1, share=1.0)
        pages.wait(0.1)
    assert pages.state()["refusal"] == "joint 6 is at its limit"
    arm = pages.studio.workbench.arms["ARM_1"]
    assert arm.q[5] == pytest.approx(arm.upper[5])


def test_undo(pages: Pages) -> None:
    """Each gesture is taken back as a whole."""
    start = pages.studio.workbench.arms["ARM_1"].q.copy()
    for value in (0.1, 0.2, 0.3):
        pages.send("joint", arm="ARM_1", joint=1, value=value)
    pages.now += 1.0
    pages.send("go to", arm="ARM_1", name="LOW")
    assert pages.send("undo") == ""
    assert pages.studio.workbench.arms["ARM_1"].q[0] == 0.3
    pages.send("undo")
    np.testing.assert_array_equal(pages.studio.workbench.arms["ARM_1"].q, start)
    assert pages.send("undo") == "there is nothing to take back"


def test_wrong_commands(pages: Pages) -> None:
    """What cannot be done changes nothing, and the reason is told."""
    before = pages.state()["arms"]
    assert "ARM_1" in pages.send("joint", arm="ARM_2", joint=1, value=0.0)
    assert "joints 1 to 6" in pages.send("joint", arm="ARM_1", joint=7, value=0.0)
    assert "joints 1 to 6" in pages.send("joint", arm="ARM_1", joint=7, value=0.0)
    assert pages.send("tool", arm="ARM_1", pose=[1.0] * 12) != ""
    assert pages.send("tool", arm="ARM_1", pose=[1.0] * 3) != ""
    assert "did you mean jog" in pages.send("jogg")
    assert "HIGH" in pages.send("go to", arm="ARM_1", name="HIHG")
    assert "share" in pages.send("jog", arm="ARM_1", frame="TOOL", axis=0, sign=1, share=0.0)
    assert pages.state()["arms"] == before


# ---- control ---------------------------------------------------------------------------------------------------------


def test_control(pages: Pages) -> None:
    """One page commands; another one gets control when it is handed over, in time, or when the first is lost."""
    pages.studio.page_opened(2)
    assert pages.state(1)["control"]["mine"]
    assert pages.send("joint", page=2, arm="ARM_1", joint=1, value=0.1) == "another page has control; ask for it"
    assert pages.state(1)["refusal"] == ""
    assert pages.state(1)["arms"] == pages.state(2)["arms"]

    pages.send("ask", page=2)
    assert pages.state(1)["control"]["asked"]
    pages.send("answer", give=False)
    assert pages.state(1)["control"]["mine"]
    pages.send("ask", page=2)
    pages.wait(11.0)
    assert pages.state(2)["control"]["mine"]
    pages.studio.page_closed(2)
    assert pages.state(1)["control"]["mine"]


# ---- teaching --------------------------------------------------------------------------------------------------------


def test_teach_and_insert(pages: Pages) -> None:
    """A MOVE to a taught frame brings the arm to where it was taught; nothing is written before it is saved."""
    pages.send("joint", arm="ARM_1", joint=1, value=0.6)
    taught = pages.tool
    assert pages.send("insert", arm="ARM_1", frame="pick", line=4, straight=True, speed=40.0) == ""
    state = pages.state()
    lines = state["source"].splitlines()
    assert lines[1] == "VAR low, high, PICK : FRAME ;"
    assert lines[4] == "  MOVE ARM_1 TO PICK STRAIGHTLY, WITH SPEED = 40 ;"
    assert state["program"]["runs"]
    assert state["program"]["changed"]
    assert "+PICK" in state["file"]["change"]
    assert "PICK" not in pages.file.path.read_text()
    for what in ("cell", "program"):
        assert pages.send("save", what=what) == ""
    assert pages.state()["file"]["change"] == ""
    np.testing.assert_allclose(read_cell(pages.file.path).tree().world("PICK"), taught, atol=1e-6)

    pages.send("joint", arm="ARM_1", joint=1, value=0.7)
    assert pages.send("touch up", line=5) == ""
    np.testing.assert_allclose(pages.file.cell.tree().world("PICK"), pages.tool, atol=1e-6)
    assert pages.send("touch up", line=1) == "there is no MOVE in line 1"
    assert "expected 1 to 120" in pages.send("insert", arm="ARM_1", frame="Q", line=4, speed=0.0)
    assert "Q" not in pages.file.cell.frames


@pytest.mark.parametrize(
    ("fields", "statement"),
    [
        ({}, "MOVE ARM_1 TO PICK ;"),
        ({"straight": True}, "MOVE ARM_1 TO PICK STRAIGHTLY ;"),
        ({"approach": 0.05}, "MOVE ARM_1 TO PICK WITH APPROACH = PICK * XYZ(0, 0, -50mm) ;"),
        (
            {"departure": 0.02, "speed": 40},
            "MOVE ARM_1 TO PICK WITH DEPARTURE = ARM_1 * XYZ(0, 0, -20mm), WITH SPEED = 40 ;",
        ),
    ],
)
@pytest.mark.parametrize("units", ["", "UNITS MM ;\n"])
def test_forms(tmp_path: Path, fields: dict[str, Any], statement: str, units: str) -> None:
    """Each form of a MOVE is inserted, and makes the motion that is meant, in any units."""
    pages = Pages(tmp_path, program=units + PROGRAM.partition("\n")[2].replace("  MOVE ARM_1 TO LOW ;\n", ""))
    pages.send("tool", arm="ARM_1", pose=[1, 0, 0, 0, -1, 0, 0, 0, -1, 0.5, 0.1, 0.2], leaping=True)
    taught = pages.tool
    line = 3 + bool(units)
    assert pages.send("insert", arm="ARM_1", frame="pick", line=line, **fields) == ""
    text = pages.state()["source"]
    assert statement in text
    compiled = compile_program(pages.studio.project.program.compiled.source, pages.file.cell)
    recording = interpret(compiled.code, pages.file.cell, Simulator(pages.file.cell))
    source = pages.studio.project.program.compiled.source
    stages = [it for it in recording.stages if source.line(it.span.start) == line + 1]
    assert ("LINE" in {it.stage.kind for it in stages}) == bool(fields)
    arm, last = pages.file.cell.arms["ARM_1"], stages[-1]
    end = recording.streams[0].q[round((last.t0 + last.motion.duration) / pages.file.cell.period)]
    np.testing.assert_allclose(arm.base @ forward(arm.arm, end), taught, atol=1e-6)


@pytest.mark.parametrize(
    "text",
    [
        "VAR high : FRAME ;\nBEGIN\n  MOVE ARM_1 TO high\nEND.\n",
        "VAR high : FRAME ;\nBEGIN MOVE ARM_1 TO high END.\n",
        "VAR high : FRAME ;\nBEGIN MOVE ARM_1 TO high ; END.\n",
        "VAR high : FRAME ;\nBEGIN\n  MOVE ARM_1 TO high ; { there }\n  { here }\nEND.",
        "BEGIN END.\n",
        "BEGIN\nEND.\n",
        "",
    ],
)
def test_inserted_anywhere(tmp_path: Path, text: str) -> None:
    """Into whatever program a MOVE is inserted, it stays one, and the MOVE is its last statement."""
    pages = Pages(tmp_path, program=text)
    assert pages.send("insert", arm="ARM_1", frame="pick", line=3) == ""
    program = pages.studio.project.program
    assert pages.state()["program"]["runs"], program.text
    assert program.goal_in(program.text[: program.text.index("TO PICK")].count("\n") + 1) == "PICK"
    assert program.compiled.tree.statements[-1].span.end >= program.text.index("TO PICK")


@pytest.mark.parametrize("name", ["BEGIN", "MOVE", "BASE", "1A", "A" * 32, "", "A B"])
def test_names_that_cannot_be(pages: Pages, name: str) -> None:
    """Neither the cell nor the program is changed where a name cannot be."""
    before = pages.studio.project.program.text, pages.file.text
    assert pages.send("insert", arm="ARM_1", frame=name, line=4) != ""
    assert pages.send("insert", arm="ARM_1", frame="OK", line=4, approach=5.0) != ""
    assert (pages.studio.project.program.text, pages.file.text) == before


def test_via(pages: Pages) -> None:
    """Frames are put into the VIA of a MOVE, in order; what cannot be combined is refused, and nothing is taught."""
    for number, value in enumerate((0.1, 0.2)):
        pages.send("joint", arm="ARM_1", joint=1, value=value)
        assert pages.send("via", arm="ARM_1", frame=f"v{number}", line=5, blend=0.01 * number) == ""
    text = pages.state()["source"]
    assert text.splitlines()[1] == "VAR low, high, V0, V1 : FRAME ;"
    assert text.splitlines()[4] == "  MOVE ARM_1 TO HIGH VIA (V0, V1), WITH BLEND = 10mm ;"
    assert pages.state()["program"]["runs"]

    pages.send("text", text=text.replace("TO LOW", "TO LOW STRAIGHTLY"), version=2)
    assert "STRAIGHTLY, which cannot be combined" in pages.send("via", arm="ARM_1", frame="W", line=4)
    assert "no MOVE in line 1" in pages.send("via", arm="ARM_1", frame="W", line=1)
    assert "W" not in pages.file.cell.frames
    pages.send("text", text=text.replace("TO LOW", "TO LOW, WITH SPEED = 50"), version=3)
    assert pages.send("via", arm="ARM_1", frame="W", line=4) == ""
    assert "MOVE ARM_1 TO LOW VIA (W), WITH SPEED = 50 ;" in pages.state()["source"]


def test_joint_targets(pages: Pages) -> None:
    """An arm goes back to a joint target, which is shown before."""
    q = pages.studio.workbench.arms["ARM_1"].q.copy()
    assert pages.send("teach joints", arm="ARM_1", name="home") == ""
    pages.send("joint", arm="ARM_1", joint=1, value=0.5)
    pages.send("preview", arm="ARM_1", name="HOME")
    np.testing.assert_allclose(pages.state()["ghost"]["q"], q, atol=1e-6)
    assert pages.send("go to", arm="ARM_1", name="HOME") == ""
    np.testing.assert_allclose(pages.studio.workbench.arms["ARM_1"].q, q, atol=1e-6)
    assert pages.send("forget", name="HOME") == ""
    assert pages.state()["around"]["targets"] == {}


def test_a_program_from_nothing(tmp_path: Path) -> None:
    """MOVEs are inserted into an empty program."""
    pages = Pages(tmp_path, program="")
    for number, value in enumerate((0.0, 0.3, 0.5)):
        pages.send("joint", arm="ARM_1", joint=1, value=value)
        assert pages.send("insert", arm="ARM_1", frame=f"P{number}", line=100) == ""
    text = pages.state()["source"]
    assert (
        text
        == "VAR P0, P1, P2 : FRAME ;\nBEGIN\n  MOVE ARM_1 TO P0 ;\n  MOVE ARM_1 TO P1 ;\n  MOVE ARM_1 TO P2 ;\nEND.\n"
    )
    assert pages.state()["program"]["runs"]


# ---- running ---------------------------------------------------------------------------------------------------------


def test_a_run(pages: Pages) -> None:
    """A run shows what the program does, in its time; jogging and editing have to wait."""
    compiled = compile_program(pages.studio.project.program.compiled.source, pages.file.cell)
    recording = interpret(compiled.code, pages.file.cell, Simulator(pages.file.cell))
    stream = recording.streams[0]

    assert pages.send("run") == ""
    for _ in range(30):
        pages.wait(0.1)
        run = pages.state()["run"]
        row = min(round(run["time"] / pages.file.cell.period), len(stream.q) - 1)
        shown = pages.studio.workbench.arms["ARM_1"].q
        assert np.abs(shown - stream.q[max(row - 1, 0) : row + 2]).max(axis=1).min() < 1e-2
    assert "stop it first" in pages.send("joint", arm="ARM_1", joint=1, value=0.0)
    assert "stop it first" in pages.send("text", text="BEGIN\nEND.\n", version=0)
    pages.wait(recording.duration)
    run = pages.state()["run"]
    assert (run["ended"], run["reason"], run["time"]) == (True, "end", pytest.approx(recording.duration, abs=1e-3))
    np.testing.assert_allclose(pages.studio.workbench.arms["ARM_1"].q, stream.q[-1], atol=1e-9)
    assert pages.send("stop") == ""
    assert pages.state()["run"] is None
    np.testing.assert_allclose(pages.studio.workbench.arms["ARM_1"].q, stream.q[-1], atol=1e-9)


def test_breakpoints_steps_and_back(pages: Pages) -> None:
    """A run stands at a breakpoint; a step and a step back lead to the same configuration, to the bit."""
    pages.send("break", line=5, on=True)
    pages.send("run")
    pages.wait(6.0)
    run = pages.state()["run"]
    assert (run["reason"], run["lines"][0]["line"], run["playing"]) == ("breakpoint", 5, False)
    there = pages.studio.workbench.arms["ARM_1"].q.copy()
    pages.send("go", step="next")
    pages.wait(6.0)
    assert not np.array_equal(pages.studio.workbench.arms["ARM_1"].q, there)
    pages.send("go", step="back")
    pages.wait(1.0)
    np.testing.assert_array_equal(pages.studio.workbench.arms["ARM_1"].q, there)


def test_what_is_known_of_a_run(pages: Pages) -> None:
    """The paths of tools lead where the arm goes; variables have their values where the program stands."""
    text = PROGRAM.replace("FRAME ;", "FRAME ; n : SCALAR ;").replace(
        "  MOVE ARM_1 TO HIGH", "  n = 7 ;\n  MOVE ARM_1 TO HIGH"
    )
    pages.send("text", text=text, version=0)
    pages.send("break", line=6, on=True)
    pages.send("run")
    pages.wait(6.0)
    state = pages.state()
    assert {"name": "n", "value": "7", "type": "SCALAR"} in state["run"]["variables"]
    rows = np.array(state["paths"]["ARM_1"])
    assert (np.diff(rows[:, 0]) >= 0).all()
    np.testing.assert_allclose(rows[-1, 1:], pages.tool[:3, 3], atol=1e-4)
    assert "paths" not in pages.state()


def test_compared_motions(pages: Pages) -> None:
    """Two motions are kept with their figures, which are those of the recording."""
    for share in ("", ", WITH SPEED = 50"):
        pages.send("text", text=PROGRAM.replace("LOW ;", f"LOW{share} ;"), version=pages.studio.project.program.version)
        pages.send("run")
        pages.wait(12.0)
        assert pages.send("keep motion") == ""
        pages.send("stop")
    fast, slow = pages.state()["compared"]
    assert fast["duration"] < slow["duration"]
    for motion in (fast, slow):
        arm, recording_end = motion["arms"]["ARM_1"], motion["duration"]
        path = np.array(arm["path"])
        assert arm["t"][-1] == pytest.approx(recording_end, abs=2e-3)
        assert arm["figures"]["path_length"] == pytest.approx(
            np.linalg.norm(np.diff(path, axis=0), axis=1).sum(), rel=1e-2
        )
        most = pages.file.cell.arms["ARM_1"].arm.limits.speed
        share = np.abs(np.array(arm["qd"])).max(axis=0) / most
        assert arm["figures"]["speed_share"] == pytest.approx(share.max(), rel=1e-2)
        assert arm["figures"]["speed_joint"] == share.argmax() + 1
    assert fast["arms"]["ARM_1"]["figures"]["path_length"] == pytest.approx(
        slow["arms"]["ARM_1"]["figures"]["path_length"], rel=1e-4
    )


def test_devices(tmp_path: Path) -> None:
    """Devices are switched by hand, and shown as a run switches them."""
    pages = Pages(
        tmp_path,
        cell=CELL.replace("[frames]", "[devices.lamp]\n[devices.press]\n[frames]"),
        program="BEGIN OPERATE lamp ON ; PAUSE 1 ; OPERATE lamp OFF ; PAUSE 1 END.\n",
    )
    assert pages.send("operate", device="PRESS", on=True) == ""
    assert pages.state()["devices"] == {"LAMP": False, "PRESS": True}
    assert "did you mean" in pages.send("operate", device="PRES", on=True).lower()
    pages.send("run")
    pages.wait(0.5)
    assert pages.state()["devices"] == {"LAMP": True, "PRESS": False}
    pages.wait(1.0)
    assert pages.state()["devices"] == {"LAMP": False, "PRESS": False}


def test_what_a_camera_sees() -> None:
    """A picture shows the cell as it is shown, and changes when an arm moves into it."""
    pytest.importorskip("cv2")
    file = CellFile(EXAMPLES / "vision_cell.toml")
    studio = Studio(Project(Workbench(file.cell)))
    studio.workbench.warm_up()
    studio.page_opened(1)
    camera = next(iter(file.cell.cameras))
    pictures = []
    for value in (0.0, 0.4):
        studio.receive(json.dumps({"do": "joint", "arm": "ARM_1", "joint": 1, "value": value}), 1, 0.0)
        studio.receive(json.dumps({"do": "look", "camera": camera}), 1, 0.0)
        ((_, job),) = studio.take_jobs()
        pictures.append(base64.b64decode(job()["picture"]["png"]))
    assert all(picture.startswith(b"\x89PNG") for picture in pictures)
    assert pictures[0] != pictures[1]
    studio.receive(json.dumps({"do": "look", "camera": "TPO"}), 1, 0.0)
    assert "no camera" in studio.state(1)["refusal"]


def test_a_run_with_physics() -> None:
    """Parts are shown where they are in the world, and measured beside planned."""
    pytest.importorskip("cv2")
    file = CellFile(EXAMPLES / "vision_cell.toml")
    studio = Studio(Project(Workbench(file.cell), file, EXAMPLES / "stack_by_vision.rlo"))
    studio.workbench.warm_up()
    studio.page_opened(1)
    studio.receive(json.dumps({"do": "run", "physics": True, "rate": 4}), 1, 0.0)
    for k in range(60):
        studio.tick(k / 20, 1 / 20)
    run = studio.project.run
    assert run is not None
    state, hardware = studio.state(1), run._computed.machine.hardware
    assert isinstance(hardware, PhysicsCell)
    assert state["picture"]["found"]
    motion = state["run"]["motions"]["ARM_1"]
    np.testing.assert_allclose(motion["q_measured"], motion["q"], atol=1e-2)
    np.testing.assert_allclose(studio.workbench.arms["ARM_1"].q, motion["q_measured"], atol=1e-5)
    tracks = hardware.observations().parts
    for name, X in studio.workbench.part_poses().items():
        np.testing.assert_allclose(X, tracks[name].at(run.time + 1e-9)[1], atol=1e-9)


def test_a_process_steps(tmp_path: Path) -> None:
    """Of two processes that stand the one that is named steps, and the other stays."""
    text = (
        "VAR k : SCALAR ;\nBEGIN\nCOBEGIN\nBEGIN PAUSE 0.5 ;\nPAUSE 9 END ;\n"
        "BEGIN PAUSE 1 ;\nk = 1 ;\nPAUSE 1 END\nCOEND\nEND.\n"
    )
    pages = Pages(tmp_path, program=text)
    pages.send("break", line=5, on=True)
    pages.send("run")
    pages.wait(2.0)

    def lines() -> dict[str, int]:
        return {it["process"]: it["line"] for it in pages.state()["run"]["lines"]}

    other = next(name for name, line in lines().items() if line == 6)
    for line in (7, 8):
        assert pages.send("go", step="next", process=other) == ""
        pages.wait(2.0)
        assert lines()[other] == line
        assert 5 in lines().values()
    assert f"Did you mean '{other}'" in pages.send("go", step="next", process=f"{other}x")


def test_run_from_here(pages: Pages) -> None:
    """From a line on the program runs from where the arm is, and one line by itself."""
    pages.send("joint", arm="ARM_1", joint=1, value=0.5)
    start = pages.studio.workbench.arms["ARM_1"].q.copy()
    pages.send("run", line=4, only=True)
    pages.wait(0.01)
    np.testing.assert_allclose(pages.studio.workbench.arms["ARM_1"].q, start, atol=1e-4)
    pages.wait(5.0)
    assert pages.state()["run"]["reason"] == "end"
    np.testing.assert_allclose(pages.tool, pages.file.cell.tree().world("LOW"), atol=1e-6)
    pages.send("stop")
    assert "no statement" in pages.send("run", line=6)


def test_completion_and_description(pages: Pages) -> None:
    """What can be written at a position, and what stands there, in a text beyond the first plane of characters too."""
    text = "{ \U0001f916 }\nVAR low : FRAME ;\nBEGIN\n  MOVE ARM_1 TO l\nEND.\n"
    pages.send("complete", text=text, offset=text.index("l\nEND") + 1)
    ((_, job),) = pages.studio.take_jobs()
    (first,) = [it for it in job()["completions"] if it["label"] == "low"]
    assert text[first["start"] : first["end"]] == "l"
    assert pages.send("text", text=text, version=0) == ""
    problems = pages.state()["program"]["diagnostics"]
    assert len(text[: text.index("l\nEND")].encode("utf-16-le")) // 2 in {it["start"] for it in problems}
    pages.send("describe", offset=text.index("low"))
    ((_, job),) = pages.studio.take_jobs()
    assert "FRAME" in job()["description"]


def test_imports(pages: Pages) -> None:
    """A program in the studio IMPORTs what lies beside it, and runs with the frames of that."""
    (pages.file.path.parent / "more.toml").write_text(
        "[frames]\nASIDE = [1, 0, 0,  0,-1, 0,  0, 0,-1,  0.4, -0.1, 0.2]\n"
    )
    text = "IMPORT 'more.toml' ;\nBEGIN MOVE ARM_1 TO ASIDE END.\n".replace("'", '"')
    assert pages.send("text", text=text, version=0) == ""
    assert pages.state()["program"]["diagnostics"] == []
    pages.send("run")
    pages.wait(6.0)
    np.testing.assert_allclose(pages.tool[:3, 3], (0.4, -0.1, 0.2), atol=1e-6)
    pages.send("stop")
    pages.send("text", text=text.replace("more", "none"), version=1)
    assert "none.toml" in pages.state()["program"]["diagnostics"][0]["text"]


MODULE = """\
MODULE ways ;
VAR high, low : FRAME ;
PROCEDURE up ;
BEGIN
  MOVE ARM_1 TO high ;
END ;
END.
"""


def test_modules(pages: Pages) -> None:
    """A program runs with modules below its folder; places in them are told with their file, as the files are now."""
    folder = pages.file.path.parent
    (folder / "lib").mkdir()
    module = folder / "lib" / "ways.rlo"
    module.write_text(MODULE.replace("high ;", "hgih ;"))
    text = "IMPORT 'lib/ways.rlo' AS way ;\nBEGIN\n  way.up() ;\n  MOVE ARM_1 TO way.low ;\nEND.\n".replace("'", '"')
    assert pages.send("text", text=text, version=0) == ""
    (problem,) = [it for it in pages.state()["program"]["diagnostics"] if it["severity"] == "error"]
    assert (problem["code"], problem["file"], problem["line"], problem["start"]) == ("E202", "lib/ways.rlo", 5, None)
    assert pages.send("run") == "line 5 of lib/ways.rlo: E202: `hgih` is not declared"

    module.write_text(MODULE)
    assert pages.send("run", entry=True) == ""
    pages.wait(1.0)
    pages.send("go", step="in")
    pages.wait(1.0)
    (line,) = pages.state()["run"]["lines"]
    assert (line["process"], line["line"], line["place"]) == ("up", 3, "5 of lib/ways.rlo")
    pages.send("break", line=4, on=True)
    pages.send("go", step="continue")
    pages.wait(6.0)
    run = pages.state()["run"]
    assert (run["reason"], run["lines"][0]["line"], run["lines"][0]["place"]) == ("breakpoint", 4, "4")
    assert pages.send("break", line=5, file="lib/ways.rlo", on=True) == ""
    assert pages.state()["program"]["module_breakpoints"] == [["lib/ways.rlo", 5]]
    assert pages.state()["modules"] == [{"path": "lib/ways.rlo", "text": MODULE}]
    assert "no module 'lib/way.rlo'" in pages.send("break", line=5, file="lib/way.rlo", on=True)
    assert "no line 50" in pages.send("break", line=50, file="lib/ways.rlo", on=True)
    np.testing.assert_allclose(pages.tool[:3, 3], (0.45, 0.1, 0.3), atol=1e-6)
    pages.send("stop")
    pages.send("run")
    pages.wait(1.0)
    run = pages.state()["run"]
    (stood,) = run["lines"]
    assert (run["reason"], stood["file"], stood["inner"], stood["line"]) == ("breakpoint", "lib/ways.rlo", 5, 3)
    pages.send("stop")
    (folder.parent / "ways.rlo").write_text(MODULE)
    (folder / "out.rlo").symlink_to(folder.parent / "ways.rlo")
    for path in ("../ways.rlo", "out.rlo", str(folder.parent / "ways.rlo")):
        pages.send("text", text=text.replace("lib/ways.rlo", path), version=pages.state()["program"]["version"])
        assert pages.state()["program"]["diagnostics"][0]["code"] == "E228"
    assert pages.studio.project.program.text.endswith("MOVE ARM_1 TO way.low ;\nEND.\n")
    pages.send("text", text=text, version=pages.state()["program"]["version"])
    assert pages.send("touch up", line=4) == ""
    assert pages.studio.project.program.goal_in(4) == "LOW"


def without_names(folder: Path) -> Pages:
    """A studio whose cell file and program have no names yet."""
    pages = Pages(folder, program="")
    pages.file = CellFile(folder / "suggested.toml", CELL)
    pages.studio = Studio(Project(Workbench(pages.file.cell), pages.file))
    pages.studio.workbench.warm_up()
    pages.studio.page_opened(1)
    return pages


def test_a_first_save_that_fails(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A file that could not be written has no name yet: it is asked for again, and may be another one."""
    pages = without_names(tmp_path)
    pages.send("text", text=PROGRAM, version=0)
    (tmp_path / "gone").mkdir()
    monkeypatch.chdir(tmp_path / "gone")
    (tmp_path / "gone").rmdir()
    for what in ("cell", "program"):
        assert "cannot write" in pages.send("save", what=what, name="first")
    state = pages.state()
    assert (state["file"]["named"], state["program"]["named"], state["program"]["changed"]) == (False, False, True)

    monkeypatch.chdir(tmp_path)
    for what in ("cell", "program"):
        assert pages.send("save", what=what, name="second") == ""
    state = pages.state()
    assert (state["file"]["name"], state["program"]["name"]) == ("second.toml", "second.rlo")
    assert (tmp_path / "second.rlo").read_text() == PROGRAM
    assert (tmp_path / "second.toml").read_text() == CELL


def test_imports_of_a_program_that_gets_its_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A program that gets its name when it is saved IMPORTs what lies beside it from then on."""
    monkeypatch.chdir(tmp_path)
    pages = without_names(tmp_path)
    (tmp_path / "more.toml").write_text("[frames]\nASIDE = [1, 0, 0, 0, -1, 0, 0, 0, -1, 0.45, -0.2, 0.2]\n")
    text = "IMPORT 'more.toml' ;\nBEGIN MOVE ARM_1 TO ASIDE END.\n".replace("'", '"')
    pages.send("text", text=text, version=0)
    assert pages.send("save", what="program", name="named") == ""

    assert pages.send("run", rate=8.0) == ""
    pages.wait(2.0)
    assert pages.state()["run"]["reason"] == "end"
    np.testing.assert_allclose(pages.tool[:3, 3], [0.45, -0.2, 0.2], atol=1e-6)


def test_ends_of_lines(tmp_path: Path) -> None:
    """A file keeps its ends of lines; pages know one."""
    pages = Pages(tmp_path, program="")
    path = tmp_path / "bench.rlo"
    path.write_bytes(PROGRAM.replace("\n", "\r\n").encode())
    pages.studio.project.program = ProgramText(path, read_program(path), pages.file.cell)
    text = pages.state()["source"]
    assert text == PROGRAM
    assert not pages.state()["program"]["changed"]
    pages.send("text", text=text.replace("Two", "2"), version=0)
    assert pages.send("save", what="program") == ""
    assert path.read_bytes() == PROGRAM.replace("Two", "2").replace("\n", "\r\n").encode()


def test_a_program_with_errors(pages: Pages) -> None:
    """A wrong program is shown with its diagnostics, and does not run."""
    text = PROGRAM.replace("MOVE ARM_1 TO HIGH", "MOV ARM_1 TO HIGH")
    assert pages.send("text", text=text, version=0) == ""
    (problem, *_) = pages.state()["program"]["diagnostics"]
    assert (problem["code"], problem["line"]) == ("E105", 5)
    assert "line 5: E105" in pages.send("run")
    assert "changed meanwhile" in pages.send("text", text="", version=0)


def test_a_run_that_fails(tmp_path: Path) -> None:
    """At a MOVE out of reach a run stands with its message, and ends when it goes on; then the page goes on."""
    far = CELL.replace("0.45, 0.1, 0.3]", "4.45, 0.1, 0.3]")
    pages = Pages(tmp_path, cell=far)
    pages.send("run")
    pages.wait(6.0)
    run = pages.state()["run"]
    assert (run["ended"], run["reason"], run["lines"][0]["line"]) == (False, "exception", 5)
    assert "out of reach" in run["text"]
    pages.send("go", step="continue")
    pages.wait(0.1)
    assert pages.state()["run"]["reason"] == "failed"
    assert pages.send("stop") == ""
    assert pages.send("joint", arm="ARM_1", joint=1, value=0.0) == ""


def test_what_is_kept_of_a_run(pages: Pages) -> None:
    """The page, the 3-D file and the film of a run."""
    assert pages.send("keep", what="page") == "no program runs"
    pages.send("run")
    pages.wait(6.0)
    beginnings = {"page": b"<!DOCTYPE html>", "gltf": b"glTF", "gif": b"GIF8"}
    for what in beginnings:
        assert pages.send("keep", what=what) == ""
    names = set()
    for (page, job), beginning in zip(pages.studio.take_jobs(), beginnings.values(), strict=True):
        made = job()["download"]
        assert page == 1
        assert base64.b64decode(made["data"]).startswith(beginning)
        names.add(made["name"])
    assert len(names) == 3


def test_a_film_that_nobody_waits_for(pages: Pages) -> None:
    """A film is not drawn to its end when the studio ends meanwhile."""
    pages.send("run")
    pages.wait(6.0)
    assert pages.send("keep", what="gif") == ""
    pages.studio.has_ended = True

    assert [job() for _, job in pages.studio.take_jobs()] == [None]
    assert pages.state()["refusal"] == "the studio has ended"


def test_what_cannot_be_made(pages: Pages) -> None:
    """A message that cannot be made is refused in words, whatever went wrong; a few wait at once, and no more."""
    pages.send("run")
    pages.wait(6.0)
    refusals = [pages.send("keep", what="page") for _ in range(10)]
    assert refusals == [""] * 8 + ["too much is being made already; wait a moment"] * 2
    run = pages.studio.project.run
    assert run is not None
    run.recording = lambda: 1 / 0  # type: ignore[method-assign,assignment,return-value]
    assert [job() for _, job in pages.studio.take_jobs()] == [None] * 8
    assert "ZeroDivisionError" in pages.state()["refusal"]
    assert pages.send("keep", what="page") == ""


INPUTS = "[inputs.door]\nstart = 1\ntimeline = [[2.0, 1]]\n[inputs.level]\nanalogue = true\nstart = 3.5\n[frames]"
WATCHED = "BEGIN\nWAIT UNTIL NOT INPUT(door) ;\nPRINT(TIME) ;\nWAIT UNTIL ANALOG(level) > 7 ;\nPAUSE 5\nEND.\n"


def test_inputs(tmp_path: Path) -> None:
    """Inputs are shown as a program reads them; what is set by hand counts from the time shown on.

    The program runs ahead of what is shown, and is taken back to where the switch was set.
    """
    pages = Pages(tmp_path, cell=CELL.replace("[frames]", INPUTS), program=WATCHED)
    values = lambda: {name: entry["value"] for name, entry in pages.state()["inputs"].items()}  # noqa: E731
    assert values() == {"DOOR": 1.0, "LEVEL": 3.5}
    assert pages.send("input", input="LEVEL", value=4) == ""
    assert "expected 0 or 1, got 2" in pages.send("input", input="DOOR", value=2)
    assert "did you mean" in pages.send("input", input="DOR", value=1).lower()
    pages.send("run")
    pages.wait(0.5)
    assert values() == {"DOOR": 1.0, "LEVEL": 4.0}
    assert pages.send("input", input="DOOR", value=0) == ""
    shown = pages.state()["run"]["time"]
    pages.wait(0.5)
    assert values()["DOOR"] == 0.0
    assert pages.studio.project.run is not None
    begun = [effect for effect in pages.studio.project.run.happened.begun if effect.kind == "PRINT"]
    assert [float(effect.data["printed"]) for effect in begun] == [pytest.approx(shown, abs=0.05)]
    pages.send("pause")
    assert pages.send("input", input="LEVEL", value=8) == ""
    pages.send("go", step="continue")
    pages.wait(2.0)
    assert values() == {"DOOR": 1.0, "LEVEL": 8.0}
    assert pages.state()["run"]["lines"][0]["line"] == 5
