"""The error of the tip at rest over the workspace of two five-bars, as a controller has it that knows only the first.

Both are driven as the first would be without clearance, so that other lengths of the second count as much as its
clearances.

Source:
    Thesis, chapter 5, which compares arms at three goals; spec of the life, 6.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import attrs
import numpy as np

from armwright.arrays import Array, integer
from armwright.clearance.five_bar import FiveBar, inverse
from armwright.clearance.five_bar_parts import five_bar_coordinates
from armwright.clearance.five_bar_workspace import singularity_sines, workspace
from armwright.clearance.ideal import close_pins, tip_sensitivity
from armwright.clearance.linkage import Linkage
from armwright.clearance.plane_vectors import perpendicular
from armwright.clearance.static_equilibrium import find_static_equilibrium
from armwright.errors import InvalidValueError
from armwright.files.result_table import ResultTable

# Nearer to a singularity than this sine of an angle between links errors grow beyond any use.
_REGULAR = 0.2
# Cells along the longer side of the map.
_MOST_CELLS = 200


@attrs.frozen(kw_only=True, eq=False)
class ErrorMap:
    """Errors of two linkages at n positions.

    Attributes:
        linkages: both.
        positions: (n, 2) commanded [m].
        errors: (2, n, 2) of the tip at rest; NaN where a linkage has no equilibrium [m].
        spreads: (2, n) standard deviation of these by friction, which holds journals anywhere in their cones [m].
        cell: width of a cell of the map [m].
    """

    linkages: tuple[Linkage, Linkage]
    positions: Array
    errors: Array
    spreads: Array
    cell: float

    @property
    def sizes(self) -> Array:
        """(2, n) lengths of the errors [m]."""
        return np.asarray(np.linalg.norm(self.errors, axis=-1))

    @property
    def names(self) -> tuple[str, str]:
        """Names of both, told apart where they are equal."""
        first, second = (linkage.name for linkage in self.linkages)
        return (first, second) if first != second else (f"{first}, first", f"{second}, second")

    def rows(self) -> Iterator[tuple[str, Array, Array]]:
        """Give for each linkage, and for the second less the first, its name, lengths of errors and spreads (n) [m]."""
        known = np.all(np.isfinite(self.sizes), axis=0)
        yield from zip(self.names, self.sizes[:, known], self.spreads[:, known], strict=True)
        difference = np.linalg.norm(self.errors[1] - self.errors[0], axis=-1)[known]
        yield "distance of both tips", difference, np.hypot(*self.spreads[:, known])

    def as_data(self) -> dict[str, Any]:
        """Return the comparison as plain data in SI units."""
        known = np.all(np.isfinite(self.sizes), axis=0)
        where = self.positions[known]
        data: dict[str, Any] = {
            "linkages": [linkage.name for linkage in self.linkages],
            "clearances": [linkage.clearances for linkage in self.linkages],
            "positions": int(known.sum()),
            "without_equilibrium": int((~known).sum()),
            "second_better": float((self.sizes[1, known] < self.sizes[0, known]).mean()),
            "errors": [],
        }
        for name, size, spread in self.rows():
            worst = int(size.argmax())
            data["errors"].append(
                {
                    "name": name,
                    "mean": float(size.mean()),
                    "deviation": float(size.std()),
                    "largest": float(size[worst]),
                    "largest_spread": float(spread[worst]),
                    "largest_at": where[worst].tolist(),
                    "friction_spread": float(np.sqrt((spread**2).mean())),
                }
            )
        return data

    @property
    def notes(self) -> list[str]:
        """What the errors are of, and which linkage is better where."""
        data = self.as_data()
        notes = [
            f"{data['positions']} positions at rest, away from singularities",
            "both are driven as the first would be without clearance",
            "±: friction holds journals anywhere in their friction cones",
            f"the second has the smaller error at {data['second_better']:.0%} of them",
        ]
        if data["without_equilibrium"]:
            notes.append(f"{data['without_equilibrium']} more positions have no equilibrium in one of them")
        return notes

    def tables(self) -> Iterator[ResultTable]:
        """Give mean and largest errors."""
        yield ResultTable(
            title="Error over the workspace",
            heads=("linkage", "mean mm", "over positions ± mm", "largest mm", "± mm", "at x mm", "y mm"),
            rows=[
                (
                    row["name"],
                    *(f"{row[key] * 1e3:.4f}" for key in ("mean", "deviation", "largest", "largest_spread")),
                    *(f"{x * 1e3:.1f}" for x in row["largest_at"]),
                )
                for row in self.as_data()["errors"]
            ],
            numbers=range(1, 7),
        )


def compare_linkages(first: Linkage, second: Linkage, cells: int = 40) -> ErrorMap:
    """Return the errors of two five-bars over the workspace of the first, with its elbows out.

    Args:
        first: whose drives move both.
        second: another one, or the same with other lengths or clearances.
        cells: of the map along its longer side.

    Raises:
        InvalidValueError: one is no five-bar, or the cells are too few or too many.
    """
    if integer(cells, "cells", least=2) > _MOST_CELLS:
        raise InvalidValueError(f"cells: expected 2 to {_MOST_CELLS}, got {cells}")
    bar = FiveBar.of(first)
    FiveBar.of(second)
    space = workspace(bar, cells)
    grid = np.stack(np.meshgrid(space.x, space.y), axis=-1)[space.reachable]
    grid = grid[grid[:, 1] < bar.motors[:, 1].min()]
    angles = inverse(bar, grid)
    regular = np.all(np.abs(singularity_sines(angles)) > _REGULAR, axis=-1)
    positions, angles = grid[regular], angles[regular]
    drives = close_pins(first, five_bar_coordinates(first, angles), tip=positions)[:, list(first.driven)]
    errors, spreads = np.zeros((2, len(positions), 2)), np.zeros((2, len(positions)))
    for k, linkage in enumerate((first, second)):
        guess = five_bar_coordinates(linkage, angles)
        errors[k], spreads[k] = _errors_at_rest(linkage, guess, drives, positions)
    return ErrorMap(
        linkages=(first, second),
        positions=positions,
        errors=errors,
        spreads=spreads,
        cell=float(np.diff(space.x[:2])[0]),
    )


def _errors_at_rest(linkage: Linkage, guess: Array, drives: Array, positions: Array) -> tuple[Array, Array]:
    """Return (n, 2) errors and (n,) their spreads by friction; NaN where there is no equilibrium."""
    try:
        q = close_pins(linkage, guess, drives=drives)
        rest = find_static_equilibrium(linkage, q)
        gains = tip_sensitivity(linkage, q)
    except InvalidValueError:
        if len(positions) == 1:
            return np.full((1, 2), np.nan), np.full(1, np.nan)
        half = len(positions) // 2
        parts = [
            _errors_at_rest(linkage, guess[rows], drives[rows], positions[rows])
            for rows in (slice(half), slice(half, None))
        ]
        return np.concatenate([part[0] for part in parts]), np.concatenate([part[1] for part in parts])
    # Across its gap a journal lies anywhere within the cone; the variance of an even spread is a third of the square.
    across = perpendicular(rest.gaps) * np.arctan(linkage.material.friction)
    shifts = np.einsum("nipj,npj->npi", gains, across)
    return rest.tip - positions, np.sqrt((shifts**2).sum(axis=(1, 2)) / 3)
