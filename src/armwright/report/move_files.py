"""The files of a planned move: its motion as a table, its numbers, a page and figures."""

import json
from collections.abc import Sequence
from typing import Any

from armwright.dynamics.newton_euler import inverse_dynamics
from armwright.kinematics.forward_kinematics import forward
from armwright.motion.move_assessment import MoveAssessment
from armwright.motion.poses_file import PosesFile
from armwright.report.motion_table import motion_csv
from armwright.report.move_figures import joint_panels, panels, path_figure, tool_panels
from armwright.report.move_page import move_page
from armwright.report.page import run_page


def move_files(
    assessment: MoveAssessment, file: PosesFile, *, name: str, period: float, command: str, notes: Sequence[str]
) -> dict[str, Any]:
    """Return the files of a move by name.

    Args:
        assessment: of the move.
        file: the file of its poses.
        name: name of that file.
        period: servo period [s].
        command: the command line that made the move.
        notes: warnings and remarks.
    """
    move = assessment.move
    samples = move.trajectory.sampled(period)
    t = samples.times
    tau = inverse_dynamics(move.arm, samples.q, samples.qd, samples.qdd)
    X = forward(move.arm, samples.q)
    title = file.title or f"{move.arm.name} through {name}"
    times = dict(zip(file.names, move.times.tolist(), strict=True))
    positions = {pose: X_BT[:3, 3] for pose, X_BT in zip(file.names, move.poses, strict=True)}
    joints = joint_panels(samples, [joint.revolute for joint in move.arm.joints])
    page = move_page(move, file, samples, tau, title=title, name=name, command=command, notes=notes)
    return {
        "motion.csv": motion_csv(t, samples.q, samples.qd, samples.qdd, tau),
        "move.json": json.dumps(assessment.as_data(), indent=2, ensure_ascii=False) + "\n",
        "joints.svg": panels(f"{title}: joints", t, joints, marks=times),
        "hand.svg": panels(f"{title}: tool", t, tool_panels(t, X), marks=times, columns=2),
        "path.svg": path_figure(f"{title}: path of the tool, approach vectors", X, positions),
        "report.html": run_page(page),
    }
