"""A bench with two elbow arms, computed here by hand: what the page of a run is tried on."""

import math
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from armwright.arrays import Array
from armwright.report.animation import Animation, ArmFigure, Body, ChainJoint, FrameTrack, TreeChange
from armwright.report.page import ArmRecord, Effect, JointInfo, Message, RunPage, StageBadge, StageRow, run_page

FPS = 25.0
SHOULDER, UPPER, FORE, HAND = 0.42, 0.43, 0.40, 0.14
SLOWED = StageBadge(
    text="speed j2", title="1.20 times slower, limited by the speed of joint 2", mark="warn", factor=1.2
)
PROGRAM = """\
{ Carry a part from the feeder to the fixture;
  the second arm looks on and then makes room. }
VAR part, fixture, above : FRAME ;
    up : TRANS ;
BEGIN
    up = (1,0,0, 0,1,0, 0,0,1, 0,0,-0.10) ;
    AFFIX above TO part AT up ;
    MOVE ARM_1 TO part WITH APPROACH = above ;
    GRASP ARM_1 ;
    AFFIX part TO ARM_1 ;
    MOVE part TO fixture VIA (above) ;  // round the corner
    OPEN ARM_1 ;
    UNFIX part FROM ARM_1 ;
    MOVE ARM_2 TO above ;
END.
"""
NAMES = ("waist", "shoulder", "elbow", "forearm roll", "wrist", "hand roll")
JOINTS = tuple(
    JointInfo(name=name, kind="revolute", lower=-reach, upper=reach, speed=speed, acceleration=9.0, effort=effort)
    for name, reach, speed, effort in zip(
        NAMES,
        (2.8, 2.4, 2.7, 3.1, 2.0, 4.6),
        (1.7, 1.7, 1.7, 2.6, 2.3, 2.4),
        (98.0, 186.0, 89.0, 24.0, 20.0, 21.0),
        strict=True,
    )
)


def angles_of(places: Array) -> Array:
    """Return the joint angles (N, 6) that hold the hand down at places (N, 3) in the base of the arm."""
    x, y, z = places.T
    out, high = np.hypot(x, y), z + HAND - SHOULDER
    bend = -np.arccos((out**2 + high**2 - UPPER**2 - FORE**2) / (2 * UPPER * FORE))
    lift = np.arctan2(high, out) - np.arctan2(FORE * np.sin(bend), UPPER + FORE * np.cos(bend))
    waist = np.arctan2(y, x)
    return np.stack([waist, lift, bend, 0 * x, -math.pi / 2 - lift - bend, waist], axis=-1)


SHAPES = (
    {"kind": "capsule", "radius": 0.045, "length": 0.42},
    {"kind": "cylinder", "radius": 0.06, "length": 0.1},
    {"kind": "box", "size": [0.02, 0.012, 0.09]},
)


def figure_of(q: Array, base: Array, turn: float, grip: Array) -> ArmFigure:
    """Draw the arm at angles (M, 6), its base at a place and turned about the vertical."""
    straight = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
    to_side = (1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, -1.0, 0.0)
    behind = (
        (*to_side, 0.0, 0.0, 0.0),
        (*straight, UPPER, 0.0, 0.0),
        (*straight, FORE, 0.0, 0.0),
        (*straight, 0.0, 0.0, 0.0),
        (0.0, -1.0, 0.0, 0.0, 0.0, -1.0, 1.0, 0.0, 0.0, HAND, 0.0, 0.0),
        (*straight, 0.0, 0.0, 0.0),
    )
    joints = [
        ChainJoint(revolute=True, theta=0.0, d=SHOULDER if i == 0 else 0.0, behind=np.array(row))
        for i, row in enumerate(behind)
    ]
    along_x = (0.0, 0.0, -1.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0)
    bodies = [
        Body(name="column", shape=0, pose=np.array((*straight, 0.0, 0.0, SHOULDER / 2)), frame=0, tint="base"),
        Body(name="upper", shape=0, pose=np.array((*along_x, -UPPER / 2, 0.0, 0.0)), frame=2, tint="link"),
        Body(name="fore", shape=0, pose=np.array((*along_x, -FORE / 2, 0.0, 0.0)), frame=3, tint="link"),
        Body(name="elbow", shape=1, pose=np.array((*straight, 0.0, 0.0, 0.0)), frame=2, tint="joint"),
        Body(name="finger", shape=2, pose=np.array((*straight, 0.0, -0.006, -0.03)), frame=7, tint="joint", slide=-1),
        Body(name="finger", shape=2, pose=np.array((*straight, 0.0, 0.006, -0.03)), frame=7, tint="joint", slide=1),
    ]
    c, s = math.cos(turn), math.sin(turn)
    return ArmFigure(
        q=q,
        base=np.array((c, s, 0.0, -s, c, 0.0, 0.0, 0.0, 1.0, *base)),
        joints=joints,
        tool=np.array((*straight, 0.0, 0.0, 0.0)),
        bodies=bodies,
        grip=grip,
        opening=0.08,
    )


def smooth(s: Array) -> Array:
    """Return the quintic that starts and ends at rest."""
    return s**3 * (10 - 15 * s + 6 * s**2)


def record_of(name: str, t: Array, places: Array, base: Array, turn: float) -> ArmRecord:
    """Make the record of an arm whose hand goes through places (N, 3) in its base."""
    q = angles_of(places)
    qd = np.gradient(q, t, axis=0)
    qdd = np.gradient(qd, t, axis=0)
    weight = np.stack([0 * t, 62 * np.cos(q[:, 1]), 21 * np.cos(q[:, 1] + q[:, 2]), 0 * t, 1.5 + 0 * t, 0 * t], axis=-1)
    tau = qdd * (6.0, 7.0, 2.5, 0.3, 0.4, 0.2) + weight
    rotation = np.array([[math.cos(turn), -math.sin(turn), 0], [math.sin(turn), math.cos(turn), 0], [0, 0, 1]])
    return ArmRecord(
        name=name, model="elbow", joints=JOINTS, t=t, q=q, qd=qd, qdd=qdd, tau=tau, hand=places @ rotation.T + base
    )


def knots(t: Array, plan: list[tuple[float, float, tuple[float, ...]]], start: tuple[float, ...]) -> Array:
    """Go from place to place, at rest at each; a plan is (t0, t1, goal)."""
    places = np.broadcast_to(start, (len(t), 3)).copy()
    for t0, t1, goal in plan:
        from_here = places[np.searchsorted(t, t0)].copy()
        s = smooth(np.clip((t - t0) / (t1 - t0), 0, 1))[:, None]
        places = np.where(t[:, None] >= t0, from_here + s * (np.array(goal) - from_here), places)
    return places


def stage_of(record: ArmRecord, t0: float, t1: float, kind: Any, to: tuple[str, ...], **more: Any) -> StageRow:
    """Measure one stage on the record."""
    rows = (record.t >= t0) & (record.t <= t1)
    length = float(np.linalg.norm(np.diff(record.hand[rows], axis=0), axis=1).sum())
    return StageRow(
        t0=t0,
        t1=t1,
        arm=record.name,
        kind=kind,
        to=to,
        speed=100.0,
        peak_speed=np.abs(record.qd[rows]).max(axis=0),
        peak_effort=np.abs(record.tau[rows]).max(axis=0),
        effort_share=np.abs(record.tau[rows]).max(axis=0) / [joint.effort for joint in record.joints],
        hand_length=length,
        **more,
    )


def bench_run() -> RunPage:
    """Return a run of two arms with five stages, as the interpreter would describe it."""
    t = np.linspace(0.0, 9.0, 901)
    part, fixture, over, corner = (0.42, 0.22, 0.05), (0.46, -0.24, 0.05), (0.42, 0.22, 0.16), (0.56, -0.02, 0.24)
    plan = [(0.0, 1.6, over), (1.6, 2.3, part), (2.5, 3.8, corner), (3.8, 5.1, fixture)]
    first = record_of("ARM_1", t, knots(t, plan, (0.40, 0.0, 0.35)), np.zeros(3), 0.0)
    second_base = np.array((1.10, 0.0, 0.0))
    second = record_of(
        "ARM_2", t, knots(t, [(5.3, 8.8, (0.60, -0.20, 0.22))], (0.40, 0.05, 0.30)), second_base, math.pi
    )
    stages = (
        stage_of(first, 0.0, 1.6, "PTP", ("above",), line=8),
        stage_of(first, 1.6, 2.3, "LINE", ("part",), line=8, deviation=0.00021),
        stage_of(first, 2.5, 3.8, "SPLINE", ("above", "fixture"), line=11, badges=(SLOWED,)),
        stage_of(first, 3.8, 5.1, "LINE", ("fixture",), line=11, deviation=0.00034),
        stage_of(second, 5.3, 8.8, "PTP", ("above",), line=14),
    )
    effects = (
        Effect(t0=0, t1=0, line=6, text="up = (0, 0, -0.10)"),
        Effect(t0=0, t1=0, line=7, text="AFFIX above -> part"),
        Effect(t0=0, t1=2.3, line=8, text="ARM_1 MOVE: PTP above; LINE part @100"),
        Effect(t0=2.3, t1=2.5, line=9, text="ARM_1 GRASP"),
        Effect(t0=2.5, t1=2.5, line=10, text="AFFIX part -> ARM_1"),
        Effect(t0=2.5, t1=5.1, line=11, text="ARM_1 [part] MOVE: SPLINE above fixture @100"),
        Effect(t0=5.1, t1=5.3, line=12, text="ARM_1 OPEN"),
        Effect(t0=5.3, t1=5.3, line=13, text="UNFIX part"),
        Effect(t0=5.3, t1=8.8, line=14, text="ARM_2 MOVE: PTP above @100"),
    )
    return RunPage(
        title="Feeder to fixture",
        program_name="bench.rlo",
        program_text=PROGRAM,
        cell_name="bench.toml",
        generated_by="armwright 0.1.0",
        command="armwright run bench.rlo --cell bench.toml --report run.html",
        duration=9.0,
        messages=(
            Message(severity="warning", code="W203", line=10, text="'part' is still attached to WORLD"),
            Message(severity="note", text="two arms, one clock"),
        ),
        effects=effects,
        stages=stages,
        arms=(first, second),
        animation=animate(first, second, second_base),
    )


def animate(first: ArmRecord, second: ArmRecord, second_base: Array) -> Animation:
    """Sample both arms at the instants of the animation, the part hanging on the first from 2.5 s to 5.3 s."""
    t = np.arange(0, 9.0 + 1e-9, 1 / FPS)
    rows = np.searchsorted(first.t, t - 1e-9)
    grip = np.clip(np.where(t < 4, (2.5 - t) / 0.2, (t - 5.1) / 0.2), 0, 1)
    down = np.array((1, 0, 0, 0, -1, 0, 0, 0, -1), dtype=float)
    lies = first.hand[rows[np.searchsorted(t, 2.4)]]
    place = np.where(t[:, None] < 2.5, lies, first.hand[rows])

    def track(places: Array) -> Array:
        return np.concatenate([np.broadcast_to(down, (len(t), 9)), np.broadcast_to(places, (len(t), 3))], axis=-1)

    frames = (
        FrameTrack(name="part", poses=track(place)),
        FrameTrack(name="above", poses=track(place + np.array((0, 0, 0.11)))),
        FrameTrack(name="fixture", poses=track(np.array((0.46, -0.24, 0.05))), visible_from=10),
    )
    tree = tuple(
        TreeChange(t=when, child=child, parent=parent)
        for when, child, parent in (
            (0, "ARM_1", "WORLD"),
            (0, "ARM_2", "WORLD"),
            (0, "part", "WORLD"),
            (0, "above", "part"),
            (0, "fixture", "WORLD"),
            (2.5, "part", "ARM_1"),
            (5.3, "part", "WORLD"),
        )
    )
    arms = {
        "ARM_1": figure_of(first.q[rows], np.zeros(3), 0.0, grip),
        "ARM_2": figure_of(second.q[rows], second_base, math.pi, np.ones(len(t))),
    }
    return Animation(fps=FPS, t=t, arms=arms, frames=frames, tree=tree, shapes=SHAPES)


@pytest.fixture(scope="session")
def bench() -> RunPage:
    return bench_run()


@lru_cache(maxsize=4)
def page_text(data: RunPage) -> str:
    """Return the page of a run, made once for the tests that open the same."""
    return run_page(data)


class Visit:
    """An opened page, and everything it complained about or asked the network for."""

    def __init__(self, page: Any, file: Path, data: RunPage) -> None:
        file.write_text(page_text(data), encoding="utf-8")
        self.complaints: list[str] = []
        self.requests: list[str] = []
        self.page = page
        self._heard = {
            "console": lambda message: self.complaints.append(message.text),
            "pageerror": lambda error: self.complaints.append(str(error)),
            "request": lambda request: self.requests.append(request.url),
        }
        for event, hear in self._heard.items():
            page.on(event, hear)
        self.url = file.as_uri()
        page.goto(self.url)

    def leave(self) -> None:
        """Hear nothing more of the page, and go elsewhere."""
        for event, hear in self._heard.items():
            self.page.remove_listener(event, hear)
        self.page.emulate_media(media="screen")
        self.page.goto("about:blank")

    def state(self) -> dict[str, Any]:
        """Ask the page where it stands."""
        return dict(self.page.evaluate("armwright.state()"))

    def seek(self, t: float) -> None:
        """Move the slider as a hand does."""
        self.page.evaluate(
            "t => { const s = document.getElementById('time'); s.value = t; s.dispatchEvent(new Event('input')); }", t
        )

    def until(self, question: str) -> None:
        """Wait until the page answers yes, ten seconds at most; its policy forbids to wait inside of it."""
        for _ in range(500):
            if self.page.evaluate(question):
                return
            self.page.wait_for_timeout(20)
        raise TimeoutError(question)

    def pixels(self) -> str:
        """Return what the view shows, as the text of a picture."""
        return str(self.page.evaluate("document.getElementById('view').toDataURL()"))


WINDOW = {"width": 1280, "height": 800}


@pytest.fixture(scope="module")
def window(browser) -> Iterator[Any]:
    """Open a window in which the pages of a module are visited one after the other."""
    context = browser.new_context(viewport=WINDOW)
    yield context.new_page()
    context.close()


@pytest.fixture
def visit(browser, window, tmp_path) -> Iterator[Any]:
    """Return what opens a page: the first of a test in the window of the module, others in windows of their own."""
    visits: list[Visit] = []
    contexts: list[Any] = []

    def open_page(data: RunPage, **context: Any) -> Visit:
        page = window
        if visits or context:
            contexts.append(browser.new_context(**{"viewport": WINDOW, **context}))
            page = contexts[-1].new_page()
        visits.append(Visit(page, tmp_path / f"run{len(visits)}.html", data))
        return visits[-1]

    yield open_page
    for each in visits:
        each.leave()
    window.set_viewport_size(WINDOW)
    for context in contexts:
        context.close()
