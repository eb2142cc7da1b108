"""``armwright move``: plan a motion through poses, straight in joint space or straight paths of the tool."""

import enum
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from armwright.cli.numbers import within
from armwright.cli.options import ArmName, Json, OutputFolder, QuietButWarnings
from armwright.cli.output import command_line, json_text, print_result
from armwright.cli.progress import counting
from armwright.cli.results import warn_of_stray, write_results

if TYPE_CHECKING:
    from collections.abc import Iterable

    from armwright.motion.move_assessment import MoveAssessment
    from armwright.motion.moves import Move
    from armwright.motion.poses_file import PosesFile
    from armwright.report.move_page import PlannedMove

# Bounds of the options [ms], [mm].
_PERIOD_MS, _DEVIATION_MM = (0.01, 1000.0), (1e-4, 100.0)


class Kind(enum.StrEnum):
    """The space in which the path between poses is straight."""

    JOINT = "joint"
    CARTESIAN = "cartesian"


class Orientation(enum.StrEnum):
    """How the orientation of the tool is interpolated from pose to pose."""

    GEODESIC = "geodesic"
    ZYZ = "zyz"


class Ends(enum.StrEnum):
    """How a move begins and ends."""

    REST = "rest"
    RUNNING = "running"


class Around(enum.StrEnum):
    """The kind of detour where the arm cannot follow a straight path."""

    VIA = "via"
    DAMPED = "damped"


def move(  # noqa: PLR0917 - Typer reads one parameter per option
    kind: Annotated[
        Kind, typer.Argument(help="Space in which the path between poses is straight: joint or cartesian.")
    ],
    arm: ArmName,
    poses: Annotated[Path, typer.Argument(help="File of poses, TOML or JSON (docs/poses.md).")],
    output: OutputFolder = None,
    near: Annotated[
        str | None,
        typer.Option(help="Initial joint positions in degrees and mm, as in 10,20,30; they select the branch."),
    ] = None,
    ends: Annotated[Ends, typer.Option(help="Start and end at rest, or at full speed.")] = Ends.REST,
    orientation: Annotated[
        Orientation | None,
        typer.Option(help="Interpolation of the orientation: about a fixed axis, or of ZYZ Euler angles."),
    ] = None,
    deviation_mm: Annotated[
        float | None, typer.Option(help="Allowed path deviation of the tool; the default is 0.1.")
    ] = None,
    around: Annotated[
        Around | None,
        typer.Option(
            help="Stop at every pose; detour where a line is blocked: by a via pose, or damped least squares."
        ),
    ] = None,
    keep_limits: Annotated[
        bool, typer.Option("--keep-limits", help="Slow the motion down where the times of the file exceed limits.")
    ] = False,
    servo_ms: Annotated[float, typer.Option(help="Servo period of motion.csv.")] = 2.0,
    film: Annotated[bool, typer.Option(help="Draw move.gif, and move.mp4 where ffmpeg is installed.")] = True,
    as_json: Json = False,
    quiet: QuietButWarnings = False,
) -> None:
    """Plan a motion of an arm through the poses of a file.

    The path of a joint move is straight in joint space; the tool of a Cartesian move follows a straight path from pose
    to pose, on a single branch of the inverse kinematics, with a certified bound of its path deviation. Poses without
    times are passed as fast as the limits of speed, acceleration and effort allow. With -o the command writes
    motion.csv (every servo tick, SI), move.json, figures, report.html (a page that opens from the disk and shows the
    arm moving), and a film.

    **Example:** `armwright move joint puma560 examples/puma_poses.toml -o out/joint`
    """
    from armwright.motion.certificate import slower
    from armwright.motion.limit_utilization import ROUNDING, slowing_for_limits
    from armwright.motion.move_assessment import MoveAssessment

    _check_options(kind, orientation=orientation, deviation_mm=deviation_mm, around=around, servo_ms=servo_ms)
    planned, file = _planned(
        kind, arm, poses, near=near, ends=ends, orientation=orientation, deviation_mm=deviation_mm, around=around
    )
    notes = list(file.notes)
    factor, reason = slowing_for_limits(planned.arm, planned.trajectory)
    if reason is not None and factor > 1 + ROUNDING:
        slowing = slower(planned.arm, factor, reason)
        notes.append(f"run {slowing}" if keep_limits else f"the limits would hold {slowing}: --keep-limits does that")
        planned = planned.slowed(factor) if keep_limits else planned
    for note in notes:
        print(f"armwright: {poses}: {note}", file=sys.stderr)
    assessment = MoveAssessment(move=planned, names=file.names)
    if output is not None:
        report = _report_data(planned, file, poses, servo_ms * 1e-3, notes)
        write_results(output, _files(report, assessment, film=film, quiet=quiet))
    print_result(assessment, as_json=as_json, quiet=quiet, output=output)


def _check_options(
    kind: Kind, *, orientation: Orientation | None, deviation_mm: float | None, around: Around | None, servo_ms: float
) -> None:
    """Refuse options out of range, and those that do not belong to the kind of move."""
    for name, value in (("--orientation", orientation), ("--deviation-mm", deviation_mm), ("--around", around)):
        if kind is Kind.JOINT and value is not None:
            raise typer.BadParameter("expected a cartesian move for this option", param_hint=name)
    if orientation is not None and around is not None:
        raise typer.BadParameter(
            "lines with stops (--around) rotate about a fixed axis; omit this option", param_hint="--orientation"
        )
    within(servo_ms, _PERIOD_MS, "--servo-ms")
    if deviation_mm is not None:
        within(deviation_mm, _DEVIATION_MM, "--deviation-mm")


def _planned(
    kind: Kind,
    name: str,
    poses: Path,
    *,
    near: str | None,
    ends: Ends,
    orientation: Orientation | None,
    deviation_mm: float | None,
    around: Around | None,
) -> "tuple[Move, PosesFile]":
    """Read arm and poses and plan the move."""
    from armwright.arm.load import load_arm
    from armwright.cli.joints import joint_values
    from armwright.errors import ArmwrightError
    from armwright.motion.moves import cartesian_move, joint_move, stopping_move
    from armwright.motion.obstruction import PathError
    from armwright.motion.poses_file import read_poses

    warn_of_stray(poses)
    arm, file = load_arm(name), read_poses(poses)
    start = None if near is None else joint_values(arm, near, "--near")
    deviation = (0.1 if deviation_mm is None else deviation_mm) * 1e-3
    timed: dict[str, Any] = {"times": file.times, "blend": file.blend, "near": start, "ends": ends.value}
    if kind is Kind.JOINT:
        return joint_move(arm, file.poses, **timed), file
    if around is not None:
        try:
            return stopping_move(arm, file.poses, method=around.value, near=start, deviation=deviation), file
        except PathError as error:
            other = Around.VIA if around is Around.DAMPED else Around.DAMPED
            hint = "" if error.cause == "reach" else f"; `--around {other}` searches for another detour"
            raise ArmwrightError(f"{poses}: {error}{hint}") from error
    timed["orientation"] = (orientation or Orientation.GEODESIC).value
    try:
        return cartesian_move(arm, file.poses, **timed, deviation=deviation), file
    except PathError as error:
        # Whether either finds a detour is known only after a search, which takes time.
        hint = "" if error.cause == "reach" else "; `--around damped` and `--around via` search for a detour"
        raise ArmwrightError(f"{poses}: {error}{hint}") from error


def _report_data(
    planned: "Move", file: "PosesFile", poses: Path, period: float, notes: "Iterable[str]"
) -> "PlannedMove":
    from armwright.dynamics.newton_euler import inverse_dynamics
    from armwright.report.move_page import PlannedMove
    from armwright.report.page import Message

    samples = planned.trajectory.sampled(period)
    return PlannedMove(
        move=planned,
        file=file,
        name=poses.name,
        samples=samples,
        tau=inverse_dynamics(planned.arm, samples.q, samples.qd, samples.qdd),
        command=command_line(),
        notes=tuple(Message(severity="note", text=note) for note in notes),
    )


def _files(moved: "PlannedMove", assessment: "MoveAssessment", *, film: bool, quiet: bool) -> dict[str, Any]:
    """Return the files of a move by name."""
    from armwright.kinematics.forward_kinematics import forward
    from armwright.report import move_figures
    from armwright.report.motion_table import motion_csv
    from armwright.report.move_page import move_page
    from armwright.report.movie import films
    from armwright.report.page import run_page

    planned, samples = moved.move, moved.samples
    X = forward(planned.arm, samples.q)
    pose_times = dict(zip(moved.file.names, planned.times.tolist(), strict=True))
    positions = {name: pose[:3, 3] for name, pose in zip(moved.file.names, planned.poses, strict=True)}
    title = moved.file.title or f"{planned.arm.name} through {moved.name}"
    joints = move_figures.joint_panels(samples, [joint.revolute for joint in planned.arm.joints])
    tool = move_figures.hand_panels(samples.times, X)
    files: dict[str, Any] = {
        "motion.csv": motion_csv(samples.times, samples.q, samples.qd, samples.qdd, moved.tau),
        "move.json": json_text(assessment.as_data()) + "\n",
        "joints.svg": move_figures.panels(f"{title}: joints", samples.times, joints, marks=pose_times),
        "hand.svg": move_figures.panels(f"{title}: tool", samples.times, tool, marks=pose_times, columns=2),
        "path.svg": move_figures.path_in_space(f"{title}: path of the tool, approach vectors", X, positions),
        "report.html": run_page(move_page(moved)),
    }
    if not film:
        return files
    with counting("drawing the film", quiet=quiet) as progress:
        return {**files, **films(planned, progress)}
