"""The numbers above a run, when joints are at their limits, and remarks of stages."""

import attrs
import numpy as np
import pytest

from armwright.arm.limits import JointLimits
from armwright.report.elements import Tile, headline
from armwright.report.headline import run_headline
from armwright.report.limit_spans import LimitSpan, limit_spans
from armwright.report.page import LeastDistance, RunPage


def figures(data: RunPage) -> dict[str, Tile]:
    return {figure.label.split(",")[0]: figure for figure in run_headline(data)}


def limits(**changes: float) -> JointLimits:
    free = {"lower": -np.inf, "upper": np.inf, "speed": np.inf, "acceleration": np.inf, "effort": np.inf}
    return JointLimits(**{name: np.full(2, value) for name, value in {**free, **changes}.items()})


def test_numbers_of_a_run(bench: RunPage) -> None:
    """Cycle time, the effort nearest to its limit with its joint, the largest deviation, and no limit reached."""
    shown = figures(bench)
    shares = [
        (effort / joint.effort, stage.arm, joint.name)
        for stage in bench.stages
        for effort, joint in zip(np.asarray(stage.peak_effort), bench.arms[0].joints, strict=True)
    ]
    share, arm, joint = max(shares)

    assert shown["cycle time"].value == "9.00 s"
    assert shown["peak effort"].value == f"{100 * share:.0f} %"
    assert shown["peak effort"].label == f"peak effort, {arm} {joint}"
    assert shown["largest path deviation"].value == "0.34 mm"
    assert shown["limits reached"] == Tile("none", "limits reached")
    assert "least distance" not in shown
    failed = figures(attrs.evolve(bench, status="failed: E406 at 8.9 s"))
    assert failed["until the failure"] == Tile("9.00 s", "until the failure", "failed: E406 at 8.9 s")


def test_the_least_distance(bench: RunPage) -> None:
    """The smallest of all stages is told with its bodies, and marked where it is smaller than wanted."""
    near = [LeastDistance(distance=d, bound=d, bodies=("A", "B"), t=1.5) for d in (0.012, 0.004)]
    far = LeastDistance(distance=None, bound=0.05, bodies=(), t=0.0)
    clearances = [far, *near, None, None]
    stages = [attrs.evolve(one, clearance=it) for one, it in zip(bench.stages, clearances, strict=True)]
    run = attrs.evolve(bench, stages=stages, clearance=0.005)

    assert figures(run)["least distance"] == Tile("4.0 mm", "least distance", "A – B, at 1.50 s", "warn")
    assert figures(attrs.evolve(run, clearance=0.001))["least distance"].mark == ""
    only_far = attrs.evolve(run, stages=[attrs.evolve(one, clearance=far) for one in bench.stages])
    assert figures(only_far)["least distance"].value == "> 50 mm"


def test_limits_reached_and_exceeded(bench: RunPage) -> None:
    """Which limits of which joints are reached; what is beyond a limit is told instead."""
    at = LimitSpan(t0=1.0, t1=1.5, joint=3, limit="acceleration", share=1.0)
    beyond = attrs.evolve(at, joint=1, limit="speed", share=1.2)
    first, second = bench.arms

    reached = figures(attrs.evolve(bench, arms=(attrs.evolve(first, at_limits=[at, at]), second)))["limits reached"]
    assert (reached.value, reached.mark) == ("ARM_1 acc j4", "warn")
    exceeded = figures(attrs.evolve(bench, arms=(first, attrs.evolve(second, at_limits=[at, beyond]))))
    assert (exceeded["limits exceeded"].value, exceeded["limits exceeded"].mark) == ("ARM_2 speed j2", "bad")


def test_figures_are_text() -> None:
    """Whatever stands in a number or its name is no element of the page."""
    text = headline([Tile("<b>", '"x"', "<i>", "bad")])
    assert text.count("<b>") == 1
    assert "&lt;b&gt;" in text
    assert 'title="&lt;i&gt;"' in text
    assert 'class="figure bad"' in text


def test_when_a_joint_is_at_its_limit() -> None:
    """A joint that is fast twice is at its limit in two spans, from the first instant to the last of each."""
    t = np.linspace(0.0, 10.0, 1001)
    qd = np.zeros((1001, 2))
    qd[100:201, 1], qd[800:851, 1], qd[:, 0] = 2.0, -2.0, 1.98
    zero = np.zeros_like(qd)
    spans = list(limit_spans(limits(speed=2.0), (t, zero, qd, zero, None)))

    assert [(one.joint, one.limit, one.share) for one in spans] == [(1, "speed", 1.0)] * 2
    np.testing.assert_allclose([(one.t0, one.t1) for one in spans], [(1.0, 2.0), (8.0, 8.5)])


@pytest.mark.parametrize("end", [-1.0, 2.0])
def test_at_the_end_of_the_range(end: float) -> None:
    """Both ends of the range of a joint are limits."""
    t = np.linspace(0.0, 1.0, 101)
    q = np.linspace([0.0, 0.0], [end, 0.0], 101)
    zero = np.zeros_like(q)
    (span,) = limit_spans(limits(lower=-1.0, upper=2.0), (t, q, zero, zero, zero))

    assert (span.joint, span.limit, span.t1) == (0, "position", 1.0)
    assert span.share == pytest.approx(1.0)


def test_without_limits() -> None:
    """Where nothing is limited no limit is reached, and a single instant is no trouble."""
    rows = np.full((3, 2), 1e9)
    assert list(limit_spans(limits(), (np.arange(3.0), rows, rows, rows, rows))) == []
    one = np.ones((1, 2))
    found = limit_spans(limits(effort=1.0), (np.zeros(1), one, one, one, one))
    assert [(span.t0, span.t1) for span in found] == [(0.0, 0.0)] * 2
