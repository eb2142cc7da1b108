"""``armwright study``: repeat experiments of the sources, published numbers beside computed ones."""

from typing import Annotated

from typer import Argument

from armwright.cli.options import Json, OutputFolder
from armwright.cli.output import command_line, print_result
from armwright.cli.progress import parts, waiting
from armwright.cli.results import write_results
from armwright.cli.shell_completion import listed_in

# Studies that show progress bars.
_WITH_BARS = {"five-bar-clearance", "five-bar-life", "linkage-simulators"}


def study(
    name: Annotated[
        str,
        Argument(
            help="Name of the study: stanford-torque, puma-moves, five-bar-clearance, dh-calibration, five-bar-life, "
            "identified-arm, linkage-simulators.",
            autocompletion=listed_in("armwright.study.study", "STUDIES"),
        ),
    ],
    output: OutputFolder = None,
    as_json: Json = False,
) -> None:
    """Repeat an experiment of the sources and print its published numbers beside the computed ones.

    With -o the command writes a page of figures and tables (report.html), the figures (SVG) and the tables (JSON).

    stanford-torque: the efforts of the Stanford arm during the report's motion by Newton-Euler, by Bejczy's model and
    with the largest payload (figures 3 to 11), and a verdict on every published constant.

    puma-moves: a joint move and a Cartesian move of the PUMA through three poses (figures 5 to 7, 10, 16 to 19, 22, 23,
    and 25 as a film), the joint speeds and efforts of both, and the Cartesian move at the singularity of the wrist.

    five-bar-clearance: a parallel arm with clearance in three joints: error curves, their features over 729 linkages,
    the clearances estimated from them, two arms compared, a path corrected (tables 5.3 to 5.12, figures 4.6 to 5.13).
    This study takes a minute.

    dh-calibration: a three-joint arm touches a board of 33 points in three orientations; the thesis' calibration of its
    Denavit-Hartenberg table and a complete model, both validated at six points (table 2.4).

    five-bar-life: what section 6.2 of the thesis leaves to future work: its 24 paths ranked by vibration, elastic rods
    and tolerances, wear, rules of reliability for both arms, and a plan of checks. This study takes three minutes.

    identified-arm: an arm is logged in a cell with physics, identified from its log, and tracks another motion with
    what its drawing says, what was identified, and the truth (simulated; extra `identification`).

    linkage-simulators: the linkages of the catalogue with clearance beside Exudyn, where that is installed, and without
    beside MuJoCo: how far the tips are apart over time.

    **Example:** `armwright study puma-moves -o out/puma-moves`
    """
    from armwright.study.study import run_study

    with parts() as progress, waiting(name, quiet=name in _WITH_BARS):
        result = run_study(name, progress)
    if output is not None:
        from armwright.report.study_page import study_files

        title, drawn = f"{name}: {result.title}", result.figures()
        write_results(output, study_files(result, result.headline(), drawn, title=title, command=command_line()))
    print_result(result, as_json=as_json, output=output)
