"""``armwright move``: plan a motion through poses, straight in joint space or straight paths of the tool."""

import sys
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from typer import Argument, Option

from armwright.cli.gear_options import Damping, Stiffness, with_gears_of
from armwright.cli.numbers import within
from armwright.cli.options import ArmName, Json, OutputFolder, QuietButWarnings, usage_error
from armwright.cli.output import command_line, print_result
from armwright.cli.progress import counting
from armwright.cli.results import warn_of_stray, write_results

if TYPE_CHECKING:
    from collections.abc import Iterator

    from armwright.motion.moves import Move
    from armwright.motion.solver import AnyArm

# Bounds of the options [ms], [mm].
_PERIOD_MS, _DEVIATION_MM = (0.01, 1000.0), (1e-4, 100.0)


def move(  # noqa: PLR0917 - Typer reads one parameter per option
    kind: Annotated[
        Literal["joint", "cartesian"],
        Argument(help="Space in which the path between poses is straight: joint or cartesian."),
    ],
    arm: ArmName,
    poses: Annotated[Path, Argument(help="File of poses, TOML or JSON (docs/poses.md).")],
    output: OutputFolder = None,
    near: Annotated[
        str | None,
        Option(help="Initial joint positions in degrees and mm, as in 10,20,30; they select the branch."),
    ] = None,
    ends: Annotated[
        Literal["rest", "running"], Option(help="Start and end at rest, or at the speed of the path.")
    ] = "rest",
    orientation: Annotated[
        Literal["geodesic", "zyz"] | None,
        Option(help="Interpolate the orientation about a fixed axis (geodesic), or in ZYZ Euler angles (zyz)."),
    ] = None,
    deviation_mm: Annotated[
        float | None, Option(help="Largest path deviation of the tool in mm; the default is 0.1.")
    ] = None,
    around: Annotated[
        Literal["via", "damped"] | None,
        Option(
            help="Stop at every pose; replace an infeasible line: via, by a detour; damped, by damped least squares."
        ),
    ] = None,
    keep_limits: Annotated[
        bool,
        Option("--keep-limits", help="Slow the motion down if the times of the file would exceed joint limits."),
    ] = False,
    smooth: Annotated[
        Literal["zv", "zvd", "ei", "flat"] | None,
        Option(help="Leave little vibration on flexible gears: input shaper zv, zvd or ei, or flat feedforward."),
    ] = None,
    smooth_modes: Annotated[int, Option(min=1, max=6, help="How many modes are shaped, the slowest ones.")] = 2,
    stiffness: Stiffness = None,
    damping: Damping = None,
    servo_ms: Annotated[float, Option(help="Servo period of motion.csv in ms.")] = 2.0,
    film: Annotated[bool, Option(help="Draw move.gif, and move.mp4 where ffmpeg is installed.")] = True,
    as_json: Json = False,
    quiet: QuietButWarnings = False,
) -> None:
    """Plan a motion of an arm through the poses of a file.

    The path of a joint move is straight in joint space; the tool of a Cartesian move follows a straight path from pose
    to pose, on a single branch of the inverse kinematics, with a certified bound of its path deviation. Poses without
    times are passed as fast as the limits of speed, acceleration and effort allow. With -o the command writes
    motion.csv (every servo tick, SI), move.json, figures, report.html (a page that opens from the disk and shows the
    arm moving), and a film.

    --smooth commands the motors so that the arm vibrates little on its gears, keeps all limits, and prints the
    vibration before and after, the time added and the path deviation (docs/vibration.md).

    **Example:** `armwright move joint puma560 examples/puma_poses.toml -o out/joint`
    """
    from armwright.arm.load import load_arm
    from armwright.cli.joints import joint_values
    from armwright.compiled.arm import planning_arm
    from armwright.motion.move_assessment import MoveAssessment
    from armwright.motion.moves import cartesian_move, joint_move, stopping_move
    from armwright.motion.poses_file import read_poses
    from armwright.motion.smooth_move import smooth_move
    from armwright.motion.tolerance import tolerance
    from armwright.report.move_files import move_files
    from armwright.report.movie import render_films

    if kind == "joint":
        _refuse_cartesian({"--orientation": orientation, "--deviation-mm": deviation_mm, "--around": around})
    if orientation is not None and around is not None:
        raise usage_error("--orientation", "lines with stops (--around) rotate about a fixed axis; omit this option")
    if smooth is None and (stiffness, damping) != (None, None):
        raise usage_error("--stiffness", "expected --smooth with the stiffness or damping of gears")
    within(servo_ms, _PERIOD_MS, "--servo-ms")
    deviation = within(0.1 if deviation_mm is None else deviation_mm, _DEVIATION_MM, "--deviation-mm") * 1e-3
    warn_of_stray(poses)
    model, file = with_gears_of(load_arm(arm), stiffness, damping), read_poses(poses)
    fast = planning_arm(model)
    start = None if near is None else joint_values(model, near, "--near")
    timed: dict[str, Any] = {"times": file.times, "blend": file.blend, "near": start, "ends": ends}
    if kind == "joint":
        planned = joint_move(fast, file.poses, **timed)
    else:
        with _detour_hint(poses, around):
            if around is None:
                axis = orientation or "geodesic"
                planned = cartesian_move(fast, file.poses, **timed, orientation=axis, deviation=deviation)
            else:
                planned = stopping_move(fast, file.poses, method=around, near=start, deviation=deviation)
    notes = list(file.notes)
    smoothed = None
    if smooth is not None:
        smoothed = smooth_move(fast, planned, smooth, allowed=tolerance(deviation), count=smooth_modes)
        planned = smoothed.move
    planned, slowing = _inside_limits(planned, fast, keep_limits=keep_limits)
    notes += slowing
    for note in notes:
        print(f"armwright: {poses}: {note}", file=sys.stderr)
    assessment = MoveAssessment(move=planned, names=file.names, smooth=smoothed)
    if output is not None:
        files = move_files(
            assessment, file, name=poses.name, period=servo_ms * 1e-3, command=command_line(), notes=notes
        )
        if film:
            with counting("drawing the film", quiet=quiet) as progress:
                files |= render_films(planned.arm, planned.trajectory, planned.poses, progress)
        write_results(output, files)
    print_result(assessment, as_json=as_json, quiet=quiet, output=output)


def _refuse_cartesian(options: dict[str, object]) -> None:
    """Refuse options of Cartesian moves."""
    for name, value in options.items():
        if value is not None:
            raise usage_error(name, "expected a cartesian move for this option")


def _inside_limits(planned: "Move", fast: "AnyArm", *, keep_limits: bool) -> "tuple[Move, list[str]]":
    """Return a move, slowed where it should keep its limits, and what is to be said of them."""
    from armwright.motion.certificate import slower
    from armwright.motion.limit_utilization import ROUNDING, slowing_for_limits

    factor, reason = slowing_for_limits(fast, planned.trajectory)
    if reason is None or factor <= 1 + ROUNDING:
        return planned, []
    slowing = slower(planned.arm, factor, reason)
    if keep_limits:
        return planned.slowed(factor), [f"run {slowing}"]
    return planned, [f"the limits require a motion {slowing}; --keep-limits slows it down"]


@contextmanager
def _detour_hint(path: Path, around: Literal["via", "damped"] | None) -> "Iterator[None]":
    """Add to the error of a blocked Cartesian path which options search for a detour."""
    from armwright.errors import ArmwrightError
    from armwright.motion.obstruction import PathError

    # Whether either finds a detour is known only after a search, which takes time.
    hint = "`--around damped` and `--around via` search for a detour"
    if around is not None:
        hint = f"`--around {'via' if around == 'damped' else 'damped'}` searches for another detour"
    try:
        yield
    except PathError as error:
        raise ArmwrightError(f"{path}: {error}{'' if error.cause == 'reach' else f'; {hint}'}") from error
