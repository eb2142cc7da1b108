"""Cornering: how a sharp corner of a path is rounded off, CR, and overshot, CO."""

from collections.abc import Sequence

import attrs
import numpy as np

from armwright.accuracy.cycles import check_cycles
from armwright.accuracy.planes import Legs, legs_of
from armwright.accuracy.trace import Trace, frozen_array, refuse_mixed_dimensions
from armwright.arrays import Array, positive, reduce_by_fields
from armwright.errors import InvalidValueError

# Of a leg that ends in another corner, so much belongs to the corner it comes from.
_LEG_SHARE = 0.5


@attrs.frozen(kw_only=True, eq=False)
class CornerDeviation:
    """What becomes of one corner.

    Attributes:
        round_off: CR, the smallest distance of the run from the corner, mean of all cycles [m].
        overshoot: CO, the largest distance from the second leg on the side to which the first one leads on, mean of
            all cycles [m].
        settling_length: from the corner along the second leg until the run keeps to the band, mean of all cycles [m];
            infinite where a run does not, None where no band is given.
        round_offs: (n,) of each cycle [m].
        overshoots: (n,) of each cycle [m].
        position: (2,) or (3,) the corner [m].
        cycles: n.
    """

    round_off: float
    overshoot: float
    settling_length: float | None
    round_offs: Array = attrs.field(converter=frozen_array)
    overshoots: Array = attrs.field(converter=frozen_array)
    position: Array = attrs.field(converter=frozen_array)
    cycles: int

    __reduce__ = reduce_by_fields


def corner_deviations(
    commanded: Trace, runs: Sequence[Trace], *, band: float | None = None, few: bool = False
) -> tuple[CornerDeviation, ...]:
    """Return CR, CO and the stabilisation path length at every corner of a path.

    Args:
        commanded: its points, from start to end; it has a corner where its direction changes by more than 20 deg.
        runs: what was measured, each from start to end.
        band: distance from the second leg that counts as being on it again, usually AT [m].
        few: take fewer than 3 cycles.

    Raises:
        KindError: the band is not a number.
        ShapeError: path and runs have different numbers of columns.
        InvalidValueError: there are too few cycles, the path has no corner, or a run ends before a corner.

    Source:
        ISO 9283:1998, 8.5.
    """
    count = check_cycles("cornering", [len(runs)], few=few, least=1)
    refuse_mixed_dimensions([commanded.positions, *(run.positions for run in runs)], "cornering")
    if band is not None:
        positive(band, "cornering: band", "m")
    legs = legs_of(commanded)
    corners = np.flatnonzero(legs.corners)
    if not len(corners):
        raise InvalidValueError("cornering: the commanded path has no change of direction by more than 20 deg")
    corner_results = []
    for corner in corners.tolist():
        rows = [_measure_corner(legs, corner, run, band, f"cornering: run {j + 1}") for j, run in enumerate(runs)]
        round_offs, overshoots, lengths = zip(*rows, strict=True)
        corner_results.append(
            CornerDeviation(
                round_off=float(np.mean(round_offs)),
                overshoot=float(np.mean(overshoots)),
                settling_length=None if band is None else float(np.mean(lengths)),
                round_offs=round_offs,
                overshoots=overshoots,
                position=legs.positions[corner],
                cycles=count,
            )
        )
    return tuple(corner_results)


def _measure_corner(legs: Legs, corner: int, run: Trace, band: float | None, name: str) -> tuple[float, float, float]:
    """Return nearest distance, overshoot and stabilisation path length of one run at one corner."""
    point = legs.positions[corner]
    near, after = _nearest_passage(run.positions, point)
    u1, u2 = legs.directions[corner - 1], legs.directions[corner]
    next_corners = np.flatnonzero(legs.corners[corner + 1 :])
    end = legs.stations[corner + 1] - legs.stations[corner]
    if len(next_corners):
        end *= _LEG_SHARE
    relative = run.positions[after:] - point
    along = relative @ u2
    past_end = np.flatnonzero(along > end)
    relative = relative[: past_end[0]] if len(past_end) else relative
    along = along[: len(relative)]
    on = along >= 0
    if not on.any():
        where = f"the leg after the corner at {legs.stations[corner] * 1e3:.4g} mm of the path"
        raise InvalidValueError(f"{name} has no sample on {where}")
    offset = relative - along[:, None] * u2
    onward = u1 - (u1 @ u2) * u2
    size = np.linalg.norm(onward)
    # Where the path reverses there is no such side.
    beyond = on & (offset @ (onward / size) > 0) if size > 0 else np.zeros_like(on)
    distances = np.linalg.norm(offset, axis=1)
    over = float(distances[beyond].max(initial=0.0))
    return near, over, _settling_length(along[on], distances[on], band)


def _nearest_passage(positions: Array, point: Array) -> tuple[float, int]:
    """Return the smallest distance of a run from a point, and the number of the first sample after it."""
    starts, steps = positions[:-1], np.diff(positions, axis=0)
    squares = np.sum(steps**2, axis=1)
    part = np.sum((point - starts) * steps, axis=1) / np.where(squares > 0, squares, 1.0)
    distances = np.linalg.norm(starts + np.clip(part, 0, 1)[:, None] * steps - point, axis=1)
    piece = int(np.argmin(distances))
    return float(distances[piece]), piece + 1


def _settling_length(along: Array, distances: Array, band: float | None) -> float:
    """Return where along a leg the distances come within the band for good; infinite where they do not."""
    if band is None:
        return np.nan
    outside = np.flatnonzero(distances > band)
    if not len(outside):
        return 0.0
    last = int(outside[-1])
    if last + 1 == len(distances):
        return np.inf
    part = (distances[last] - band) / (distances[last] - distances[last + 1])
    return float(along[last] + part * (along[last + 1] - along[last]))
