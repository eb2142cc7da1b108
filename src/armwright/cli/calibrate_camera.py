"""``armwright calibrate-camera``: the lens of a camera, and where it is on an arm or beside it."""

import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Argument, Option

from armwright.cli.failures import outcome
from armwright.cli.numbers import numbers, units_of
from armwright.cli.options import Json, OutputFolder, Quiet, usage_error
from armwright.cli.output import command_line, print_result
from armwright.cli.progress import waiting
from armwright.cli.results import warn_of_stray, write_results
from armwright.cli.shell_completion import listed_in
from armwright.cli.tables import ColumnMap, Units, columns_of
from armwright.errors import DoubtfulError

if TYPE_CHECKING:
    from armwright.arm.model import Arm
    from armwright.calibration.arm_readings import ArmAccuracy
    from armwright.calibration.board import Board
    from armwright.calibration.camera_tables import PictureJoints

_TWO_NUMBERS = re.compile(r"(\d{1,6})[xX](\d{1,6})")
_NAME = re.compile(r"[A-Za-z0-9_-]{1,100}")
_SETUPS = {"eye-in-hand": True, "eye-to-hand": False}


def calibrate_camera(  # noqa: PLR0917 - Typer reads one parameter per option
    pictures: Annotated[
        list[Path], Argument(help="Pictures of a board (PNG, JPEG), folders of them, or a CSV table of corners.")
    ],
    squares: Annotated[str, Option(help="Squares of the board, columns x rows, as in 9x7.")],
    square_mm: Annotated[float, Option(help="Side of a square.")],
    marker_mm: Annotated[
        float | None, Option(help="Side of a marker of a ChArUco board; none on a chessboard.")
    ] = None,
    dictionary: Annotated[str, Option(help="Dictionary of the markers.")] = "4X4_50",
    size: Annotated[str | None, Option(help="Size of the pictures of a table of corners, as in 640x480.")] = None,
    distortion: Annotated[int, Option(help="Fitted coefficients of distortion: 0, 2, 4 or 5.")] = 5,
    lens: Annotated[Path | None, Option(help="Known lens: a file with [cameras.NAME], such as camera.toml.")] = None,
    arm: Annotated[
        str | None,
        Option(
            help="Arm that moves camera or board: name in the catalogue, or path of an arm file.",
            autocompletion=listed_in("armwright.arm.load", "arm_names", or_file=True),
        ),
    ] = None,
    joints: Annotated[
        Path | None, Option(help="CSV table of picture and joint positions (docs/calibration.md).")
    ] = None,
    units: Units = None,
    columns: ColumnMap = None,
    setup: Annotated[
        str, Option(help="eye-in-hand: the camera is on the tool; eye-to-hand: it is fixed, and the board on the tool.")
    ] = "eye-in-hand",
    arm_mm: Annotated[float, Option(help="Standard deviation of the position of the tool, per axis.")] = 0.1,
    arm_mrad: Annotated[float, Option(help="Standard deviation of the orientation of the tool, per axis.")] = 0.5,
    joint_sigmas: Annotated[
        str | None,
        Option(help="Instead: standard deviations of the joint positions in deg and mm, one, or one for each joint."),
    ] = None,
    pixel_sigma: Annotated[
        float | None, Option(help="Standard deviation of a corner; estimated from the residuals if left out.")
    ] = None,
    name: Annotated[str, Option(help="Name of the camera in a cell file.")] = "camera",
    output: OutputFolder = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Calibrate a camera from pictures of a board: its lens, and its pose on an arm or beside it.

    The board is a chessboard or a ChArUco board. With --arm and --joints, the pose of the camera on the tool
    (eye-in-hand) or in the base frame of the arm (eye-to-hand) is estimated by least squares over the corners and the
    joint positions, each with its standard deviation. The command prints estimates with their standard errors and 95 %
    intervals. Pictures that contradict the others are left out and named. If the pictures are farther from the arm than
    its accuracy allows, the command ends with status 3 after everything is printed and written. With -o the command
    writes the camera as the lines of a cell file, all numbers, the corners, a report and figures.

    **Example:** `armwright calibrate-camera examples/board_corners.csv --size 640x480 --squares 9x7 --square-mm 30
    --arm ur5 --joints examples/board_joints.csv -o out/camera`
    """
    from armwright.arrays import one_core
    from armwright.calibration import camera_calibration
    from armwright.calibration.board import Board
    from armwright.calibration.board_detection import views_of_pictures
    from armwright.calibration.camera_tables import read_corners, read_lens
    from armwright.report.camera_files import camera_files

    if setup not in _SETUPS:
        raise usage_error("--setup", f"expected eye-in-hand or eye-to-hand, got {setup}")
    if _NAME.fullmatch(name) is None:
        raise usage_error("--name", f"expected letters, digits, _ and -, got {name!r}")
    columns_and_rows = _two(squares, "--squares")
    marker = None if marker_mm is None else marker_mm * 1e-3
    board = Board(
        columns=columns_and_rows[0],
        rows=columns_and_rows[1],
        square=square_mm * 1e-3,
        marker=marker,
        dictionary=dictionary,
    )
    model, positions = _arm_and_joints(arm, joints, units, columns)
    is_table = len(pictures) == 1 and pictures[0].suffix.lower() == ".csv"
    if is_table == (size is None):
        raise usage_error("--size", "expected the size of the pictures with a table of corners, and only with one")
    if positions is not None and not is_table:
        _refuse_ambiguous(board)
    accuracy = None if model is None else _accuracy(model, arm_mm, arm_mrad, joint_sigmas)
    known = None if lens is None else read_lens(lens)
    paths = pictures if is_table else _pictures(pictures)
    for path in paths:
        warn_of_stray(path)
    with waiting("looking for the board", quiet=quiet or as_json) as progress, one_core():
        if is_table:
            views = read_corners(paths[0], board, _two(size or "", "--size"))
        else:
            views = views_of_pictures(paths, board, progress=progress)
        result = camera_calibration.calibrate_camera(
            views,
            name=name,
            lens=known,
            coefficients=distortion,
            arm=model,
            joints=positions,
            accuracy=accuracy,
            eye_in_hand=_SETUPS[setup],
            sigma=pixel_sigma,
            progress=progress,
        )
    if output is not None:
        shown = None if is_table else next(path for path in paths if path.name == views.names[0])
        write_results(output, camera_files(result, title=f"Camera {name}", command=command_line(), example=shown))
    reasons = result.contradictions
    doubtful = DoubtfulError(f"the pictures contradict the arm: {'; '.join(reasons)}") if reasons else None
    print_result(result, as_json=as_json, quiet=quiet, output=output, head=outcome(doubtful))
    if doubtful is not None:
        raise doubtful


def _arm_and_joints(
    arm: str | None, joints: Path | None, units: str | None, columns: str | None
) -> "tuple[Arm | None, PictureJoints | None]":
    """Return the arm and its joint positions at the pictures; None without them."""
    from armwright.arm.load import load_arm
    from armwright.calibration.camera_tables import read_picture_joints
    from armwright.files.column_names import default_units

    if arm is None and joints is None:
        return None, None
    if arm is None or joints is None:
        raise usage_error("--arm" if arm is None else "--joints", "expected both --arm and --joints, or neither")
    model, named = load_arm(arm), units_of(units)
    default = None if named is None else default_units(*named)
    warn_of_stray(joints)
    return model, read_picture_joints(joints, model, units=default, columns=columns_of(columns))


def _refuse_ambiguous(board: "Board") -> None:
    """Refuse a board whose pose a picture shows in two ways."""
    from armwright.errors import InvalidValueError

    if board.looks_the_same_upside_down:
        raise InvalidValueError(
            f"a chessboard of {board.columns} x {board.rows} squares looks the same upside down, and its pose is not "
            "known; use one with an odd and an even number of squares, or a ChArUco board"
        )


def _two(text: str, option: str) -> tuple[int, int]:
    """Return two numbers that are written as 9x7."""
    match = _TWO_NUMBERS.fullmatch(text)
    if match is None:
        raise usage_error(option, f"expected two numbers such as 9x7, got {text!r}")
    return int(match[1]), int(match[2])


def _accuracy(model: "Arm", arm_mm: float, arm_mrad: float, joints: str | None) -> "ArmAccuracy":
    """Return the accuracy of an arm, of its tool or of its joints."""
    from armwright.calibration.arm_readings import ArmAccuracy

    if joints is None:
        return ArmAccuracy(position=arm_mm * 1e-3, orientation=arm_mrad * 1e-3)
    count = 1 if len(joints.replace(",", " ").split()) == 1 else model.n
    values = numbers(joints, count, "--joint-sigmas")
    scales = [joint.units.scale for joint in model.joints]
    return ArmAccuracy(joints=[value * scale for value, scale in zip(values * (model.n // count), scales, strict=True)])


def _pictures(paths: list[Path]) -> list[Path]:
    """Return pictures, and those in folders, by name."""
    from armwright.errors import FileFormatError
    from armwright.files.pictures import ENDINGS

    files = list[Path]()
    for path in paths:
        if not path.is_dir():
            files.append(path)
            continue
        inside = sorted(entry for entry in path.iterdir() if entry.suffix.lower() in ENDINGS)
        if not inside:
            raise FileFormatError(path, None, "", f"the folder has no pictures ({', '.join(ENDINGS)})")
        files += inside
    return files
