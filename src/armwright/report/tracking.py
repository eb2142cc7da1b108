"""What was measured in a run, beside what was planned: motions, pictures, and the largest errors in words."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt

from armwright.arrays import Array
from armwright.cell.observations import MeasuredStream, Picture
from armwright.program.vm.recording import Recording, Stream
from armwright.report.page import MeasuredMotion, SeenPicture
from armwright.report.stick_figure import thinned_rows

# Pictures of a page at most, and their bytes together.
_MAX_PICTURES, _MAX_BYTES = 60, 6_000_000
# Nobody is told of less [mm].
_LEAST = 1e-3


def measured_motion(planned: Stream, measured: MeasuredStream) -> MeasuredMotion | None:
    """Return what was measured of an arm, at as many instants as a chart shows; None where nothing was.

    Args:
        planned: the motion of the same arm.
        measured: at instants within it.
    """
    if not len(measured.t):
        return None
    error = tracking_error(planned, measured)
    rows = thinned_rows(len(measured.t))
    sizes = np.abs(error)
    return MeasuredMotion(
        t=measured.t[rows],
        q=measured.q[rows],
        qd=measured.qd[rows],
        tau=measured.tau[rows],
        error=largest_between(error, rows),
        worst=sizes.max(axis=0),
        worst_t=measured.t[sizes.argmax(axis=0)],
    )


def nearest_ticks(ticks: Array, t: Array) -> npt.NDArray[np.intp]:
    """Return the numbers of the evenly spaced ticks (k,) next to some instants, the last one behind the end."""
    period = ticks[1] - ticks[0] if len(ticks) > 1 else 1.0
    return np.clip(np.round(t / period).astype(np.intp), 0, len(ticks) - 1)


def tracking_error(planned: Stream, measured: MeasuredStream) -> Array:
    """Return the measured less the planned positions (k, n), the planned ones linear between their ticks."""
    columns = [np.interp(measured.t, planned.t, q) for q in planned.q.T]
    return np.asarray(measured.q - np.stack(columns, axis=1))


def largest_between(values: Array, rows: npt.NDArray[np.intp]) -> Array:
    """Return of each column (k, n) the value of the largest magnitude from each of these rows up to the next."""
    high, low = np.maximum.reduceat(values, rows), np.minimum.reduceat(values, rows)
    return np.where(-low > high, low, high)


def seen_pictures(pictures: Sequence[Picture]) -> tuple[list[SeenPicture], list[str]]:
    """Return as many of the first pictures as a page can hold, and a note if others are left out."""
    shown: list[SeenPicture] = []
    size = 0
    for picture in pictures[:_MAX_PICTURES]:
        size += len(picture.png)
        if size > _MAX_BYTES:
            break
        shown.append(
            SeenPicture(
                t=picture.time,
                camera=picture.camera,
                frame=picture.frame,
                found=picture.found,
                text=picture.text,
                png=base64.b64encode(picture.png).decode("ascii"),
            )
        )
    omitted = f"this page shows the first {len(shown)} of {len(pictures):,} pictures; all in the files seen-*.png"
    return shown, [omitted] if len(shown) < len(pictures) else []


def physics_text(recording: Recording) -> str:
    """Return how well arms and hands did in a cell with physics; nothing of one without."""
    facts = recording.observations.facts
    if not facts:
        return ""
    tips, slips = facts["tip"], facts["slip"]
    assert isinstance(tips, Mapping)  # noqa: S101 - of a cell with physics
    assert isinstance(slips, Mapping)  # noqa: S101
    arms = [f"{arm}: tip within {_millimetres(tip)} of where it was sent" for arm, tip in tips.items()]
    held = [f", parts within {_millimetres(slip)} in the hand" if slip else "" for slip in slips.values()]
    return "; ".join(arm + hand for arm, hand in zip(arms, held, strict=True))


def _millimetres(length: float) -> str:
    return f"{max(length * 1e3, _LEAST):.2g} mm"
