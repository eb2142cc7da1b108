"""The programs of RLO-2 in the conformance corpus at work: traces, stages, final frames."""

import numpy as np
import pytest

from armwright.cell.frames import WORLD
from armwright.kinematics.forward_kinematics import forward
from armwright.program.vm.recording import Recording
from program.running import EXACT, cell_of, corpus_text, down, expect, printed, run


def test_palletise() -> None:
    """P05: six cycles in the order of the slots; only lengths are scaled by UNITS MM, not rotations."""
    recording = run(corpus_text("p05"))

    trace = [line for line in recording.trace() if not line.startswith("AFFIX slot") and "apfeed ->" not in line]
    cycles = [
        [
            "ARM_1 OPEN",
            "ARM_1 MOVE: PTP apfeed; LINE feeder @100",
            "ARM_1 GRASP",
            "AFFIX part -> ARM_1",
            f"ARM_1 [part] MOVE: LINE apfeed; PTP above; LINE slot[{row},{column}] @80",
            "ARM_1 OPEN",
            "UNFIX part",
            "ARM_1 MOVE: LINE above @100",
        ]
        for row in (1, 2)
        for column in (1, 2, 3)
    ]
    assert trace == [line for cycle in cycles for line in cycle]
    for row in (1, 2):
        for column in (1, 2, 3):
            place = down(0.40 + 0.08 * (row - 1), -0.20 + 0.06 * (column - 1), 0.04)
            np.testing.assert_allclose(recording.tree.world(f"SLOT[{row},{column}]"), place, atol=EXACT)
    expect(recording, PART=down(0.48, -0.08, 0.04), ARM_1=down(0.48, -0.08, 0.14))
    assert recording.tree.parent("PART") == WORLD


def test_weld() -> None:
    """P06: two passes, the second 2 mm higher; the seam at speed 20 takes five times what it takes at 100."""
    recording = run(corpus_text("p06"))

    trace = [line for line in recording.trace() if not line.startswith("AFFIX")]
    one = [
        "ARM_1 [tip] MOVE: PTP apst; LINE start @100",
        "torch ON",
        "ARM_1 [tip] MOVE: LINE finish @20",
        "torch OFF",
        "ARM_1 [tip] MOVE: LINE finish * XYZ(0, 0, -0.08); PTP clear @100",
    ]
    assert trace == one * 2
    assert recording.tree.world("SEAM")[2, 3] == pytest.approx(0.024, abs=EXACT)
    expect(recording, TIP=down(0.45, 0, 0.12))
    assert recording.tree.world("ARM_1")[2, 3] == pytest.approx(0.24, abs=EXACT)
    fast = run(corpus_text("p06").replace("SPEED = 20", "SPEED = 100"))
    slow_leg, fast_leg = (
        next(stage for stage in one.stages if stage.goal_names == ("finish",)) for one in (recording, fast)
    )
    peaks = []
    for leg in (slow_leg.stage, fast_leg.stage):
        t = np.linspace(0.0, leg.trajectory.duration, 4001)
        hand = forward(recording.cell.arms["ARM_1"].arm, leg.trajectory(t))[:, :3, 3]
        peaks.append(np.linalg.norm(np.diff(hand, axis=0), axis=-1).max() / t[1])
    assert peaks[1] / peaks[0] == pytest.approx(5, rel=0.01)  # the ramps are those of the joints, whatever the speed
    assert 4.8 < slow_leg.stage.trajectory.duration / fast_leg.stage.trajectory.duration < 5


@pytest.mark.parametrize(
    ("cell", "height", "hit", "says"),
    [
        ("jam", 0.045, True, ["jammed, metres short: 0.024"]),
        ("seat", 0.022, True, ["seated"]),
        ("cell1", 0.02, False, ["seated"]),
    ],
)
def test_peg(cell: str, height: float, hit: bool, says: list[str]) -> None:  # noqa: FBT001
    """P07: the guarded move stops on the plane; how deep it came decides what is done next."""
    recording = run(corpus_text("p07"), cell_of(cell))

    assert printed(recording)[0][: len(says[0])] == says[0]
    guarded = next(effect for effect in recording.effects if "LINE floor" in effect.text)
    assert guarded.text.partition("; pressed")[0] == "ARM_1 [peg] MOVE: LINE floor @5" + ("; halted" if hit else "")
    peg = recording.tree.world("PEG")[2, 3]
    if cell == "jam":
        assert recording.tree.parent("PEG") == "ARM_1"
        assert peg == pytest.approx(0.06, abs=EXACT)
    else:
        assert recording.tree.parent("PEG") == WORLD
        # 8 N at 20 N/mm are 0.4 mm; at this speed the peg goes less than 0.2 mm on while it is stopped.
        depth = height - peg
        assert (0.4e-3 < depth < 0.6e-3) if hit else depth == pytest.approx(0, abs=EXACT)
        assert guarded.data.get("contact", {}).get("depth", 0.0) == pytest.approx(depth, abs=EXACT)
    expect(recording, ARM_1=down(0.50, 0.10, 0.11))


@pytest.fixture(scope="module")
def two_arms() -> Recording:
    return run(corpus_text("p08"), cell_of("cell2"))


def test_hand_over_order(two_arms: Recording) -> None:
    """P08: the part is brought before it is fetched, and fetched before the first arm goes on."""
    trace = two_arms.trace()
    order = [
        "ARM_1 MOVE: PTP part @100",
        "ARM_1 GRASP",
        "AFFIX part -> ARM_1",
        "ARM_1 [part] MOVE: PTP meet @100",
        "UNFIX part",
        "ARM_1 MOVE: PTP wait1 @100",
        "SIGNAL brought",
        "ARM_2 MOVE: PTP apm; LINE meet @100",
        "ARM_2 GRASP",
        "AFFIX part -> ARM_2",
        "ARM_2 [part] MOVE: LINE apm; PTP apb; LINE bin @100",
        "SIGNAL taken",
    ]
    places = [trace.index(line) for line in order]
    assert places == sorted(places)
    ends = {one.text: one.t1 for one in two_arms.effects if one.kind in ("SIGNAL", "WAIT")}
    assert ends["WAIT brought"] == pytest.approx(ends["SIGNAL brought"])
    assert ends["WAIT taken"] == pytest.approx(ends["SIGNAL taken"])
    assert trace[-1] == "ARM_2 MOVE: LINE apb; PTP wait2 @100"


def test_hand_over_end(two_arms: Recording) -> None:
    """P08: the part is in the bin, cut loose, and both arms are where they wait."""
    expect(two_arms, PART=down(0.70, -0.20, 0.05), ARM_1=down(0.40, 0.20, 0.20), ARM_2=down(0.75, 0.15, 0.20))
    assert two_arms.tree.parent("PART") == WORLD


def test_hand_over_in_parallel(two_arms: Recording) -> None:
    """P08: the second arm goes to where it waits while the first one works."""
    first = next(stage for stage in two_arms.stages if stage.arm == "ARM_1")
    second = next(stage for stage in two_arms.stages if stage.arm == "ARM_2")

    assert second.t0 < first.t1
    assert first.t0 < second.t1
