"""Inverse kinematics at the edges: every library on the same poses, judged by Pinocchio's forward kinematics.

Run with `make edges`. Writes the measured part of docs/physics/inverse-at-the-edges.md.
"""

from measure import processor, progress, table  # isort: skip - sets the threads first

import platform
from importlib.metadata import version
from itertools import groupby
from pathlib import Path

import attrs
import numpy as np
import pinocchio as pin
from edge_sets import ARMS, DECADES, EdgeSet, edge_sets
from edge_solvers import Reply, Solver, solvers

from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.spatial.rotations import nearest_rotation
from oracles.with_pinocchio import pinocchio_model

PAGE = Path(__file__).parents[1] / "docs/physics/inverse-at-the-edges.md"
START, END = "<!-- measured -->", "<!-- end of measured -->"
PEERS = ("armwright", "eaik", "roboticstoolbox-python", "pin", "numpy")
# The configuration that made a pose is found again within this [rad] or [m].
OWN = 1e-6
# Rows this near to each other are one row twice [rad] or [m].
TWICE = 1e-8
# What rounding may take of a limit.
ON_LIMIT = 1e-9


@attrs.frozen(kw_only=True, eq=False)
class Judged:
    """One reply, looked at.

    Attributes:
        solved: whether one of the rows meets the pose.
        own: whether the configuration that made the pose is among them.
        rows: how many there are.
        twice: how many of them repeat another.
        residual: the largest among those that are said to meet the pose, m or rad; 0 without any.
        misreported: how far the reported residuals are from the true ones at most; None where none are reported.
        inside: whether one of the rows meets the pose inside the limits.
        faults: what is wrong with the verdict.
    """

    solved: bool
    own: bool
    rows: int
    twice: int
    residual: float
    misreported: float | None
    inside: bool
    faults: tuple[str, ...] = ()


class Judge:
    """Pinocchio's model of an arm."""

    def __init__(self, arm: Arm) -> None:
        self.model, self.data, self.tool = pinocchio_model(arm)
        self.turns = np.array([joint.revolute for joint in arm.joints])

    def errors(self, q: Array, X: Array) -> tuple[float, float]:
        """Return how far from a pose a configuration puts the hand [m] and [rad]."""
        pin.framesForwardKinematics(self.model, self.data, q)
        place = self.data.oMf[self.tool]
        R = X[:3, :3].T @ place.rotation
        sine = np.linalg.norm((R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1])) / 2
        return float(np.linalg.norm(place.translation - X[:3, 3])), float(np.arctan2(sine, (np.trace(R) - 1) / 2))

    def apart(self, a: Array, b: Array) -> Array:
        """Return how far configurations (..., 6) are apart, but for whole turns (...)."""
        gap = np.abs(a - b)
        return np.where(self.turns, np.abs(np.remainder(gap + np.pi, 2 * np.pi) - np.pi), gap).max(axis=-1)

    def inside(self, arm: Arm, q: Array) -> bool:
        """Whether a configuration is inside the limits, by whole turns if need be."""
        images = q[:, None] + np.where(self.turns[:, None], 2 * np.pi * np.arange(-2, 3), 0.0)
        lower, upper = arm.limits.lower[:, None] - ON_LIMIT, arm.limits.upper[:, None] + ON_LIMIT
        return bool(((images >= lower) & (images <= upper)).any(axis=-1).all())

    def look(self, edge: EdgeSet, k: int, reply: Reply) -> Judged:
        """Look at the reply to pose k of a set."""
        X = edge.X[k].copy()
        X[:3, :3] = nearest_rotation(X[:3, :3])
        errors = np.array([self.errors(q, X) for q in reply.rows]).reshape(-1, 2)
        met = errors.max(axis=-1, initial=0.0) <= edge.met
        gaps = np.abs(reply.rows - edge.q[k]).max(axis=-1) if edge.turns else self.apart(reply.rows, edge.q[k])
        kept: list[Array] = []
        for row in reply.rows:
            if all(self.apart(row, other) > TWICE for other in kept):
                kept.append(row)
        reported = None if reply.errors is None else float(np.abs(reply.errors - errors).max())
        return Judged(
            solved=bool(met.any()),
            own=bool((gaps < OWN).any()),
            rows=len(reply.rows),
            twice=len(reply.rows) - len(kept),
            residual=float(errors[reply.claimed].max(initial=0.0)),
            misreported=reported,
            inside=any(self.inside(edge.arm, row) for row in reply.rows[met]),
            faults=("a row that misses",) if (reply.claimed & ~met).any() else (),
        )


def measure(edge: EdgeSet, found: dict[str, Solver]) -> dict[str, list[Judged]]:
    """Ask every library for every pose of a set, and judge what they say."""
    judge = Judge(edge.arm)
    replies = {
        title: [solver.solve(edge.arm, X, q if edge.turns else None) for X, q in zip(edge.X, edge.q, strict=True)]
        for title, solver in found.items()
    }
    judged = {title: [judge.look(edge, k, reply) for k, reply in enumerate(many)] for title, many in replies.items()}
    for k, q in enumerate(edge.q):
        # A configuration inside the limits exists where the pose was made of one, or where any library has shown one.
        inside = edge.reachable and (judge.inside(edge.arm, q) or any(many[k].inside for many in judged.values()))
        for title, many in replies.items():
            wrong = _faults(edge, many[k], inside=inside)
            judged[title][k] = attrs.evolve(judged[title][k], faults=judged[title][k].faults + wrong)
    return judged


def _faults(edge: EdgeSet, reply: Reply, *, inside: bool) -> tuple[str, ...]:
    if edge.reachable and reply.reached is False:
        return ("called out of reach",)
    if not edge.reachable and (reply.reached or reply.inside):
        return ("called in reach",)
    if reply.inside is not None and reply.inside != inside:
        return ("called out of limits" if inside else "called inside the limits",)
    return ()


def summary(title: str, many: list[Judged], solver: Solver, *, own: bool, reachable: bool) -> list[str]:
    """Return one row of the table of an arm."""
    faults = [fault for one in many for fault in one.faults]
    counts = ", ".join(f"{faults.count(fault)} {fault}" for fault in sorted(set(faults)))
    twice, rows = [one.twice for one in many], [one.rows for one in many]
    said = max(one.residual for one in many)
    return [
        title,
        percent([one.solved for one in many]) if reachable else "-",
        percent([one.own for one in many]) if own and not solver.one else "-",
        f"{np.mean(rows):.1f} / {max(rows)}",
        f"{np.mean(twice):.2f} / {max(twice)}",
        f"{said:.0e}" if said else "-",
        f"{sum(bool(one.faults) for one in many)}{f' ({counts})' if counts else ''}",
    ]


def percent(flags: list[bool]) -> str:
    """Return a share in per cent, rounded down, so that 100 means all."""
    share = 100 * np.mean(flags)
    return f"{share:.0f}" if share in (0, 100) else f"{np.floor(10 * share) / 10:.1f}"


def report(name: str) -> list[str]:
    """Measure one arm; return the parts of its section."""
    found = solvers(name)
    rows: list[list[str]] = []
    decades: list[list[str]] = []
    misreported: dict[str, float] = {}
    for label, group in groupby(edge_sets(name), key=label_of):
        edges = [edge for edge in group if len(edge.X)]
        if not edges:
            continue
        progress(f"{name}: {label}")
        measured = [measure(edge, found) for edge in edges]
        poses, first = sum(len(edge.X) for edge in edges), edges[0]
        for title, solver in found.items():
            together = [one for judged in measured for one in judged[title]]
            row = summary(title, together, solver, own=first.own, reachable=first.reachable)
            rows.append([f"{label} ({poses})" if title == next(iter(found)) else "", *row])
            told = [one.misreported for one in together if one.misreported is not None]
            misreported[title] = max([misreported.get(title, 0.0), *told])
        if len(edges) > 1:
            decades += [by_decade(title, solver, edges, measured) for title, solver in found.items()]
    head = [
        "poses (how many)",
        "library",
        "solved, %",
        "own configuration, %",
        "rows, mean / most",
        "twice, mean / most",
    ]
    return [
        f"### `{name}`",
        table([*head, "worst residual of a claim", "wrong verdicts"], rows),
        f"The residuals that armwright reports have errors of {misreported['armwright']:.0e} at most.",
        table(["solved / own configuration, %", "library", *(f"{x:g}" for x in DECADES if x)], decades),
    ]


def label_of(edge: EdgeSet) -> str:
    """Return what a set is called in the table: all distances from one singularity are one row."""
    if edge.decade is None:
        return edge.name
    return (
        f"beside the {edge.name} singularity, 1e-3 to 1e-9"
        if edge.decade
        else f"exactly at the {edge.name} singularity"
    )


def by_decade(title: str, solver: Solver, edges: list[EdgeSet], measured: list[dict[str, list[Judged]]]) -> list[str]:
    """Return one row of the table by distance from a singularity."""
    cells = []
    for judged in measured:
        own = "-" if solver.one else percent([one.own for one in judged[title]])
        cells.append(f"{percent([one.solved for one in judged[title]])} / {own}")
    return [edges[0].name if title == "armwright" else "", title, *cells]


def main() -> None:
    """Measure all arms and write the page."""
    versions = ", ".join(f"{peer} {version(peer)}" for peer in PEERS)
    parts = [
        f"`make edges` on {processor()}, Python {platform.python_version()}, {versions}.",
        *(part for name in ARMS for part in report(name)),
    ]
    text = PAGE.read_text(encoding="utf-8")
    (before, rest), measured = text.split(START), "\n\n".join(parts)
    print(measured)
    PAGE.write_text(f"{before}{START}\n\n{measured}\n\n{END}{rest.split(END)[1]}", encoding="utf-8")


if __name__ == "__main__":
    main()
