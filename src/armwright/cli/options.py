"""Options that many commands have, and errors about options."""

from pathlib import Path
from typing import Annotated, Literal, TypeAlias

import typer
from typer import Argument, Option

from armwright.cli.shell_completion import listed_in

ArmName: TypeAlias = Annotated[
    str,
    Argument(
        help="Name in the catalogue, or path of an arm file.",
        autocompletion=listed_in("armwright.arm.load", "arm_names", or_file=True),
    ),
]
Configuration: TypeAlias = Annotated[
    str | None, Option("-q", help="Joint positions in degrees and mm, as in 10,20,30.")
]
Rows: TypeAlias = Annotated[
    Path | None,
    Option("--csv", help="Table of q1 ... qn, such as motion.csv, in SI units or the units in its headings."),
]
OutputFolder: TypeAlias = Annotated[
    Path | None, Option("-o", "--output", help="Folder for the results; without it none are written.")
]
Log: TypeAlias = Annotated[
    Literal["mcap", "ros2"] | None,
    Option(help="Also write a log, with -o: mcap, for Foxglove and Rerun; ros2, a bag of ROS 2 (docs/logs.md)."),
]
Json: TypeAlias = Annotated[bool, Option("--json", help="Print JSON, in SI units.")]
Quiet: TypeAlias = Annotated[bool, Option("-q", "--quiet", help="Print nothing but errors.")]
QuietButWarnings: TypeAlias = Annotated[bool, Option("-q", "--quiet", help="Print nothing but warnings and errors.")]


def usage_error(option: str, message: str) -> typer.BadParameter:
    """Return an error of usage that concerns an option."""
    return typer.BadParameter(message, param_hint=option)


def check_log(log: Literal["mcap", "ros2"] | None, output: Path | None) -> None:
    """Refuse a log without a folder for it, and one that cannot be written because a library is missing.

    Raises:
        BadParameter: there is no folder.
        MissingExtraError: the library is not installed.
    """
    if log is None:
        return
    if output is None:
        raise usage_error("--log", "a log is one of the files of a single run; specify their folder as -o DIR")
    from armwright.report.log_files import require_log_library

    require_log_library(log)
