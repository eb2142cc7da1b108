"""The study of the PUMA's two moves as ``armwright study`` shows it."""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import attrs

from armwright.cli.study_tables import study_table
from armwright.motion.moves import Move
from armwright.study import puma_moves

if TYPE_CHECKING:
    from rich.table import Table


def tables() -> dict[str, Any]:
    """Return the tables as plain data."""
    return {
        "postures": [attrs.asdict(row) for row in puma_moves.posture_table()],
        "angles": [attrs.asdict(row) for row in puma_moves.angle_table()],
        "moves": [
            {key: list(value) if isinstance(value, puma_moves.Largest) else value for key, value in row.items()}
            for row in (attrs.asdict(row, recurse=False) for row in puma_moves.move_table())
        ],
        "ways round": [attrs.asdict(row) for row in puma_moves.way_round_table()],
    }


def figures() -> dict[str, str | bytes]:
    """Return the project's figures by the name of their file, the last one as a film."""
    from armwright.report.move_figures import Panel, overview, panels, path_in_space

    t = puma_moves.sample_times()
    places = {name: X[:3, 3] for name, X in zip(puma_moves.NAMES, puma_moves.study_poses(), strict=True)}
    moments = dict(zip(puma_moves.NAMES, puma_moves.TIMES, strict=True))

    def shown(number: int) -> list[Panel]:
        return [Panel(one.title, one.unit, one.curves) for one in puma_moves.courses(number)]

    files: dict[str, str | bytes] = {}
    for number, (way, _) in puma_moves.CURVES.items():
        files[_name(number)] = panels(f"Figure {number}: {_kind(way)}", t, shown(number), marks=moments)
    for number, way in puma_moves.PATHS.items():
        X = puma_moves.poses_along(way, t)
        files[_name(number)] = path_in_space(f"Figure {number}: {_kind(way)}, path and approach vectors", X, places)
    for number, way in puma_moves.OVERVIEWS.items():
        X = puma_moves.poses_along(way, t)
        three = [shown(curve)[0] for curve, (of, _) in puma_moves.CURVES.items() if of == way]
        files[_name(number)] = overview(f"Figure {number}: {_kind(way)}", t, three, X, places)
    return {**files, **_films()}


def _films() -> dict[str, bytes]:
    import numpy as np

    from armwright.arm.load import load_arm
    from armwright.report.movie import films

    motion = puma_moves.joint_trajectory()
    move = Move(
        arm=load_arm("puma560-seed"),
        poses=puma_moves.study_poses(),
        times=np.array(puma_moves.TIMES),
        postures=np.radians(puma_moves.PRINTED_Q),
        label="",
        trajectory=motion,
        misses=np.zeros(len(puma_moves.NAMES)),
    )
    return {name.replace("move", f"figure{puma_moves.FILM}"): film for name, film in films(move).items()}


def printed(found: Mapping[str, Any]) -> "Iterator[Table]":
    """Give the tables as a terminal shows them."""
    postures = (
        row
        for one in found["postures"]
        for row in (
            (one["pose"], "printed", *(f"{q:z.2f}" for q in one["printed"]), ""),
            ("", "computed", *(f"{q:z.2f}" for q in one["computed"]), one["branch"]),
            ("", "allowed", *[""] * 6, "; ".join(one["allowed"])),
        )
    )
    heads = ("pose", "", *(f"j{i + 1} deg" for i in range(6)), "branch")
    yield study_table("Postures: printed, and computed from the printed poses", heads, postures)
    angles = (
        (one["pose"], *(f"{x:z.2f}" for x in one["matlab"]), *(f"{x:z.2f}" for x in one["nearest"]))
        for one in found["angles"]
    )
    heads = ("pose", "phi, MATLAB", "theta", "psi", "phi, nearest", "theta", "psi")
    yield study_table("ZYZ angles in degrees", heads, angles)
    yield study_table(
        "A second from A by B to C",
        (
            "move",
            "inverse solved",
            "way mm",
            "off A B C mm",
            "hand turns deg",
            "joints turn deg",
            "speed, of limit",
            "acceleration",
            "effort",
            "must run slower",
        ),
        map(_move, found["moves"]),
    )
    stops = ((one["way"], one["stopped"]) for one in found["moves"] if one["stopped"])
    yield study_table("What stops the Cartesian moves inside the joints' limits", ("move", "where and why"), stops)
    rounds = ((one["by"], "found" if one["found"] else "none", one["said"]) for one in found["ways round"])
    yield study_table("Straight lines with stops, and ways round", ("by", "way", "price, or what stops it"), rounds)


def _move(row: Mapping[str, Any]) -> Sequence[str]:
    parts = (f"{part:.2f} j{joint}" for part, joint in (row[limit] for limit in ("speed", "acceleration", "effort")))
    return (
        row["way"],
        str(row["inverse"]),
        f"{row['length'] * 1e3:.0f}",
        f"{row['off'] * 1e3:.0f}",
        f"{math.degrees(row['turn']):.0f}",
        f"{math.degrees(row['joints']):.0f}",
        *parts,
        f"{row['slower']:.1f} x",
    )


def _name(number: int) -> str:
    return f"figure{number:02d}.svg"


def _kind(way: puma_moves.Way) -> str:
    return "joint move" if way == "joint" else "Cartesian move"
