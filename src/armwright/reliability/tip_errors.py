"""Errors of the resting tip of a linkage by the deviations of its dimensions, linear and in full equilibrium.

A clearance only ever displaces a journal one way: its mean shifts the tip, as every other systematic error does, and
its tolerance spreads it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from armwright.arrays import Array, ArrayLike, Numbers, of_shape
from armwright.clearance.dimensions import deviate
from armwright.clearance.ideal import close_pins, tip_position
from armwright.clearance.linkage import Linkage
from armwright.clearance.poses import closed_at, pose_size
from armwright.clearance.sensitivities import RestSensitivities, rest_sensitivities
from armwright.clearance.static_equilibrium import find_static_equilibrium
from armwright.reliability.allocation import Rule
from armwright.reliability.assessment import Mechanism, ToleranceAssessment, assess
from armwright.reliability.linear_error import LinearError
from armwright.reliability.tip_samples import TipErrorTask, tip_samples
from armwright.reliability.tolerances import Tolerance

if TYPE_CHECKING:
    from armwright.sweep.machines import Machines

# A play and a length that move the tip in directions with a larger cosine are as good as one.
_ALIKE = 0.99


def sampled_tip_errors(linkage: Linkage, q: ArrayLike, names: Sequence[str], deviations: ArrayLike) -> Array:
    """Return by how much the tips of linkages whose dimensions deviate rest elsewhere, in full equilibrium.

    Args:
        linkage: the nominal one, with its mean clearances.
        q: (p, n) its coordinates with closed pins, at which the drives are locked.
        names: of k dimensions.
        deviations: (samples, k) of these [m, rad, kg, N].

    Returns:
        (samples, p, 2) from the tip of the linkage without clearance [m].

    Raises:
        InvalidValueError: a linkage within the deviations cannot be assembled.
    """
    closed = of_shape(q, (len(linkage.coordinates),), "q")
    drives, ideal = closed[:, list(linkage.driven)], tip_position(linkage, closed)
    drawn = of_shape(deviations, (len(names),), "deviations")
    errors = np.empty((len(drawn), *ideal.shape))
    for k, own in enumerate(drawn):
        other, shifts = deviate(linkage, dict(zip(names, own.tolist(), strict=True)))
        start = close_pins(other, closed, drives=drives + shifts)
        errors[k] = find_static_equilibrium(other, start).tip - ideal
    return errors


def assess_linkage_tolerances(
    linkage: Linkage,
    poses: ArrayLike,
    tolerances: Sequence[Tolerance],
    *,
    corrected: bool = False,
    limit: float | None = None,
    allocation: Rule | None = None,
    samples: int = 200,
    seed: int = 0,
    uniform: bool = False,
    most: int = 200,
    machines: Machines | None = None,
    progress: Callable[[str], None] | None = None,
) -> ToleranceAssessment:
    """Assess what tolerances of a linkage's dimensions do to the position of its resting tip.

    Args:
        linkage: with its mean clearances.
        poses: (p, 2) positions of the tip without clearance [m], or (p, 1) coordinates of its only drive [rad, m].
        tolerances: of dimensions of the linkage.
        corrected: whether the path is corrected for the mean linkage, so that only deviations from that count. The
            shift of the tip by mean clearances is part of the error otherwise.
        limit: of the error [m]; without it there are no probabilities.
        allocation: rule by which tolerances of least cost keep the limit; None for no such tolerances.
        samples: how many random linkages are drawn, in full equilibrium.
        seed: of all samples.
        uniform: whether the deviations of these are uniform within tolerances, and not normal.
        most: of more poses, so many are computed, evenly spread, the first and the last included.
        machines: that compute the random linkages as a sweep; this process where there are none. The results are the
            same.
        progress: is told what is being done.

    Raises:
        ShapeError: the poses do not fit the linkage.
        UnknownNameError: a tolerance is of no dimension of the linkage.
        InvalidValueError: a pose cannot be reached, a pin carries no force there, a number is out of its range, or
            tolerances of least cost are asked for without a limit.
        TooFewError: there is no pose, or no tolerance.
    """
    every = np.atleast_2d(of_shape(poses, (pose_size(linkage),), "poses"))
    names = [tolerance.name for tolerance in tolerances]

    def mechanism_at(rows: Numbers) -> Mechanism:
        q = closed_at(linkage, every[rows])
        rest, ideal = rest_sensitivities(linkage, q), tip_position(linkage, q)
        mean = rest.tip - ideal
        task = TipErrorTask(
            linkage=linkage.name,
            poses=len(q),
            errors=partial(sampled_tip_errors, linkage, q, names),
            settings={"linkage": linkage.as_data(), "q": q.tolist(), "deviations": names},
        )

        def lengths(deviations: Array, say: Callable[[str], None]) -> Array:
            errors = tip_samples(task, deviations, seed=seed, machines=machines, say=say)
            return np.asarray(np.linalg.norm(errors - mean * corrected, axis=-1), dtype=np.float64)

        drives = q[:, list(linkage.driven)]
        return Mechanism(
            name=linkage.name,
            kind="linkage",
            point="tip",
            complete="full equilibrium",
            poses={"tip_m": ideal, "drives": drives, "systematic_m": mean},
            error=LinearError(
                names=tuple(names),
                deviations=[tolerance.standard_deviation for tolerance in tolerances],
                offset=np.zeros_like(mean) if corrected else mean,
                jacobian=np.stack([rest.column(name) for name in names], axis=-1),
            ),
            lengths=lengths,
            notes=(_mean_note(mean, corrected=corrected), *_play_notes(rest, names)),
        )

    return assess(
        mechanism_at,
        len(every),
        tolerances,
        limit=limit,
        allocation=allocation,
        samples=samples,
        seed=seed,
        uniform=uniform,
        most=most,
        progress=progress,
    )


def _mean_note(mean: Array, *, corrected: bool) -> str:
    size = float(np.linalg.norm(mean, axis=-1).max()) * 1e3
    if corrected:
        return (
            f"The path is taken as corrected for mean clearances, which shift the resting tip by up to {size:.4f} mm: "
            "only deviations from the mean linkage count."
        )
    return (
        f"Mean clearances shift the resting tip by up to {size:.4f} mm, which counts as error; a path that is "
        "corrected for them takes this away."
    )


def _play_notes(rest: RestSensitivities, names: Sequence[str]) -> list[str]:
    """Return a note for each pair of a play and a length that move the tip alike at all poses."""
    notes = []
    kinds = {dimension.name: dimension.kind for dimension in rest.dimensions}
    lengths = [name for name in names if kinds[name] == "length"]
    for play in (name for name in names if kinds[name] == "clearance"):
        for length in lengths:
            b, d = rest.column(play).ravel(), rest.column(length).ravel()
            size = float(np.linalg.norm(b) * np.linalg.norm(d))
            if size > 0 and abs(float(b @ d)) > _ALIKE * size:
                pin, body = play.removesuffix(".clearance"), length.removesuffix(".length")
                notes.append(
                    f"Play in {pin} moves the tip as the length of {body} does: measurements tell them apart only when "
                    "the load is reversed."
                )
    return notes
