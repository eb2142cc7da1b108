"""Writing folders of results, and warnings about files in them."""

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from armwright.files.output import Content


def write_results(folder: Path, files: "Mapping[str, Content]") -> None:
    """Write the results of a command into a folder, either all of them or none; the record has command and version.

    Args:
        folder: the folder; it is created where it is missing.
        files: contents by name of file.

    Raises:
        OutputError: the folder or a file cannot be written; the message names it with the reason.
    """
    from armwright.cli.output import command_line
    from armwright.files.output import write_folder
    from armwright.version import __version__

    write_folder(folder, files, {"command": command_line(), "versions": {"armwright": __version__}})


def warn_of_stray(path: Path) -> None:
    """Print a warning where an input is in a folder of results whose record does not match it."""
    from armwright.files.output import RECORD, is_stray

    if is_stray(path):
        print(
            f"armwright: {path}: differs from the file that is recorded in {path.parent / RECORD}: it was changed, "
            "or belongs to another run",
            file=sys.stderr,
        )
