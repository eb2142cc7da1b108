"""The numbers that stand above a run: how long it took, and how near it came to what limits it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from armwright.report.elements import Tile
from armwright.report.limit_spans import SHORT

if TYPE_CHECKING:
    from armwright.report.page import ArmRecord, RunPage, StageRow

# Limits that are named; others are counted.
_NAMED = 2
# Rounding beyond a limit is none.
_TOLERANCE = 1e-6


def run_headline(data: RunPage) -> Iterator[Tile]:
    """Yield the numbers of a run that are known.

    Args:
        data: of its page.
    """
    finished = data.status == "finished"
    yield Tile(f"{data.duration:.2f} s", "cycle time" if finished else "until the failure", data.status)
    arms = {arm.name: arm for arm in data.arms}
    yield from _peak_effort(data, arms)
    yield from _tracking(data)
    yield from _deviation(data)
    yield from _distance(data)
    if data.arms:
        yield _limits(data)


def _peak_effort(data: RunPage, arms: dict[str, ArmRecord]) -> Iterator[Tile]:
    shares = [
        (share, stage, joint.name)
        for stage in data.stages
        if stage.effort_share is not None and stage.arm in arms
        for share, joint in zip(stage.effort_share, arms[stage.arm].joints, strict=True)
        if share > 0
    ]
    if shares:
        share, stage, joint = max(shares, key=lambda one: one[0])
        label = f"peak effort, {_of(data, stage)}{joint}"
        yield Tile(f"{share:.0%}".replace("%", " %"), label, _during(stage), "bad" if share > 1 + _TOLERANCE else "")


def _tracking(data: RunPage) -> Iterator[Tile]:
    """Yield the largest tracking error of revolute joints."""
    worst = [
        (float(arm.measured.worst[j]), float(arm.measured.worst_t[j]), arm.name, joint.name)
        for arm in data.arms
        if arm.measured is not None
        for j, joint in enumerate(arm.joints)
        if joint.kind == "revolute"
    ]
    if worst:
        error, t, arm, joint = max(worst)
        yield Tile(f"{error * 1e3:.2f} mrad", f"largest tracking error, {joint}", f"{arm} at {t:.2f} s")


def _deviation(data: RunPage) -> Iterator[Tile]:
    """Yield the largest deviation from a line; from paths past frames, whose corners are rounded, only without one."""
    known = [(stage.deviation, i) for i, stage in enumerate(data.stages) if stage.deviation is not None]
    stages = [one for one in known if data.stages[one[1]].kind in {"LINE", "HAND"}] or known
    if stages:
        deviation, i = max(stages)
        yield Tile(f"{deviation * 1e3:.2f} mm", "largest path deviation", _during(data.stages[i]))


def _distance(data: RunPage) -> Iterator[Tile]:
    near = [(one.distance, i) for i, stage in enumerate(data.stages) if (one := stage.clearance) and one.distance]
    near += [(0.0, i) for i, stage in enumerate(data.stages) if (one := stage.clearance) and one.distance == 0]
    if near:
        distance, i = min(near)
        clearance = data.stages[i].clearance
        assert clearance is not None  # noqa: S101 - it has a distance
        mark = "warn" if distance < data.clearance or distance <= 0 else ""
        bodies = " – ".join(clearance.bodies)
        yield Tile(f"{distance * 1e3:.1f} mm", "least distance", f"{bodies}, at {clearance.t:.2f} s", mark)
        return
    bounds = [stage.clearance.bound for stage in data.stages if stage.clearance is not None]
    if bounds:
        yield Tile(f"> {min(bounds) * 1e3:.0f} mm", "least distance")


def _limits(data: RunPage) -> Tile:
    """Return which limits joints reach, and of which joints."""
    several = len(data.arms) > 1
    shares: dict[str, float] = {}
    for arm in data.arms:
        for span in arm.at_limits:
            name = f"{arm.name + ' ' if several else ''}{SHORT[span.limit]} j{span.joint + 1}"
            shares[name] = max(span.share, shares.get(name, 0.0))
    beyond = [name for name, share in shares.items() if share > 1 + _TOLERANCE]
    names = beyond or list(shares)
    if not names:
        return Tile("none", "limits reached")
    shown = ", ".join(names) if len(names) <= _NAMED else f"{len(names)}"
    title = ", ".join(f"{name} {shares[name]:.0%}" for name in names)
    return Tile(shown, "limits exceeded" if beyond else "limits reached", title, "bad" if beyond else "warn")


def _of(data: RunPage, stage: StageRow) -> str:
    return f"{stage.arm} " if len(data.arms) > 1 else ""


def _during(stage: StageRow) -> str:
    return f"{stage.kind} to {', '.join(stage.to)}, {stage.t0:.2f} to {stage.t1:.2f} s"
