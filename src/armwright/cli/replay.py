"""``armwright replay``: show what a log has measured beside what was planned."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Argument, Option

from armwright.cli.options import Json, OutputFolder, Quiet, usage_error
from armwright.cli.output import command_line, print_result
from armwright.cli.results import write_results
from armwright.cli.shell_completion import listed_in

if TYPE_CHECKING:
    from armwright.arm.model import Arm
    from armwright.arrays import Array
    from armwright.cell.model import Cell
    from armwright.files.logs.joint_log import JointLog


def replay(  # noqa: PLR0917 - Typer reads one parameter per option
    log: Annotated[Path, Argument(help="MCAP file, .db3 file or folder of a bag of ROS 2 (docs/logs.md).")],
    planned: Annotated[
        Path | None, Option(help="Another log that has the plan; the clocks of both are brought together.")
    ] = None,
    arm: Annotated[
        str | None,
        Option(
            help="Arm of the log, if it does not describe one itself: a name in the catalogue, or an arm file.",
            autocompletion=listed_in("armwright.arm.load", "arm_names", or_file=True),
        ),
    ] = None,
    cell: Annotated[Path | None, Option(help="Cell file of the arms of the log, whose bodies are drawn too.")] = None,
    measured_topic: Annotated[
        str | None, Option(help="Topic of the measured joint states, if its name does not tell.")
    ] = None,
    planned_topic: Annotated[
        str | None, Option(help="Topic of the planned joint states, if its name does not tell.")
    ] = None,
    output: OutputFolder = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Show the joint states of a log, measured beside planned, with tracking errors and delays of each joint.

    The log may be one of `run --log` or `simulate --log`, or any other with joint states of ROS or Foxglove. Topics
    whose names have a word such as planned, desired, command or reference are plans of the others. With -o the command
    writes summary.json, figures, and report.html, a page that shows the arm moving as measured and as planned.

    **Example:** `armwright replay out/log.mcap -o out/replayed`
    """
    from armwright.files.logs.joint_log import read_joint_log
    from armwright.motion.replay import replay as replay_log

    if arm is not None and cell is not None:
        raise usage_error("--cell", "expected either --arm or --cell, which has arms")
    read = read_joint_log(log)
    other = None if planned is None else read_joint_log(planned)
    arms, bases, used_cell = _arms(read, other, arm, cell)
    result = replay_log(read, other, measured_topic=measured_topic, planned_topic=planned_topic, arms=arms)
    if output is not None:
        from armwright.report.replay_files import replay_files

        title = f"{log.name}, replayed"
        files = replay_files(result, title=title, command=command_line(), bases=bases, cell=used_cell)
        write_results(output, files)
    print_result(result, as_json=as_json, quiet=quiet, output=output)


def _arms(
    log: "JointLog", other: "JointLog | None", arm: str | None, cell: Path | None
) -> "tuple[dict[str, Arm], dict[str, Array], Cell | None]":
    """Return the arms of a log by name, where they stand, and their cell: as named, or as armwright's logs say."""
    from armwright.arm.load import load_arm
    from armwright.motion.replay import arms_of, bases_of

    if arm is not None:
        model = load_arm(arm)
        return {model.name: model}, {}, None
    if cell is not None:
        from armwright.cell.reader import read_cell

        read = read_cell(cell)
        return {n: one.arm for n, one in read.arms.items()}, {n: one.base for n, one in read.arms.items()}, read
    for one in (log, other):
        if one is not None and one.about:
            return arms_of(one), bases_of(one), None
    return {}, {}, None
