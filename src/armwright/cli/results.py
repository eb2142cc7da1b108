"""Folders of results, as the commands write and read them."""

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from armwright.files.output import Content


def write_results(folder: Path, files: "Mapping[str, Content]", record: Mapping[str, Any] | None = None) -> None:
    """Write the results of a command into a folder, all of them or none.

    Args:
        folder: made where it is missing.
        files: by name.
        record: what ``run.json`` says; the command and the version without it.

    Raises:
        OutputError: the folder or a file cannot be written; the text says which and why.
    """
    from armwright.cli.output import command_line
    from armwright.files.output import write_folder
    from armwright.version import __version__

    own = {"command": command_line(), "versions": {"armwright": __version__}}
    write_folder(folder, files, own if record is None else record)


def warn_of_stray(path: Path) -> None:
    """Say where a file that is read is not what the run of its folder has written."""
    from armwright.files.output import RECORD, is_stray

    if is_stray(path):
        print(
            f"armwright: {path}: not what the run has written of which {path.parent / RECORD} speaks: it was changed, "
            "or belongs to another run",
            file=sys.stderr,
        )
