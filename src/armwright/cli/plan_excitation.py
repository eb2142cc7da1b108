"""``armwright plan-excitation``: plan a motion from which the dynamics of an arm can be identified."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from typer import Option

from armwright.cli.options import ArmName, Json, usage_error
from armwright.cli.output import print_result
from armwright.cli.results import write_results
from armwright.export.targets import Target

if TYPE_CHECKING:
    from armwright.cell.model import CellArm
    from armwright.export import ExportedProgram
    from armwright.identification.excitation import Excitation, FreeCheck
    from armwright.identification.model import DynamicModel


def plan_excitation(  # noqa: PLR0917 - Typer reads one parameter per option
    arm: ArmName,
    period: Annotated[float, Option(min=1.0, max=600.0, help="Duration of the motion in seconds.")] = 20.0,
    harmonics: Annotated[int, Option(min=3, max=20, help="Harmonics of each joint.")] = 5,
    criterion: Annotated[
        Literal["condition", "information"],
        Option(help="Condition of the columns as they are, or information weighted by the noise of the joints."),
    ] = "condition",
    speed_percent: Annotated[
        float, Option(min=1.0, max=100.0, help="Part of the speed and acceleration limits that is used.")
    ] = 100.0,
    noise_percent: Annotated[
        float, Option(min=1e-3, max=100.0, help="Standard deviation of measured efforts, in percent of the largest.")
    ] = 1.0,
    cell: Annotated[
        Path | None,
        Option(help="Cell file: the motion meets nothing of it (its first arm, unless --arm names another)."),
    ] = None,
    in_cell: Annotated[str | None, Option("--arm", help="Name of the arm in the cell, such as ARM_1.")] = None,
    starts: Annotated[int, Option(min=1, max=100, help="Random motions to begin with; the best one is kept.")] = 1,
    seed: Annotated[int, Option(min=0, help="Seed of these.")] = 0,
    rate_hz: Annotated[float, Option("--rate-hz", min=1.0, max=10_000.0, help="Rows of the CSV per second.")] = 100.0,
    target: Annotated[
        Target | None,
        Option(
            "--export",
            help="Controller that the motion is written for, exact in time, into the folder -o: ros2, csv (counts of "
            "drives; --cell has the encoders) or urscript.",
        ),
    ] = None,
    output: Annotated[
        Path | None,
        Option(
            "-o",
            "--output",
            help="CSV of the motion (time, positions, velocities, accelerations), or .rlo for a program through its "
            "poses; with --export a folder.",
        ),
    ] = None,
    as_json: Json = False,
) -> None:
    """Plan a motion from which masses, inertias and friction of an arm can be identified.

    Every joint moves by a few harmonics of one period, from rest to rest, within the limits of position, speed,
    acceleration and effort. The command prints the condition and the standard errors to expect. Play the motion, by
    its table or by --export, log positions and currents, and run `identify`.

    **Example:** `armwright plan-excitation ur5 -o out/excitation.csv`
    """
    import numpy as np

    from armwright.arm.load import load_arm
    from armwright.export.joint_motion import require_times
    from armwright.files.output import write_file
    from armwright.identification.excitation import MotionLimits, plan_excitation as planned
    from armwright.identification.model import DynamicModel

    if target is not None:
        require_times(target)
    model = DynamicModel(arm=load_arm(arm), terms=("rotor", "viscous", "coulomb"))
    finite = np.isfinite(model.arm.limits.effort)
    largest = np.where(finite, model.arm.limits.effort, 100.0)
    plan = planned(
        model,
        limits=MotionLimits.of(model.arm, speed_percent / 100),
        period=period,
        harmonics=harmonics,
        criterion=criterion,
        noise=noise_percent / 100 * largest,
        is_free=None if cell is None else _free_check(cell, in_cell, model),
        starts=starts,
        seed=seed,
    )
    exported = None
    if target is not None:
        exported = _exported(plan, target, cell, in_cell)
        if output is not None:
            write_results(output, exported.files)
    elif output is not None:
        write_file(output, _program(plan) if output.suffix == ".rlo" else _csv(plan, rate_hz))
    print_result(plan, as_json=as_json)
    if as_json:
        return
    if exported is not None:
        print(f"{target}: {plan.motion.period:.6g} s of motion, proved:")
        for line in exported.proof.lines():
            print(f"  {line}")
    if output is not None:
        print(f"motion: {output}")


def _exported(plan: "Excitation", target: Target, path: Path | None, name: str | None) -> "ExportedProgram":
    """Return the motion for a controller, of which a cell says more."""
    from armwright.cell.model import CellArm
    from armwright.errors import InvalidValueError
    from armwright.export import ExportError, export_motion

    motion = plan.trajectory
    placed = CellArm(arm=plan.model.arm, start=motion(0.0)) if path is None else _placed(path, name, plan.model)
    try:
        return export_motion(target, motion, placed, "excitation")
    except ExportError as error:
        # There is no line of a program to show, but what helps.
        raise InvalidValueError("; ".join([error.diagnostic.message, *error.diagnostic.helps])) from error


def _placed(path: Path, name: str | None, model: "DynamicModel") -> "CellArm":
    """Return the arm of a cell that is meant: its first one, or the one of a name."""
    from armwright.cell.reader import read_cell
    from armwright.errors import one_of

    cell = read_cell(path)
    placed = cell.arms[next(iter(cell.arms)) if name is None else one_of("arm of the cell", name, cell.arms)]
    if placed.arm.n != model.arm.n:
        raise usage_error("--cell", f"expected an arm with the {model.arm.n} joints of {model.arm.name}")
    return placed


def _free_check(path: Path, name: str | None, model: "DynamicModel") -> "FreeCheck":
    """Return the check that an arm of a cell meets nothing while the others stand."""
    import numpy as np

    from armwright.cell.part_poses import PartPoses
    from armwright.cell.reader import read_cell
    from armwright.errors import one_of
    from armwright.physics.collisions import CellCollisions

    cell = read_cell(path)
    moved = next(iter(cell.arms)) if name is None else one_of("arm of the cell", name, cell.arms)
    if cell.arms[moved].arm.n != model.arm.n:
        raise usage_error("--cell", f"expected {moved} to have the {model.arm.n} joints of {model.arm.name}")
    checks = CellCollisions(cell).at_configurations(PartPoses.standing(cell))
    others = {key: value.start for key, value in cell.arms.items() if key != moved}

    def is_free(q: "np.ndarray") -> bool:
        still = {key: np.tile(start, (len(q), 1)) for key, start in others.items()}
        return checks.first_meeting({moved: q, **still}, np.zeros(checks.pair_count)) is None

    return is_free


def _csv(plan: "Excitation", rate: float) -> str:
    import numpy as np

    from armwright.report.motion_table import csv_lines

    t = np.arange(0, plan.motion.period + 0.5 / rate, 1 / rate)
    columns = {"t": t}
    for name, values in zip(("q", "qd", "qdd"), plan.motion(t), strict=True):
        columns |= {f"{name}{i + 1}": values[:, i] for i in range(plan.model.arm.n)}
    return "".join(csv_lines(columns, 12))


# Poses of a program, a second apart.
_POSES_PER_SECOND = 1.0


def _program(plan: "Excitation") -> str:
    """Return an RLO program that moves through the poses of the motion, one a second, joints straight between them."""
    import numpy as np

    from armwright.kinematics.forward_kinematics import forward
    from armwright.spatial.poses import to_noap

    count = max(2, round(plan.motion.period * _POSES_PER_SECOND))
    t = np.linspace(0, plan.motion.period, count + 1)
    poses = [to_noap(pose) for pose in forward(plan.model.arm, plan.motion(t)[0])]
    names = [f"p{i}" for i in range(count + 1)]
    lines = ["{ Poses of a motion that excites the dynamics; log positions and currents while it runs. }"]
    lines += [f"VAR {', '.join(names)} : FRAME ;", "BEGIN"]
    lines += [f"  {name} = ({', '.join(f'{x:z.9f}' for x in pose)}) ;" for name, pose in zip(names, poses, strict=True)]
    lines += [f"  MOVE ARM_1 TO {name} DIRECTLY ;" for name in names]
    return "\n".join([*lines, "END.", ""])
