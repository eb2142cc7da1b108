"""``armwright inverse``: all solutions of the inverse kinematics of a pose."""

from typing import TYPE_CHECKING, Annotated

import typer
from typer import Option

from armwright.cli.options import ArmName, Json, usage_error
from armwright.cli.output import print_json
from armwright.errors import ExitStatus

if TYPE_CHECKING:
    from armwright.arm.model import Arm
    from armwright.arrays import Array
    from armwright.kinematics.inverse_kinematics.redundancy import Choice, SwivelInterval
    from armwright.kinematics.inverse_kinematics.solution import InverseSolution


def inverse(  # noqa: PLR0917 - Typer reads one parameter per option
    arm: ArmName,
    xyz: Annotated[str | None, Option(help="Position of the tool in mm, as in 400,100,200.")] = None,
    rpy: Annotated[
        str | None, Option(help="Roll, pitch, yaw about fixed x, y, z in degrees; the default is 0,0,0.")
    ] = None,
    noap: Annotated[str | None, Option(help="Pose as twelve numbers, columns n, o, a, p, in m.")] = None,
    near: Annotated[
        str | None, Option(help="Joint positions in degrees and mm; the nearest solution is printed first.")
    ] = None,
    swivel: Annotated[
        str,
        Option(
            help="For arms of 7 joints: the swivel of the elbow in degrees (or the position of the joint in its "
            "place, in degrees or mm), or which one within the limits: nearest, middle or farthest from all limits."
        ),
    ] = "nearest",
    as_json: Json = False,
) -> None:
    """Print all solutions of the inverse kinematics of a pose, and whether each is within the joint limits.

    A pose out of reach and a singular solution are reported. The exit status is 3 if no solution is within the limits.
    For an arm of 7 joints the solutions at one swivel are printed, and the swivels that are within the limits.

    **Example:** `armwright inverse puma560 --xyz 500,100,300 --rpy 0,90,0`
    """
    from armwright.arm.load import load_arm
    from armwright.cli.joints import joint_values
    from armwright.kinematics.inverse_kinematics.solve import inverse as solutions

    model = load_arm(arm)
    X = _pose(xyz, rpy, noap)
    here = None if near is None else joint_values(model, near, "--near")
    solution = solutions(model, X, here, swivel=_swivel(model, swivel))
    if as_json:
        import attrs

        branches = [
            {
                "q": branch.q.tolist(),
                "label": branch.label,
                "allowed": branch.allowed,
                "violations": [str(violation) for violation in branch.violations],
                "free": list(branch.free),
                "position_error": branch.position_error,
                "rotation_error": branch.rotation_error,
                "swivel": branch.swivel,
            }
            for branch in solution
        ]
        status = ExitStatus.DONE if solution.allowed else ExitStatus.INFEASIBLE
        outcome = {"exit_status": status, "answer": solution.outcome, "distance": solution.distance}
        print_json(
            {**outcome, "branches": branches, "swivels": [attrs.asdict(one) for one in _intervals(model, solution)]}
        )
    else:
        _print(model, solution)
        if solution.outcome == "out of reach":
            _suggest_unit(model, X, metres=noap is not None)
    if not solution.allowed:
        raise typer.Exit(ExitStatus.INFEASIBLE)


def _swivel(model: "Arm", typed: str) -> "float | Choice":
    from armwright.kinematics.inverse_kinematics.redundancy import CHOICES, swivel_unit

    if typed in CHOICES:
        return CHOICES[CHOICES.index(typed)]
    try:
        return float(typed) * swivel_unit(model)[1]
    except ValueError:
        words = ", ".join(CHOICES)
        raise usage_error("--swivel", f"expected a number or one of {words}, got '{typed}'") from None


def _intervals(model: "Arm", solution: "InverseSolution") -> "tuple[SwivelInterval, ...]":
    """Return the swivels within the limits, if the arm has any."""
    from armwright.kinematics.inverse_kinematics.redundancy import swivel_intervals

    if all(branch.swivel is None for branch in solution):
        return ()
    return swivel_intervals(model, solution.nearest_pose, solution.branches[0].q)


def _pose(xyz: str | None, rpy: str | None, noap: str | None) -> "Array":
    import numpy as np

    from armwright.cli.numbers import numbers
    from armwright.spatial.poses import from_noap, homogeneous
    from armwright.spatial.rotations import rotation_from_vector

    if (xyz is None) == (noap is None):
        raise usage_error("--xyz", "expected the pose, either as --xyz and --rpy or as --noap")
    if noap is not None:
        if rpy is not None:
            raise usage_error("--rpy", "the twelve numbers of --noap include the orientation")
        return from_noap(numbers(noap, 12, "--noap"))
    assert xyz is not None  # noqa: S101 - without --noap there is --xyz
    roll, pitch, yaw = np.radians(numbers("0,0,0" if rpy is None else rpy, 3, "--rpy"))
    R_z, R_y, R_x = (rotation_from_vector(np.array(w)) for w in ((0, 0, yaw), (0, pitch, 0), (roll, 0, 0)))
    return homogeneous(R_z @ R_y @ R_x, np.array(numbers(xyz, 3, "--xyz")) * 1e-3)


def _suggest_unit(model: "Arm", X: "Array", *, metres: bool) -> None:
    """Print a note where a position out of reach would be within reach in the other unit of length."""
    from armwright.kinematics.inverse_kinematics.solution import Outcome
    from armwright.kinematics.inverse_kinematics.solve import inverse as solutions

    other = X.copy()
    other[:3, 3] *= 1e-3 if metres else 1e3
    if solutions(model, other).outcome is not Outcome.OUT_OF_REACH:
        option, unit, typed = ("--noap", "m", "mm") if metres else ("--xyz", "mm", "m")
        print(f"note: {option} is in {unit}; in {typed} the pose would be within reach")


def _print(model: "Arm", solution: "InverseSolution") -> None:
    from armwright.cli.joints import unit_names, units
    from armwright.kinematics.inverse_kinematics.redundancy import swivel_unit

    print(f"{solution.outcome}" + ("" if solution.allowed else f": {solution.explain()}"))
    if solution.branches:
        print("  ".join(f"{name:>9}" for name in unit_names(model)) + "   branch")
    for branch in solution:
        values = "  ".join(f"{x:z9.3f}" for x in branch.q / units(model))
        remarks = [f"joints {', '.join(map(str, branch.free))} free together"] if branch.free else []
        remarks += [str(violation) for violation in branch.violations]
        if branch.swivel is not None:
            name, unit = swivel_unit(model)
            remarks.insert(0, f"swivel {branch.swivel / unit:z.3f} {name}")
        print(f"{values}   {branch.label}" + "".join(f"\n    {remark}" for remark in remarks))
    if model.n > 6 and len(solution.branches) > 1 and solution.branches[0].swivel is None:
        print(f"examples: an arm of {model.n} joints has endless configurations for a pose")
    if intervals := _intervals(model, solution):
        name, unit = swivel_unit(model)
        print(f"swivels within the limits, in {name}:")
    for one in intervals:
        print(f"{one.lower / unit:z10.3f} {one.upper / unit:z10.3f}   {one.label}")
