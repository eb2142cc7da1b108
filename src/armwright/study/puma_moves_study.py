"""The study of the PUMA's two moves through three poses: the project's figures 5 to 7, 10, 16 to 19, 22, 23 and 25."""

import math
from collections.abc import Callable, Iterator
from typing import Any, ClassVar

import attrs

from armwright.arm.load import load_arm
from armwright.files.result_table import ResultTable
from armwright.report.elements import Tile
from armwright.report.figures import Drawing, Film
from armwright.report.move_figures import overview, panels, path_figure
from armwright.report.movie import render_films
from armwright.study import puma_moves


@attrs.frozen(kw_only=True, eq=False)
class PumaMoves:
    """A joint move and a Cartesian move of the PUMA through three poses.

    Attributes:
        configurations: the joint positions of the poses, printed and computed.
        angles: their ZYZ angles.
        moves: utilization of the limits and further numbers of each move.
        detours: straight lines with stops, and detours around the singularity.
    """

    configurations: list[puma_moves.ConfigurationRow]
    angles: list[puma_moves.AngleRow]
    moves: list[puma_moves.MoveRow]
    detours: list[puma_moves.DetourRow]

    title: ClassVar[str] = "a joint move and a Cartesian move of the PUMA (figures 5 to 25 of the project)"
    notes: ClassVar[tuple[str, ...]] = ()

    @classmethod
    def run(cls, progress: Callable[[str, float], None] | None = None) -> "PumaMoves":  # noqa: ARG003 - takes seconds
        """Run the study."""
        configurations, angles = puma_moves.configuration_table(), puma_moves.angle_table()
        moves, detours = puma_moves.move_table(), puma_moves.detour_table()
        return cls(configurations=configurations, angles=angles, moves=moves, detours=detours)

    def as_data(self) -> dict[str, Any]:
        """Return the tables as plain data."""
        return attrs.asdict(self)

    def tables(self) -> Iterator[ResultTable]:
        """Yield the tables, printed beside computed."""
        yield ResultTable(
            title="Joint configurations: printed, and computed from the printed poses",
            heads=("pose", "", *(f"j{i + 1} deg" for i in range(6)), "branch"),
            rows=[
                line
                for row in self.configurations
                for line in (
                    (row.pose, "printed", *(f"{q:z.2f}" for q in row.printed), ""),
                    ("", "computed", *(f"{q:z.2f}" for q in row.computed), row.branch),
                    ("", "allowed", *[""] * 6, "; ".join(row.allowed)),
                )
            ],
        )
        yield ResultTable(
            title="ZYZ angles in degrees",
            heads=("pose", "phi, MATLAB", "theta", "psi", "phi, nearest", "theta", "psi"),
            rows=[(row.pose, *(f"{x:z.2f}" for x in (*row.matlab, *row.nearest))) for row in self.angles],
        )
        yield ResultTable(
            title="A second from A by B to C",
            heads=(
                *("move", "inverse solved", "path mm", "deviation from A B C mm", "tool rotates deg"),
                *("joints rotate deg", "speed, of limit", "acceleration", "effort", "must run slower"),
            ),
            rows=map(_move, self.moves),
        )
        yield ResultTable(
            title="Obstacles of the Cartesian moves within the joints' limits",
            heads=("move", "obstacle"),
            rows=[(row.name, row.stopped) for row in self.moves if row.stopped],
        )
        yield ResultTable(
            title="Straight lines with stops, and detours",
            heads=("method", "detour", "cost, or obstacle"),
            rows=[(row.method, "yes" if row.exists else "no", row.summary) for row in self.detours],
        )

    def headline(self) -> Iterator[Tile]:
        """Give by how much each move must run slower, and how many Cartesian moves are stopped."""
        for row in self.moves:
            yield Tile(
                f"{row.slower:.1f} x", f"slower within the limits: {row.name}", mark="warn" if row.slower > 1 else ""
            )
        stopped = sum(bool(row.stopped) for row in self.moves)
        yield Tile(f"{stopped} of {len(self.moves)}", "moves meet a stop of a joint", mark="bad" if stopped else "")

    def figures(self) -> list[Drawing | Film]:
        """Return the project's figures, the last one as a film."""
        t = puma_moves.sample_times()
        positions = dict(zip(puma_moves.NAMES, puma_moves.study_poses()[:, :3, 3], strict=True))
        pose_times = dict(zip(puma_moves.NAMES, puma_moves.TIMES, strict=True))
        drawn: dict[int, Drawing | Film] = {}
        curves = {number: puma_moves.figure_panels(number) for number in puma_moves.CURVES}
        for number, (kind, _) in puma_moves.CURVES.items():
            title = f"Figure {number}: {_title(kind)}"
            caption = f"{title}, {', '.join(dict.fromkeys(panel.title for panel in curves[number]))}"
            drawn[number] = Drawing(_name(number), caption, panels(title, t, curves[number], marks=pose_times))
        for number, kind in puma_moves.PATHS.items():
            title = f"Figure {number}: {_title(kind)}, path and approach vectors"
            svg = path_figure(title, puma_moves.poses_along(kind, t), positions)
            drawn[number] = Drawing(_name(number), title, svg)
        for number, kind in puma_moves.OVERVIEWS.items():
            three = [curves[shown][0] for shown, (moved, _) in puma_moves.CURVES.items() if moved == kind]
            X = puma_moves.poses_along(kind, t)
            title = f"Figure {number}: {_title(kind)}"
            svg = overview(title, t, three, X, positions)
            drawn[number] = Drawing(_name(number), f"{title}, everything together", svg)
        move = render_films(load_arm("puma560-seed"), puma_moves.joint_trajectory(), puma_moves.study_poses())
        name = _name(puma_moves.FILM)
        files = {film.replace("move", name): data for film, data in move.items()}
        drawn[puma_moves.FILM] = Film(name, f"Figure {puma_moves.FILM}: {_title('joint')}, as a film", files)
        return [drawn[number] for number in sorted(drawn)]


def _move(row: puma_moves.MoveRow) -> tuple[str, ...]:
    return (
        row.name,
        str(row.inverse),
        f"{row.length * 1e3:.0f}",
        f"{row.deviation * 1e3:.0f}",
        f"{math.degrees(row.rotation):.0f}",
        f"{math.degrees(row.joints):.0f}",
        *(f"{part:.2f} j{joint}" for part, joint in (row.speed, row.acceleration, row.effort)),
        f"{row.slower:.1f} x",
    )


def _name(number: int) -> str:
    return f"figure{number:02d}"


def _title(kind: puma_moves.MoveKind) -> str:
    return "joint move" if kind == "joint" else "Cartesian move"
