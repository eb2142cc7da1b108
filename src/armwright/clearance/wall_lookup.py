"""The part of a compiled simulation that looks up the walls of worn pins; see ``worn_walls``.

The functions are emitted for a linkage, see ``lane_layout``.
"""

from __future__ import annotations

from math import floor

from armwright.arrays import Array
from armwright.clearance.lane_layout import FIRST_WALL, LANES, PINS

# A place farther than so many cells from the first is no number any more.
FARTHEST_CELL = 1e9


def look_up_walls(x: Array, y: Array, walls: Array) -> None:
    """Set growth, slope and turning of the wall of each pin, in all lanes.

    Args:
        x: (INPUTS · LANES,) of which those of the walls are filled.
        y: (OUTPUTS · LANES,) of each pin the direction of the gap and the rotation of the journal [rad].
        walls: (PINS, m + 3, m + 3) growth by rotation and direction [m].
    """
    m = walls.shape[1] - 3
    cells = m / 6.283185307179586
    for i in range(PINS):
        for k in range(LANES):
            along, across = y[2 * i * LANES + k] * cells, y[(2 * i + 1) * LANES + k] * cells
            # A lane that has diverged has no place in the table.
            if not (abs(along) < FARTHEST_CELL and abs(across) < FARTHEST_CELL):
                along, across = 0.0, 0.0
            column, row = floor(along), floor(across)
            t, s = along - column, across - row
            u, v = 1.0 - t, 1.0 - s
            a0, a1, a2, a3 = u * u * u, t * t * (3.0 * t - 6.0) + 4.0, u * u * (3.0 * u - 6.0) + 4.0, t * t * t
            d0, d1, d2, d3 = -3.0 * u * u, t * (9.0 * t - 12.0), u * (12.0 - 9.0 * u), 3.0 * t * t
            b0, b1, b2, b3 = v * v * v, s * s * (3.0 * s - 6.0) + 4.0, v * v * (3.0 * v - 6.0) + 4.0, s * s * s
            e0, e1, e2, e3 = -3.0 * v * v, s * (9.0 * s - 12.0), v * (12.0 - 9.0 * v), 3.0 * s * s
            first, second = int(column) % m, int(row) % m
            growth, slope, turning = 0.0, 0.0, 0.0
            for j in range(4):
                cell = walls[i, second + j]
                c0, c1, c2, c3 = cell[first], cell[first + 1], cell[first + 2], cell[first + 3]
                value = a0 * c0 + a1 * c1 + a2 * c2 + a3 * c3
                b = b0 if j == 0 else (b1 if j == 1 else (b2 if j == 2 else b3))
                e = e0 if j == 0 else (e1 if j == 1 else (e2 if j == 2 else e3))
                growth += b * value
                slope += b * (d0 * c0 + d1 * c1 + d2 * c2 + d3 * c3)
                turning += e * value
            first_wall = (FIRST_WALL + 3 * i) * LANES + k
            x[first_wall] = growth / 36.0
            x[first_wall + LANES] = slope * cells / 36.0
            x[first_wall + 2 * LANES] = turning * cells / 36.0
