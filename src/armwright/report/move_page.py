"""The page of a move through poses: the moving arm, the poses, and the charts of its joints."""

from collections.abc import Iterable, Iterator

import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.kinematics.forward_kinematics import forward
from armwright.motion.detour import Detour
from armwright.motion.limited import by_joint, limited_efforts
from armwright.motion.moves import Move
from armwright.motion.poses_file import PosesFile
from armwright.motion.trajectory import Samples
from armwright.report.animation import Animation, FrameTrack
from armwright.report.arm_figure import Placed, arm_figure
from armwright.report.page import Effect, Message, RunPage, StageBadge, StageRow
from armwright.report.shape_table import ShapeTable
from armwright.report.stick_figure import arm_record
from armwright.spatial.poses import to_noap
from armwright.version import __version__

# Samples of the path of the tool from pose to pose.
_SAMPLES = 200
# Instants of the animation: for a short move, bounds per second, and at most.
_INSTANTS, _FPS, _MAX_FRAMES = 240, (30.0, 60.0), 1200
_ARM = "ARM"


def move_page(
    move: Move,
    file: PosesFile,
    samples: Samples,
    tau: Array,
    *,
    title: str,
    name: str,
    command: str,
    notes: Iterable[str],
) -> RunPage:
    """Return the page of a move.

    Args:
        move: the move.
        file: the file of its poses.
        samples: the motion at the ticks of a servo.
        tau: (k, n) efforts at the samples, drives included [N m] or [N]; those of an arm without masses are left out.
        title: heading of the page.
        name: name of the file of the poses.
        command: the command line.
        notes: warnings and remarks.
    """
    known = None if move.arm.massless else tau
    motion = (samples.times, samples.q, samples.qd, samples.qdd, known)
    return RunPage(
        title=title,
        program_name=name,
        program_text=file.text,
        text_kind="Poses",
        cell_name="",
        generated_by=f"armwright {__version__}",
        command=command,
        duration=move.trajectory.duration,
        messages=[Message(severity="note", text=note) for note in notes],
        effects=list(_effects(move, file)),
        stages=list(_stages(move, file, samples, known)),
        arms=[arm_record(_ARM, move.arm, motion)],
        animation=_animation(move, file),
    )


def _effects(move: Move, file: PosesFile) -> Iterator[Effect]:
    for i, (name, t, line) in enumerate(zip(file.names, move.times.tolist(), file.lines, strict=True)):
        distance = move.passing_distances[i]
        how = f"with a deviation of {distance * 1e3:.1f} mm" if move.tool_path else "approximately"
        yield Effect(
            t0=t, t1=t, line=line, text=f"pose {name} {'reached' if distance == 0 else f'passed {how}'}", arm=_ARM
        )


def _effort_shares(arm: Arm, tau: Array) -> Array:
    """Return (n,) the largest part of its limit of effort of each joint, or its drive, from efforts (k, n)."""
    return by_joint(arm, np.abs(limited_efforts(arm, tau)).max(axis=0) / arm.all_limits.effort)


def _stages(move: Move, file: PosesFile, samples: Samples, tau: Array | None) -> Iterator[StageRow]:
    for i, (t0, t1) in enumerate(zip(move.times[:-1].tolist(), move.times[1:].tolist(), strict=True)):
        hand = forward(move.arm, move.trajectory(np.linspace(t0, t1, _SAMPLES)))[:, :3, 3]
        during = (samples.times >= t0 - 1e-12) & (samples.times <= t1 + 1e-12)
        if not during.any():  # a segment shorter than a tick
            from_middle = np.abs(samples.times - (t0 + t1) / 2)
            during = from_middle == from_middle.min()
        detour = move.detours[i] if move.detours else None
        yield StageRow(
            t0=t0,
            t1=t1,
            line=file.lines[i + 1],
            arm=_ARM,
            kind="HAND" if move.tool_path or detour else "JOINT",
            to=(file.names[i + 1],),
            speed=100.0,
            peak_speed=np.abs(samples.qd[during]).max(axis=0).tolist(),
            peak_effort=None if tau is None else np.abs(tau[during]).max(axis=0).tolist(),
            effort_share=None if tau is None else _effort_shares(move.arm, tau[during]).tolist(),
            hand_length=float(np.linalg.norm(np.diff(hand, axis=0), axis=-1).sum()),
            deviation=detour.price.distance if detour else move.certificate.deviation if move.certificate else None,
            badges=[_detour_badge(detour)] if detour and detour.method != "line" else [],
        )


def _detour_badge(detour: Detour) -> StageBadge:
    return StageBadge(text=f"detour {detour.method}", title=f"by {detour.method}: {detour.price}", mark="warn")


def _animation(move: Move, file: PosesFile) -> Animation:
    duration = move.trajectory.duration
    fps = min(max(_INSTANTS / duration, _FPS[0]), _FPS[1], _MAX_FRAMES / duration)
    t = np.append(np.arange(int(np.ceil(duration * fps))) / fps, duration)
    shapes = ShapeTable()
    figure = arm_figure(_ARM, Placed(move.arm), move.trajectory(t), None, shapes)
    tracks = [
        FrameTrack(name=name, poses=to_noap(np.tile(X, (len(t), 1, 1))))
        for name, X in zip(file.names, move.poses, strict=True)
    ]
    return Animation(fps=fps, t=t, arms={_ARM: figure}, frames=tracks, shapes=shapes.as_data())
