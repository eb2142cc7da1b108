"""``armwright studio``: the workbench in a browser."""

import gc
import json
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from typer import Argument, Option

from armwright.cli.options import usage_error

if TYPE_CHECKING:
    from armwright.arm.model import Arm
    from armwright.arrays import Array
    from armwright.studio.cell_file import CellFile
    from armwright.studio.studio import Studio

_EMPTY = """name = {name}

[arms.ARM_1]
model = {model}
joint_positions = [{start}]

[frames]
"""


def studio(
    cell: Annotated[str, Argument(help="A cell file, or an arm of the catalogue.", show_default=False)] = "puma560",
    program: Annotated[
        Path | None, Argument(help="A program; it is made when it is saved.", show_default=False)
    ] = None,
    new: Annotated[Path | None, Option(help="Begin a cell file with the arm in it.", show_default=False)] = None,
    port: Annotated[int, Option(min=0, max=65535, help="Port on the loopback interface; 0 for any.")] = 0,
    open_browser: Annotated[bool, Option("--open", help="Open the address in a browser.")] = False,
) -> None:
    """Move arms by hand, teach frames, write and run programs, in a browser.

    The command prints the address of the page, which only programs of this computer can reach and only those can use
    who know the address. Ctrl-C ends it. Nothing but the cell file and the program is written, when that is asked for.

    **Example:** `armwright studio examples/vision_cell.toml examples/stack_by_vision.rlo`
    """
    # What is loaded stays. Looking through it for what is not needed any more takes a tenth of the start.
    gc.disable()
    try:
        from armwright.studio.server import serve

        served = _studio(cell, program, new)
    finally:
        gc.enable()
    gc.freeze()
    try:
        ended = serve(served, lambda address: _announce(address, open_it=open_browser), port)
    except OSError as error:
        raise usage_error("--port", f"port {port} cannot be listened on: {error.strerror or error}") from error
    for name in served.project.unsaved():
        typer.echo(f"armwright: the changes of {name} were not saved", err=True)
    if not ended:
        # Python would wait for what is still being computed, of which nothing is kept.
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(0)


def _studio(cell: str, program: Path | None, new: Path | None) -> "Studio":
    """Return the studio of a cell and a program."""
    from armwright.studio.project import Project
    from armwright.studio.studio import Studio
    from armwright.studio.workbench import Workbench

    file = _cell_file(cell, new)
    if program is None and new is not None and not new.with_suffix(".rlo").exists():
        program = new.with_suffix(".rlo")
    if program is not None and program.resolve() == file.path.resolve():
        raise usage_error("PROGRAM", f"{program} is the cell file")
    return Studio(Project(Workbench(file.cell), file, program))


def _announce(address: str, *, open_it: bool) -> None:
    typer.echo(address)
    if open_it:
        import webbrowser

        webbrowser.open(address)


def _cell_file(name: str, new: Path | None) -> "CellFile":
    """Return the file of the cell to show, into which frames are taught; one of an arm alone has no name yet."""
    from armwright.arm.load import is_path, load_arm
    from armwright.files.output import write_file
    from armwright.studio.cell_file import CellFile

    is_cell = is_path(name) and Path(name).suffix.lower() in {".toml", ".json"} and _has_arms(Path(name))
    if is_cell and new is None:
        return CellFile(Path(name))
    if is_cell:
        raise usage_error("--new", f"expected an arm to begin a cell with, got the cell {name}")
    arm = load_arm(name)
    numbers = ", ".join(f"{value:.6g}" for value in _bent(arm))
    place = Path(f"{arm.name}.toml") if new is None else new
    # The path of an arm file is relative to the folder of the cell file; a name is text, whatever it has in it.
    model = os.path.relpath(name, place.parent) if is_path(name) else name
    text = _EMPTY.format(name=json.dumps(place.stem.replace("_", " ")), model=json.dumps(model), start=numbers)
    if new is None:
        return CellFile(place, text)
    if new.exists():
        raise usage_error("--new", f"{new} exists already; open it by: armwright studio {new}")
    write_file(new, text)
    return CellFile(new)


def _bent(arm: "Arm") -> "Array":
    """Return joint positions at which an arm is seen well: near the middle of its limits, but not stretched."""
    import numpy as np

    from armwright.kinematics.inverse_kinematics.revolutions import mid_range
    from armwright.kinematics.manipulability_index import manipulability

    middle, limits = mid_range(arm), arm.limits
    span = np.minimum(np.where(np.isfinite(limits.upper - limits.lower), limits.upper - limits.lower, np.inf), 3.0)
    tried = [middle, *(middle + span * np.random.default_rng(0).uniform(-0.35, 0.35, (60, arm.n)))]
    return max(tried, key=lambda q: float(manipulability(arm, q)))


def _has_arms(path: Path) -> bool:
    """Whether a file is a cell file, and not that of an arm."""
    from armwright.files.document import Document

    return "arms" in Document.read(path).root
