"""``armwright run --log``, ``simulate --log`` and ``replay`` as a user calls them."""

import json
import math
import re
from pathlib import Path

import numpy as np
import pytest

from armwright.errors import ExitStatus
from cli_calls import armwright
from files.logs_of_others import NAMES, json_log, mcap_file, motion

# Slow: a half of its tests is drawn.
pytestmark = pytest.mark.part(0.1)

EXAMPLES = Path(__file__).parents[2] / "examples"
RUN = (EXAMPLES / "stacking.rlo", "--cell", EXAMPLES / "stanford_cell.toml")
T = np.arange(0, 8, 0.008)


@pytest.fixture(scope="module")
def strange(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A log of somebody else: a plan at 125 Hz, and what was measured 18 ms late."""
    folder = tmp_path_factory.mktemp("strange")
    messages, start = [], 1_700_000_000 * 10**9
    for channel, q in ((0, motion(T)), (1, motion(T, late=0.018))):
        for t, row in zip(T.tolist(), q.tolist(), strict=True):
            time = start + round(t * 1e9)
            stamp = {"sec": time // 10**9, "nanosec": time % 10**9}
            state = {"header": {"stamp": stamp}, "name": list(NAMES), "position": row}
            messages.append((channel, time, json.dumps(state).encode()))
    kind = ("sensor_msgs/msg/JointState", "json", "jsonschema", b"{}")
    return mcap_file(folder / "cell4.mcap", [("/js_desired", *kind), ("/js", *kind)], messages)


@pytest.mark.parametrize(("kind", "files"), [("mcap", {"log.mcap"}), ("ros2", {"bag.mcap", "metadata.yaml"})])
def test_run(kind: str, files: set[str], tmp_path: Path) -> None:
    """A log is among the files of a run, and is replayed with the arm and the program that it tells of."""
    done = armwright("run", *RUN, "-o", tmp_path / "out", "--log", kind, "-q")
    assert done.returncode == 0, done.stderr
    there = {path.name for path in (tmp_path / "out").iterdir()}
    assert there >= files | {"motion.csv", "run.json", "report.html"}
    assert files <= set(json.loads((tmp_path / "out" / "run.json").read_text(encoding="utf-8"))["files"])

    done = armwright("replay", tmp_path / "out", "-o", tmp_path / "replayed", "--json")

    assert done.returncode == 0, done.stderr
    said = json.loads(done.stdout)
    assert said["topics"]["/ARM_1/planned/joint_states"]["rate"] == pytest.approx(1000)
    assert [(one["arm"], one["tracking"]) for one in said["motions"]] == [("stanford", None)]
    page = (tmp_path / "replayed" / "report.html").read_text(encoding="utf-8")
    assert "READ VISIONS OBJ1" in page
    assert {path.name for path in (tmp_path / "replayed").iterdir()} == {
        "joints.svg",
        "report.html",
        "run.json",
        "summary.json",
    }


def test_older_logs_go(tmp_path: Path) -> None:
    """A run without a log leaves none of an older run beside its files."""
    assert armwright("run", *RUN, "-o", tmp_path / "out", "--log", "ros2", "-q").returncode == 0
    assert armwright("run", *RUN, "-o", tmp_path / "out", "-q").returncode == 0

    assert not {"bag.mcap", "metadata.yaml"} & {path.name for path in (tmp_path / "out").iterdir()}


def test_simulate(tmp_path: Path) -> None:
    """A simulated motion leaves a log too."""
    options = ("-q", "0,0,90,0,0,0", "--duration", "0.2", "-o", tmp_path / "out", "--log", "mcap")
    assert armwright("simulate", "puma560", *options).returncode == 0

    done = armwright("replay", tmp_path / "out" / "log.mcap")

    assert done.returncode == 0, done.stderr
    assert "/puma560/simulated/joint_states: no plan beside it" in done.stdout


@pytest.mark.parametrize(
    "command",
    [("run", *RUN), ("run", *RUN, "-o", "out", "--trials", "3"), ("simulate", "puma560", "-q", "0,0,0,0,0,0")],
)
def test_log_without_folder(command: tuple[str, ...], tmp_path: Path) -> None:
    """A log needs the folder of a single run."""
    done = armwright(*command, "--log", "mcap", cwd=tmp_path)

    assert done.returncode == 2
    assert "specify their folder as -o DIR" in re.sub(r"[\s│]+", " ", done.stderr)


def test_log_of_others(strange: Path, tmp_path: Path) -> None:
    """Of a strange log errors and delays are told without units, and drawn; an arm gives units."""
    done = armwright("replay", strange, "-o", tmp_path / "out", columns=120)

    assert done.returncode == 0, done.stderr
    assert "/js: delay of all joints 18.00 ms" in done.stdout
    assert "the arm is not known, so neither are units: rad or m" in done.stdout
    assert re.search(r"shoulder +rad, m +-?0\.018", done.stdout)
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "<svg" in page
    assert "http://" not in page.replace("http://www.w3.org", "")
    said = json.loads(armwright("replay", strange, "--arm", "ntu-3r", "--json").stdout)
    assert said["motions"][0]["name"] == "ntu-3r"
    assert said["motions"][0]["tracking"]["largest_tool_error"] > 1e-3
    refused = armwright("replay", strange, "--arm", "puma560")
    assert refused.returncode != 0
    assert "/js_desired: 3 joints, but puma560 has 6" in refused.stderr


@pytest.mark.parametrize(
    "states",
    [
        [{"position": [1, 2, 3]}],
        [{"position": [1, 2, 3]}] * 4,
        [{"velocity": [1, 2, 3]}, {"effort": [1, 2, 3]}] * 4,
        [{"position": [0.1 * i, math.nan if i % 3 else 1, 2], "effort": [1, 2, 3]} for i in range(9)],
    ],
    ids=["one", "at rest", "no positions", "holes"],
)
def test_poor_logs(states: list[dict[str, list[float]]], tmp_path: Path) -> None:
    """A log of one state, without positions or with holes is shown as far as it goes, with an arm and without."""
    messages = [
        (channel, i * 10**7, json.dumps({"name": [*NAMES], **state}).encode())
        for i, state in enumerate(states)
        for channel in (0, 1)
    ]
    kind = ("sensor_msgs/msg/JointState", "json", "jsonschema", b"{}")
    log = mcap_file(tmp_path / "a.mcap", [("/left", *kind), ("/right <b>", *kind)], messages)
    for more in ((), ("--arm", "ntu-3r")):
        done = armwright("replay", log, *more, "-o", tmp_path / "out")
        assert done.returncode == 0, done.stderr
        assert "/right <b>: no plan beside it" in done.stdout
        assert "/right <b>" not in (tmp_path / "out" / "report.html").read_text(encoding="utf-8").split("<script")[0]


def test_plan_of_another_log(strange: Path, tmp_path: Path) -> None:
    """What another log has planned is laid over what this one has measured, whatever their clocks."""
    measured = json_log(tmp_path / "robot.mcap", T + 33.4, motion(T), topic="/joint_states")

    said = json.loads(armwright("replay", measured, "--planned", strange, "--json").stdout)

    tracking = said["motions"][0]["tracking"]
    # Both logs begin at 0 by their own clocks.
    assert tracking["offset"] == pytest.approx(0, abs=1e-6)
    assert max(abs(joint["largest_error"]) for joint in tracking["joints"]) < 1e-6
    assert said["motions"][0]["planned"] == "/js_desired"


def test_topics(strange: Path) -> None:
    """Topics can be named, and a wrong name is answered by the nearest."""
    swapped = armwright("replay", strange, "--measured-topic", "/js_desired", "--planned-topic", "/js", "--json")
    delay = json.loads(swapped.stdout)["motions"][0]["tracking"]["delay"]
    assert delay == pytest.approx(-0.018, abs=1e-5)
    wrong = armwright("replay", strange, "--planned-topic", "/jsdesired")
    assert wrong.returncode != 0
    assert "no topic '/jsdesired'. Did you mean '/js_desired'?" in wrong.stderr


def test_arm_and_cell(strange: Path) -> None:
    """Either the arm or its cell is named."""
    done = armwright("replay", strange, "--arm", "ur5", "--cell", EXAMPLES / "puma_cell.toml")

    assert done.returncode == 2


def test_no_log() -> None:
    """A file that is none is refused in one line."""
    done = armwright("replay", EXAMPLES / "puma_points.csv")

    assert done.returncode == ExitStatus.FILE
    assert done.stderr.count("\n") == 1
    assert "expected an MCAP file or a .db3 of ROS 2" in done.stderr


def test_results_beside_the_log(tmp_path: Path) -> None:
    """A log is not removed as an older result of the folder in which it is replayed."""
    assert armwright("run", *RUN, "-o", tmp_path / "out", "--log", "mcap", "-q").returncode == 0

    done = armwright("replay", tmp_path / "out" / "log.mcap", "-o", tmp_path / "out")

    assert done.returncode != 0
    assert "log.mcap" in done.stderr
    assert (tmp_path / "out" / "log.mcap").exists()
