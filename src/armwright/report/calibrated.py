"""A calibration with all that is told of it: what was found, what is held, how good it is on points held out."""

import math
from collections.abc import Callable, Iterator
from typing import Any

import attrs
import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.calibration.chain import chain_of
from armwright.calibration.contradictions import contradictions, refuse_noise
from armwright.calibration.cross_validation import HeldOut, cross_validate
from armwright.calibration.fitting import Calibration, calibrate
from armwright.calibration.iso9283 import Accuracy, Repeatability, accuracy, repeatability
from armwright.calibration.joint_errors import largest_gravity_efforts
from armwright.calibration.measurement_model import PoseError
from armwright.calibration.measurements import Measurements
from armwright.calibration.nongeometric import NongeometricCalibration, calibrate_nongeometric
from armwright.calibration.readings import refuse_not_fitted
from armwright.errors import ContradictionError, InvalidValueError
from armwright.spatial.euler import to_rpy

# Turns about y, which a Denavit-Hartenberg table has no number for.
_TILTS = ("beta",)
# An arm whose points are farther from it is not measured in its own frame [m].
_ELSEWHERE = 0.2
# How many readings a note names.
_SHOWN = 8


@attrs.frozen(kw_only=True, eq=False)
class Calibrated:
    """A calibration with all that is told of it.

    Attributes:
        arm: as it was said to be.
        measurements: what was measured.
        full: with all errors that can be told.
        table: without turns about y, for arm files.
        raw: (p,) distances of the points from the arm as said, where it stands in the measuring frame; none where it
            stands elsewhere [m].
        held_out: from arms calibrated without the reading, all errors.
        held_out_region: from arms calibrated without the region of the workspace in which the reading lies; None where
            a region cannot be left out.
        held_out_table: likewise, without turns about y.
        checked: by how much readings that the file keeps for checking miss the corrected arm.
        accuracy: AP and AD of the arm as said, with its base moved, and calibrated (held out); None without points.
        repeatability: RP of postures that were measured more than once; None where none was.
        beyond: what beyond geometry was tried; None where nothing was.
        doubts: by what the readings contradict the arm that was fitted to them; empty where they do not.
        notes: what is worth a sentence.
    """

    arm: Arm
    measurements: Measurements
    full: Calibration
    table: Calibration
    raw: Array
    held_out: HeldOut
    held_out_region: HeldOut | None
    held_out_table: HeldOut
    checked: PoseError
    accuracy: dict[str, Accuracy] | None
    repeatability: Repeatability | None
    beyond: NongeometricCalibration | None
    contradictions: tuple[str, ...]
    notes: tuple[str, ...]


def calibrated(
    arm: Arm,
    measurements: Measurements,
    *,
    folds: int = 5,
    seed: int = 0,
    beyond: bool = False,
    noise: float | None = None,
    progress: Callable[[str], None] | None = None,
) -> Calibrated:
    """Calibrate an arm with and without turns about y, and hold readings out.

    Args:
        arm: as it is said to be.
        measurements: of it.
        folds: parts in which postures are held out.
        seed: of the parts.
        beyond: whether to try what is not geometry.
        noise: standard deviation of a measured coordinate; where it is stated, readings that are farther off than it
            explains make the calibration doubtful [m].
        progress: told what is being done.

    Raises:
        InvalidValueError: see ``calibrate`` and ``cross_validate``; readings to check with are told in a frame, of
            a plane or from an anchor that none is fitted of.
        ShapeError: the readings are of an arm with another number of joints.
    """

    def told(what: str) -> None:
        if progress is not None:
            progress(what)

    # Before a fit of some seconds.
    if noise is not None:
        refuse_noise(noise)
    fit = ~measurements.check
    seen = measurements.readings.take(fit)
    refuse_not_fitted(seen, measurements.readings.take(~fit))
    full = calibrate(arm, seen, progress=progress)
    table = full if not any(name.endswith(_TILTS) for name in full.names) else calibrate(arm, seen, without=_TILTS)
    tried = (
        calibrate_nongeometric(arm, seen, folds=folds, seed=seed, unseen=True, progress=progress) if beyond else None
    )
    told("holding points out: all errors")
    held_out = tried.geometry if tried else cross_validate(arm, seen, folds=folds, seed=seed)
    told("holding regions out")
    try:
        held_out_region = cross_validate(arm, seen, folds=folds, regions=True)
    except (ContradictionError, InvalidValueError):
        # A frame, a plane or an anchor lies in one region, or too few readings are left.
        held_out_region = None
    held_out_table = held_out
    if any(name.endswith(_TILTS) for name in full.chain.names):
        told("holding points out: for the arm file")
        held_out_table = cross_validate(arm, seen, folds=folds, seed=seed, without=_TILTS)
    own = seen.with_point & (seen.frame == 0)
    places = {
        "as said": chain_of(arm).reach(seen.q).position,
        "base moved": full.chain.reach(seen.q).position,
        "calibrated, held out": held_out.places,
    }
    raw = np.linalg.norm(places["as said"][own] - seen.points[own], axis=1)
    if not len(raw) or np.median(raw) > _ELSEWHERE:
        raw = raw[:0]
        del places["as said"]
    if tried and tried.unseen:
        places["beyond geometry, held out"] = tried.unseen.places
    doubtful = tuple(contradictions(full, seen, noise))
    words = {name: accuracy(seen, place) for name, place in places.items()}
    return Calibrated(
        arm=arm,
        measurements=measurements,
        full=full,
        table=table,
        raw=np.asarray(raw, dtype=np.float64),
        held_out=held_out,
        held_out_region=held_out_region,
        held_out_table=held_out_table,
        checked=full.model.off(measurements.readings.take(~fit), full.errors),
        accuracy={name: one for name, one in words.items() if one is not None} or None,
        repeatability=repeatability(seen),
        beyond=tried,
        contradictions=doubtful,
        notes=(
            *(f"DOUBTFUL: {one}" for one in doubtful),
            *_notes(full, measurements),
            *_which_to_believe(held_out, held_out_region),
            *_of_the_choice(tried),
        ),
    )


def _notes(full: Calibration, measurements: Measurements) -> Iterator[str]:
    fit = np.flatnonzero(~measurements.check)
    left = f"what is left has a noise of {full.noise.length * 1e3:.3g} mm per coordinate"
    if measurements.readings.with_rotation.any():
        left += f" and of {math.degrees(full.noise.turn):.3g} deg per axis"
    yield f"{len(full.names)} errors fitted to {len(fit)} readings; {left}"
    if any(name.startswith("base.") for name in full.names):
        start = full.chain.base
        x, y, z = start[:3, 3] * 1e3
        turns = ", ".join(f"{angle:z.4f}" for angle in np.degrees(to_rpy(start[:3, :3])))
        yield (
            f"the errors base.* count from where the arm as said fits best: its base at {x:z.4f}, {y:z.4f}, {z:z.4f} "
            f"mm, roll, pitch, yaw {turns} deg in the frame of the measurements"
        )
    yield from measurements.warnings
    if full.outliers:
        shown = ", ".join(measurements.names[fit[i]] for i in full.outliers[:_SHOWN])
        more = f" and {len(full.outliers) - _SHOWN} more" if len(full.outliers) > _SHOWN else ""
        yield f"readings that are farther off than they should be, and do not count: {shown}{more}"


def _which_to_believe(held_out: HeldOut, region: HeldOut | None) -> Iterator[str]:
    """Say what the figures of readings that were held out are good for."""
    if region is None:
        yield "held out by posture only: no region of the workspace can be left out of these readings"
        return
    yield (
        f"held out by posture ({held_out.distance.mean() * 1e3:.4g} mm) is for poses like those measured, by region "
        f"({region.distance.mean() * 1e3:.4g} mm) for poses where nothing was measured: believe the second wherever "
        f"the arm works elsewhere"
    )


def _of_the_choice(tried: NongeometricCalibration | None) -> Iterator[str]:
    """Say of which points the figures beyond geometry are."""
    if tried is None:
        return
    if tried.unseen is None:
        yield (
            "beyond geometry was chosen by all points that were held out, and so few leave none to see how good the "
            "choice is: measure more, or keep rows to check with"
        )
        return
    yield (
        f"beyond geometry, held out ({tried.unseen.distance.mean() * 1e3:.4g} mm) is of points that neither fit nor "
        f"choice has seen; the table of what was tried has those that chose"
    )


def distances(found: Calibrated) -> dict[str, Array]:
    """Return by name the distances by which readings miss the arm [m]."""
    none = np.zeros(0)
    kept = found.measurements.readings.take(found.measurements.check)
    kinds = {
        "arm and base as said": found.raw,
        "base moved to fit": found.full.before.distance,
        "calibrated, held out": found.held_out.distance,
        "calibrated, region held out": found.held_out_region.distance if found.held_out_region else none,
        "calibrated, all readings": found.full.after.distance,
        "arm file, held out": found.held_out_table.distance,
        "beyond geometry, held out": found.beyond.unseen.distance if found.beyond and found.beyond.unseen else none,
        "calibrated, kept to check": found.checked.distance,
        "beyond geometry, kept to check": found.beyond.pose_errors(kept).distance if found.beyond else none,
    }
    return {name: x for name, x in kinds.items() if len(x)}


def turns(found: Calibrated) -> dict[str, Array]:
    """Return by name the angles by which poses miss the arm [rad]; none where no turn was measured."""
    kinds = {
        "base moved to fit": found.full.before.turn,
        "calibrated, held out": found.held_out.turn,
        "calibrated, all readings": found.full.after.turn,
        "calibrated, kept to check": found.checked.turn,
    }
    told = {name: x[np.isfinite(x)] for name, x in kinds.items()}
    return {name: x for name, x in told.items() if len(x)}


def shown_errors(calibration: Calibration) -> Iterator[tuple[str, str, str, str]]:
    """Give the errors that were found as people read them: name, value, deviation, unit."""
    lengths = dict(zip(calibration.model.names, calibration.model.is_length, strict=True))
    for name, value, deviation in zip(calibration.names, calibration.values, calibration.deviations, strict=True):
        scale, unit = (1e3, "mm") if lengths[name] else (180 / math.pi, "deg")
        yield name, f"{value * scale:+z.4f}", f"{deviation * scale:.4f}", unit


def shown_bends(beyond: NongeometricCalibration) -> Iterator[tuple[str, str, str, str]]:
    """Give the bends of joints that were kept as people read them: name, value, deviation, what it means."""
    found = beyond.calibration
    bends = {bend.name: bend for bend in found.chain.bends}
    largest = largest_gravity_efforts(found.chain.arm)
    for name, value, deviation in zip(found.names, found.values, found.deviations, strict=True):
        if name not in bends:
            continue
        joint = bends[name].joint
        unit = "mrad" if found.chain.arm.joints[joint].revolute else "mm"
        means = f"half the swing, {unit}"
        if name.endswith(".sag"):
            means = f"{unit} under {largest[joint]:.3g} {'N m' if unit == 'mrad' else 'N'}"
        yield name, f"{value * 1e3:+z.3f}", f"{deviation * 1e3:.3f}", means


def as_data(found: Calibrated) -> dict[str, Any]:
    """Return a calibration as plain data, SI."""
    full = found.full
    data: dict[str, Any] = {
        "arm": found.arm.name,
        "readings": int((~found.measurements.check).sum()),
        "errors": _errors(full),
        "base_before": full.chain.base.tolist(),
        "covariance": full.covariance.tolist(),
        "held": {one.name: one.why for one in full.held},
        "singular_values": full.identified.singular_values.tolist(),
        "noise": full.noise._asdict(),
        "freedom": full.freedom,
        "outliers": list(full.outliers),
        "distances": _means(distances(found)),
        "turns": _means(turns(found)),
        "iso9283": {
            **{name: one._asdict() for name, one in (found.accuracy or {}).items()},
            "repeatability": found.repeatability._asdict() if found.repeatability else None,
        },
        "contradictions": list(found.contradictions),
        "notes": list(found.notes),
    }
    if found.beyond:
        data["beyond"] = {
            "tried": [one._asdict() for one in found.beyond.tried],
            "errors": _errors(found.beyond.calibration),
        }
    return data


def _errors(found: Calibration) -> dict[str, dict[str, float]]:
    return {
        name: {"value": float(value), "deviation": float(deviation), "lower": float(lower), "upper": float(upper)}
        for name, value, deviation, (lower, upper) in zip(
            found.names, found.values, found.deviations, found.intervals(), strict=True
        )
    }


def _means(kinds: dict[str, Array]) -> dict[str, dict[str, float]]:
    return {name: {"mean": float(x.mean()), "largest": float(x.max())} for name, x in kinds.items()}
