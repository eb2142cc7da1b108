"""The assessment of a calibration: fits with and without rotations about y, held-out errors, ISO 9283, contradictions.

Source:
    Spec of the calibration; ISO 9283:1998 for accuracy and repeatability.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any

import attrs
import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import Array, positive
from armwright.calibration.chain import kinematic_chain
from armwright.calibration.contradictions import find_contradictions
from armwright.calibration.cross_validation import HeldOutErrors, cross_validate
from armwright.calibration.fitting import Calibration, calibrate
from armwright.calibration.iso9283 import Accuracy, Repeatability, accuracy, repeatability
from armwright.calibration.joint_errors import identified_compliance, largest_gravity_loads
from armwright.calibration.measurements import Measurements
from armwright.calibration.noise import remarkable_readings
from armwright.calibration.nongeometric import ModelComparison, NongeometricCalibration, calibrate_nongeometric
from armwright.calibration.readings import Readings, refuse_unlocated
from armwright.calibration.residuals import PoseError
from armwright.errors import ContradictionError, InvalidValueError, listed
from armwright.files.result_table import ResultTable
from armwright.spatial.euler import to_rpy

# Rotations about y, which a Denavit-Hartenberg table has no number for.
_TILTS = ("beta",)
# A nominal arm whose points are farther from the readings was not measured in its own frame [m].
_MAX_NOMINAL_DISTANCE = 0.2
# How many readings a note names.
_MAX_NAMED = 8


@attrs.frozen(kw_only=True, eq=False)
class CalibrationAssessment:
    """A calibration and how good it is.

    Attributes:
        arm: the nominal arm.
        measurements: of it.
        full: with all errors that are identifiable.
        tabular: without rotations about y, for arm files.
        nominal: (p,) distances of the points from the nominal arm; none if it was measured in another frame [m].
        held_out: from arms calibrated without the reading, all errors.
        held_out_region: from arms calibrated without the region of the workspace in which the reading lies; None where
            a region cannot be left out.
        held_out_tabular: from arms calibrated without the reading, without rotations about y.
        check: errors of readings that the file keeps for checking, from the corrected arm.
        accuracy: AP and AD by kind of arm: nominal, with its base best-fitted, calibrated (held out).
        repeatability: RP of configurations that were measured more than once; None where none was.
        nongeometric: the non-geometric calibration; None where it was not asked for.
        contradictions: by what the readings contradict the arm that was fitted to them; empty where they do not.
    """

    arm: Arm
    measurements: Measurements
    full: Calibration
    tabular: Calibration
    nominal: Array
    held_out: HeldOutErrors
    held_out_region: HeldOutErrors | None
    held_out_tabular: HeldOutErrors
    check: PoseError
    accuracy: dict[str, Accuracy]
    repeatability: Repeatability | None
    nongeometric: NongeometricCalibration | None
    contradictions: tuple[str, ...]

    @property
    def fitted(self) -> Readings:
        """The readings that were fitted to."""
        return self.measurements.readings.take(~self.measurements.check)

    @property
    def distances(self) -> dict[str, Array]:
        """Distances between readings and arms by the kind of arm [m]."""
        beyond = self.nongeometric
        kinds = {
            "nominal arm and base": self.nominal,
            "nominal, base best-fitted": self.full.before.distance,
            "calibrated, held out": self.held_out.distance,
            "calibrated, region held out": self.held_out_region.distance if self.held_out_region else (),
            "calibrated, all readings": self.full.after.distance,
            "arm file, held out": self.held_out_tabular.distance,
            "non-geometric, held out": beyond.nested.distance if beyond and beyond.nested else (),
            "calibrated, check readings": self.check.distance,
            "non-geometric, check readings": (
                beyond.errors(self.measurements.readings.take(self.measurements.check)).distance if beyond else ()
            ),
        }
        return {name: np.asarray(x, dtype=np.float64) for name, x in kinds.items() if len(x)}

    @property
    def angles(self) -> dict[str, Array]:
        """Angles between the rotations of readings and arms [rad]; none where no rotation was measured."""
        kinds = {
            "nominal, base best-fitted": self.full.before.angle,
            "calibrated, held out": self.held_out.angle,
            "calibrated, all readings": self.full.after.angle,
            "calibrated, check readings": self.check.angle,
        }
        return {name: x[np.isfinite(x)] for name, x in kinds.items() if np.isfinite(x).any()}

    @property
    def remarkable(self) -> tuple[int, ...]:
        """The readings that were fitted to, counted from 0, whose residuals are too large for chance, largest first."""
        return remarkable_readings(self.full.model.residuals(self.fitted, self.full.errors), self.full.noise)

    @property
    def fitted_names(self) -> tuple[str, ...]:
        """Names of the readings that were fitted to."""
        return tuple(self.measurements.names[i] for i in np.flatnonzero(~self.measurements.check))

    @property
    def warnings(self) -> tuple[str, ...]:
        """Those of the notes that a reader must not overlook."""
        return (*(f"DOUBTFUL: {reason}" for reason in self.contradictions), *self._warnings_of_readings())

    @property
    def notes(self) -> tuple[str, ...]:
        """What a reader must know beside the numbers."""
        return (
            *(f"DOUBTFUL: {reason}" for reason in self.contradictions),
            *_notes_on_fit(self.full, self.measurements),
            *self._warnings_of_readings(),
            _note_on_held_out(self.held_out, self.held_out_region),
            *([_note_on_nongeometric(self.nongeometric)] if self.nongeometric else []),
        )

    def _warnings_of_readings(self) -> Iterator[str]:
        """Give the warnings of unusual readings: of the file, outliers, and those with a remarkable residual."""
        yield from self.measurements.warnings
        names, outliers = self.fitted_names, self.full.outliers
        if outliers:
            named = listed([names[i] for i in outliers], _MAX_NAMED)
            yield f"outliers, without weight in the last fit: {named}"
        remarkable = [i for i in self.remarkable if i not in outliers]
        if not remarkable:
            return
        distance = self.full.after.distance
        usual = float(np.median(distance))
        shown = [f"{names[i]} ({distance[i] * 1e3:.3g} mm, {distance[i] / usual:.2g} times)" for i in remarkable]
        yield (
            f"readings with larger residuals than noise explains, beside a median of {usual * 1e3:.3g} mm: "
            f"{listed(shown, _MAX_NAMED)}"
        )

    def as_data(self) -> dict[str, Any]:
        """Return it as plain data in SI units."""
        full, beyond = self.full, self.nongeometric
        data: dict[str, Any] = {
            "arm": self.arm.name,
            "readings": len(self.fitted),
            "errors": _error_data(full),
            "base_before": full.chain.base.tolist(),
            "covariance": full.covariance.tolist(),
            "fixed": {parameter.name: parameter.reason for parameter in full.fixed},
            "singular_values": full.identifiability.singular_values.tolist(),
            "noise": full.noise._asdict(),
            "degrees_of_freedom": full.degrees_of_freedom,
            "outliers": list(full.outliers),
            "remarkable": list(self.remarkable),
            "distances": _mean_and_largest(self.distances),
            "angles": _mean_and_largest(self.angles),
            "iso9283": {
                **{name: figures._asdict() for name, figures in self.accuracy.items()},
                "repeatability": self.repeatability._asdict() if self.repeatability else None,
            },
            "contradictions": list(self.contradictions),
            "notes": list(self.notes),
        }
        if beyond:
            data["nongeometric"] = {
                "candidates": [comparison._asdict() for comparison in beyond.comparisons],
                "errors": _error_data(beyond.calibration),
                "fixed": _unfitted_joint_errors(beyond.calibration),
                "compliance": identified_compliance(beyond.calibration).tolist(),
            }
        return data

    def tables(self) -> Iterator[ResultTable]:
        """Give the errors of readings, then the errors of the arm."""
        for title, kinds, unit, scale in (
            ("Distances of the readings from the arm", self.distances, "mm", 1e3),
            ("Angles between the rotations of readings and arm", self.angles, "deg", 180 / math.pi),
        ):
            rows = [(name, f"{x.mean() * scale:.4f}", f"{x.max() * scale:.4f}") for name, x in kinds.items()]
            yield ResultTable(title=title, heads=("", f"mean {unit}", f"largest {unit}"), rows=rows, numbers=(1, 2))
        yield ResultTable(
            title="By ISO 9283",
            heads=("", "AP mm", "largest", "AD mm", "largest"),
            rows=[(name, *(f"{x * 1e3:.4f}" for x in figures)) for name, figures in self.accuracy.items()],
            numbers=(1, 2, 3, 4),
            remark=_repeatability_remark(self.repeatability),
        )
        if self.nongeometric:
            yield from _nongeometric_tables(self.nongeometric)
        yield ResultTable(
            title=f"{self.arm.name}: identified parameter deviations",
            heads=("error", "value", "±", "unit"),
            rows=_error_rows(self.full),
            numbers=(1, 2),
        )
        yield ResultTable(
            title="Not fitted",
            heads=("error", "reason"),
            rows=[(parameter.name, parameter.reason) for parameter in self.full.fixed],
        )


def assess_calibration(
    arm: Arm,
    measurements: Measurements,
    *,
    folds: int = 5,
    seed: int = 0,
    nongeometric: bool = False,
    noise: float | None = None,
    progress: Callable[[str], None] | None = None,
) -> CalibrationAssessment:
    """Calibrate an arm with and without rotations about y, and cross-validate.

    Args:
        arm: the nominal arm.
        measurements: of it.
        folds: of the cross-validation.
        seed: of the folds.
        nongeometric: whether to try joint compliance, transmission errors and a residual model.
        noise: standard deviation of a measured coordinate; where it is stated, larger residuals than it explains are
            a contradiction [m].
        progress: called with what is being done.

    Raises:
        InvalidValueError: see ``calibrate`` and ``cross_validate``; readings to check with are in a frame, of a plane
            or from an anchor that no fitted reading locates.
        ShapeError: the readings are of an arm with another number of joints.
    """
    report = progress or (lambda _: None)
    # Before a fit of some seconds.
    if noise is not None:
        positive(noise, "noise", "m")
    measured = measurements.readings.take(~measurements.check)
    check = measurements.readings.take(measurements.check)
    refuse_unlocated(measured, check)
    full = calibrate(arm, measured, progress=progress)
    is_tilted = any(name.endswith(_TILTS) for name in full.names)
    tabular = calibrate(arm, measured, without=_TILTS) if is_tilted else full
    beyond = None
    if nongeometric:
        beyond = calibrate_nongeometric(arm, measured, folds=folds, seed=seed, nested=True, progress=progress)
    report("cross-validating: all errors")
    held_out = beyond.geometry if beyond else cross_validate(arm, measured, folds=folds, seed=seed)
    report("cross-validating by regions of the workspace")
    try:
        held_out_region = cross_validate(arm, measured, folds=folds, regions=True)
    except (ContradictionError, InvalidValueError):
        # A frame, a plane or an anchor lies in one region, or too few readings are left.
        held_out_region = None
    held_out_tabular = held_out
    if any(name.endswith(_TILTS) for name in full.chain.names):
        report("cross-validating: for the arm file")
        held_out_tabular = cross_validate(arm, measured, folds=folds, seed=seed, without=_TILTS)
    nominal = kinematic_chain(arm).forward(measured.q).position
    points = measured.with_point & (measured.frame == 0)
    distances = np.linalg.norm(nominal[points] - measured.points[points], axis=1)
    in_own_frame = len(distances) > 0 and np.median(distances) <= _MAX_NOMINAL_DISTANCE
    positions = {
        "nominal": nominal if in_own_frame else None,
        "nominal, base best-fitted": full.chain.forward(measured.q).position,
        "calibrated, held out": held_out.positions,
        "non-geometric, held out": beyond.nested.positions if beyond and beyond.nested else None,
    }
    figures = {name: None if tool is None else accuracy(measured, tool) for name, tool in positions.items()}
    return CalibrationAssessment(
        arm=arm,
        measurements=measurements,
        full=full,
        tabular=tabular,
        nominal=np.asarray(distances if in_own_frame else (), dtype=np.float64),
        held_out=held_out,
        held_out_region=held_out_region,
        held_out_tabular=held_out_tabular,
        check=full.model.pose_errors(check, full.errors),
        accuracy={name: values for name, values in figures.items() if values is not None},
        repeatability=repeatability(measured),
        nongeometric=beyond,
        contradictions=tuple(find_contradictions(full, measured, noise)),
    )


# ---- notes ---------------------------------------------------------------------------------------------------------


def _notes_on_fit(full: Calibration, measurements: Measurements) -> Iterator[str]:
    noise = f"the residuals have a standard deviation of {full.noise.length * 1e3:.3g} mm per coordinate"
    if measurements.readings.with_rotation.any():
        noise += f" and of {math.degrees(full.noise.angle):.3g} deg per axis"
    yield f"{len(full.names)} errors fitted to {int((~measurements.check).sum())} readings; {noise}"
    if any(name.startswith("base.") for name in full.names):
        base = full.chain.base
        x, y, z = base[:3, 3] * 1e3
        angles = ", ".join(f"{angle:z.4f}" for angle in np.degrees(to_rpy(base[:3, :3])))
        yield (
            f"the errors base.* count from the best-fitted base of the nominal arm: at {x:z.4f}, {y:z.4f}, {z:z.4f} "
            f"mm, roll, pitch, yaw {angles} deg in the frame of the measurements"
        )


def _note_on_held_out(held_out: HeldOutErrors, region: HeldOutErrors | None) -> str:
    """Return a note on the scope of the figures of held-out readings."""
    if region is None:
        return "held out by configuration only: no region of the workspace can be left out of these readings"
    return (
        f"held out by configuration ({held_out.distance.mean() * 1e3:.4g} mm) is the error at poses like those "
        f"measured, held out by region ({region.distance.mean() * 1e3:.4g} mm) that in regions without measurements"
    )


def _note_on_nongeometric(beyond: NongeometricCalibration) -> str:
    """Return a note on the points of the figures of a non-geometric calibration."""
    if beyond.nested is None:
        return (
            "all held-out points were used to select the non-geometric model, and too few readings are left for a "
            "nested cross-validation: measure more, or reserve rows of set check"
        )
    return (
        f"non-geometric, held out ({beyond.nested.distance.mean() * 1e3:.4g} mm) is a nested cross-validation: neither "
        f"the fit nor the selection of the model has used these points, unlike those in the table of candidates"
    )


# ---- rows ----------------------------------------------------------------------------------------------------------


def _error_rows(calibration: Calibration) -> Iterator[tuple[str, ...]]:
    """Give the estimated errors: name, value, standard error, unit."""
    lengths = dict(zip(calibration.model.names, calibration.model.is_length, strict=True))
    for name, value, error in zip(calibration.names, calibration.values, calibration.standard_errors, strict=True):
        scale, unit = (1e3, "mm") if lengths[name] else (180 / math.pi, "deg")
        yield name, f"{value * scale:+z.4f}", f"{error * scale:.4f}", unit


def _nongeometric_tables(beyond: NongeometricCalibration) -> Iterator[ResultTable]:
    geometry = beyond.comparisons[0]

    def row(comparison: ModelComparison) -> tuple[str, ...]:
        figures = "", "", ""
        if comparison.held_out is not None:
            gain = f"{comparison.gain * 1e3:+z.4f}", f"{comparison.standard_error * 1e3:.4f}"
            figures = f"{comparison.held_out * 1e3:.4f}", *(("", "") if comparison is geometry else gain)
        accepted = "yes" if comparison.accepted else "no"
        return comparison.name, *figures, f"{accepted}: {comparison.reason}" if comparison.reason else accepted

    yield ResultTable(
        title="Non-geometric candidates, on the held-out points of the selection",
        heads=("", "mean mm", "gain mm", "±", "accepted"),
        rows=map(row, beyond.comparisons),
        numbers=(1, 2, 3),
    )
    yield ResultTable(
        title="Error models of joints that are accepted",
        heads=("error", "value", "±", "unit"),
        rows=_joint_error_rows(beyond.calibration),
        numbers=(1, 2),
    )
    yield ResultTable(
        title="Error models of joints that are not fitted",
        heads=("error", "reason"),
        rows=_unfitted_joint_errors(beyond.calibration).items(),
    )


def _joint_error_rows(calibration: Calibration) -> Iterator[tuple[str, ...]]:
    """Give the coefficients of error models of joints: name, value, standard error, what it is of."""
    models, arm = {error.name: error for error in calibration.chain.joint_errors}, calibration.chain.arm
    largest = largest_gravity_loads(arm)
    for name, value, error in zip(calibration.names, calibration.values, calibration.standard_errors, strict=True):
        if name in models:
            _, joint, _, axis = models[name]
            unit, load = ("mrad", "N m") if axis < 2 or arm.joints[joint].revolute else ("mm", "N")
            of = f"{unit} under {largest[joint, axis]:.3g} {load}" if ".sag" in name else f"amplitude, {unit}"
            yield name, f"{value * 1e3:+z.3f}", f"{error * 1e3:.3f}", of


def _unfitted_joint_errors(calibration: Calibration) -> dict[str, str]:
    """Return by name why coefficients of error models of joints are not fitted."""
    names = {error.name for error in calibration.chain.joint_errors}
    return {parameter.name: parameter.reason for parameter in calibration.fixed if parameter.name in names}


def _repeatability_remark(figures: Repeatability | None) -> str:
    if figures is None:
        return "each configuration once; RP needs several"
    return (
        f"RP {figures.RP * 1e3:.4f} mm, largest {figures.RP_largest * 1e3:.4f}, of {figures.configurations} "
        f"configurations measured {figures.cycles} times or more (of 30)"
    )


def _error_data(calibration: Calibration) -> dict[str, dict[str, float]]:
    return {
        name: {"value": float(value), "standard_error": float(error), "lower": float(lower), "upper": float(upper)}
        for name, value, error, (lower, upper) in zip(
            calibration.names, calibration.values, calibration.standard_errors, calibration.intervals(), strict=True
        )
    }


def _mean_and_largest(kinds: dict[str, Array]) -> dict[str, dict[str, float]]:
    return {name: {"mean": float(x.mean()), "largest": float(x.max())} for name, x in kinds.items()}
