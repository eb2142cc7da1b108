"""The estimate of clearances as a result: uncertainty, fit to the data, and the errors of a model it would reveal."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator, Mapping
from itertools import compress
from pathlib import Path
from typing import Any

import attrs
import numpy as np

from armwright.arrays import Array, positive
from armwright.clearance.estimation.measurement_file import PathMeasurement, RestMeasurement
from armwright.clearance.estimation.misfit import refuse_contradiction
from armwright.clearance.estimation.model_errors import ModelError, model_errors
from armwright.clearance.estimation.posterior import Posterior, sample_posterior
from armwright.clearance.estimation.static_estimate import Estimate
from armwright.clearance.estimation.sweep_surrogate import SweepSurrogate, learn_from_sweep
from armwright.clearance.free_parameters import FREE_PARAMETERS, parameter_text
from armwright.clearance.linkage import Linkage
from armwright.errors import FileFormatError, TooFewError
from armwright.files.inputs import read_text
from armwright.files.result_table import ResultTable

# The features of an error curve that are compared.
_FEATURES = ("slope", "intercept", "amp_dc", "offset_x", "offset_y")
_LEVEL = 0.9
# How an error of the model is shown, by its SI unit: factor, unit, and a usual size.
_SHOWN_UNITS = {"1": (1e2, "%", 10.0), "m": (1e3, "mm", 0.1), "rad": (180 / math.pi, "deg", 0.01)}
# The least clearance drawn from an estimate: contact needs one [m].
_MIN_CLEARANCE = 1e-6
# A larger number is no clearance, but another unit or another file.
_MAX_VALUE = 10.0


@attrs.frozen(kw_only=True, eq=False)
class EstimateAssessment:
    """The clearances that a measurement determines, and how well.

    Attributes:
        method: ``rest`` or ``paths``.
        parameters: by name mean, standard deviation, interval and whether it is identifiable, SI.
        correlation: (p, p) of the parameters.
        misfit: probability of residuals as large where the model holds.
        widening: factor by which residuals above the noise widen the deviations.
        notes: on the fit and its limits.
        model_errors: errors of the model that readings at rest would reveal.
        sweep: the surrogate of measurements on paths; None at rest.
    """

    method: str
    parameters: Mapping[str, Mapping[str, Any]]
    correlation: Array
    misfit: float
    widening: float
    notes: tuple[str, ...]
    model_errors: tuple[ModelError, ...] = ()
    sweep: SweepSurrogate | None = None

    def as_data(self) -> dict[str, Any]:
        """Return the estimate as plain data in SI units."""
        data = {
            "method": self.method,
            "parameters": dict(self.parameters),
            "correlation": self.correlation.tolist(),
            "misfit": self.misfit,
            "widening": self.widening,
        }
        if self.sweep is None:
            data["model_errors"] = [
                {
                    "name": error.name,
                    "unit": error.unit,
                    "detectable_from": error.detectable_from if math.isfinite(error.detectable_from) else None,
                    "shifts": dict(zip(self.parameters, error.shifts.tolist(), strict=True)),
                }
                for error in self.model_errors
            ]
        else:
            data["random_features"] = list(self.sweep.random_features)
            data["predictable_until"] = dict(self.sweep.predictable_until)
        return {**data, "notes": list(self.notes)}

    def tables(self) -> Iterator[ResultTable]:
        """Give the parameters, and the errors of the model that the readings would reveal."""
        names = list(self.parameters)
        first = "parameter" if FREE_PARAMETERS.keys() & set(names) else "pin"
        heads = (first, "mean mm", "± mm", "90 % interval mm", "identifiable", *(f"r {name}" for name in names))
        rows = [
            (*_parameter_cells(name, parameter), *(f"{x:+z.2f}" for x in correlation))
            for (name, parameter), correlation in zip(self.parameters.items(), self.correlation, strict=True)
        ]
        yield ResultTable(title="", heads=heads, rows=rows, numbers=range(1, len(heads)))
        yield ResultTable(
            title="",
            heads=("error of the model", "detectable from", "shift per", *(f"{pin} µm" for pin in names)),
            rows=[_model_error_cells(error) for error in self.model_errors],
            numbers=range(1, 3 + len(names)),
            remark=(
                "Readings contradict an error of the model from the size under `detectable from` on, in 9 of 10 cases. "
                "Smaller errors are taken for clearance: they shift the estimates in proportion, and the intervals do "
                "not include that."
            ),
        )


def _parameter_cells(name: str, parameter: Mapping[str, Any]) -> tuple[str, ...]:
    unit = FREE_PARAMETERS[name].unit if name in FREE_PARAMETERS else None
    scale = 1e3 if unit is None else 1.0
    low, high = (scale * x for x in parameter["interval"])
    return (
        name if unit is None else f"{name}, {'no unit' if unit == '1' else unit}",
        f"{scale * parameter['mean']:.4f}",
        f"{scale * parameter['deviation']:.4f}",
        f"{low:.4f} to {high:.4f}",
        "yes" if parameter["identifiable"] else "no",
    )


def _model_error_cells(error: ModelError) -> tuple[str, ...]:
    scale, unit, usual = _SHOWN_UNITS[error.unit]
    if math.isinf(error.detectable_from):
        limit = "never"
    elif error.unit == "1" and error.detectable_from > 1:
        # The shifts are linear, and hold for small changes only.
        limit = "beyond 100 %"
    else:
        limit = f"{error.detectable_from * scale:.2g} {unit}"
    return (error.name, limit, f"{usual:g} {unit}", *(f"{x * usual / scale * 1e6:+z.1f}" for x in error.shifts))


def assess_rest(
    linkage: Linkage, measured: RestMeasurement, noise: float | None = None, *, friction: float | None = None
) -> EstimateAssessment:
    """Estimate clearances from readings of a resting tip.

    Args:
        linkage: that was measured.
        measured: the readings.
        noise: standard deviation of one coordinate of one reading; that of repeated readings without it [m].
        friction: coefficient of friction, which holds the journals anywhere in their cones; that of the material when
            left out, and 0 where the readings are to be taken as they are.

    Raises:
        InvalidValueError: the noise is not above 0, or the friction below 0.
        ContradictionError: no clearances explain the readings.
        TooFewError: the poses do not determine all clearances.
    """
    if noise is not None:
        positive(noise, "noise", "m")
    mu = linkage.material.friction if friction is None else friction
    estimate = measured.estimate(linkage, noise, friction=mu)
    noise_is_known = bool(noise or measured.noise)
    largest = float(estimate.values.max())
    misfit, widening = float(estimate.misfit), float(estimate.widening)
    notes = [
        (
            f"{len(measured.names)} poses, {sum(measured.readings)} readings; "
            f"residual {estimate.residual_rms * 1e6:.3g} µm (rms)"
        ),
        f"singular values of the equations: {', '.join(f'{x:.3g}' for x in estimate.singular_values)}",
        *([] if noise_is_known else [_unknown_noise_note(estimate)]),
        *_fit_notes(misfit, widening),
    ]
    if mu > 0:
        part, reach = 1 - float(np.mean(estimate.noise_shares)), math.atan(mu) * largest
        notes.append(
            f"friction ({mu:g}) holds each journal anywhere within its cone, up to {reach * 1e6:.2g} µm to either side"
            f", the same in all readings of a pose: {part:.0%} of the variances are of that"
        )
    else:
        notes.append("friction, which may hold journals beside their assumed positions, is left out of the intervals")
    notes += [
        f"{name} is indistinguishable from 0 mm: it is less than its standard deviation"
        for name in compress(estimate.names, estimate.at_bound)
    ]
    identifiable = dict(zip(estimate.names, estimate.identifiable(largest), strict=True))
    return EstimateAssessment(
        method="rest",
        parameters=_parameters(estimate, estimate.values, identifiable),
        correlation=estimate.correlation,
        misfit=misfit,
        widening=widening,
        notes=tuple(notes),
        model_errors=model_errors(linkage, measured.poses, estimate, noise_is_known=noise_is_known),
    )


def assess_paths(
    linkage: Linkage,
    measured: PathMeasurement,
    folder: Path | str,
    noise: float,
    progress: Callable[[str], None] | None = None,
) -> EstimateAssessment:
    """Estimate clearances from the motion of a tip on paths, compared with a sweep of simulations.

    Args:
        linkage: that was measured.
        measured: the motion.
        folder: of the sweep.
        noise: standard deviation of a measured coordinate [m].
        progress: called with the name of each feature before it is learnt.

    Raises:
        InvalidValueError: the noise is not above 0, or the sweep does not fit the measurement.
        FileFormatError: the folder has no results of a sweep.
        ContradictionError: no clearances explain the features.
    """
    positive(noise, "noise", "m")
    sweep = learn_from_sweep(folder, linkage, tuple(measured.times), _FEATURES, progress)
    names = sweep.surrogate.features
    covariance = measured.feature_covariance(names, noise)
    distribution = sample_posterior(sweep.surrogate, measured.feature_values(names), covariance).checked()
    notes = [
        f"{len(names)} features of {len(measured.times)} paths, learnt from {sweep.runs} simulations",
        *_predictability_notes(sweep),
        *_fit_notes(distribution.misfit, distribution.widening),
    ]
    for name in distribution.names:
        pin, end = name.removeprefix("c_"), distribution.bounds.get(name)
        if name not in distribution.narrowed:
            notes.append(f"{pin} is not identifiable: these paths hardly depend on it within its swept range")
        elif end is not None:
            notes.append(
                f"{pin} is at or beyond the end of the swept range, {parameter_text(name, end)}: it is not "
                f"identifiable; sweep a larger range"
            )
    return EstimateAssessment(
        method="paths",
        parameters=_parameters(distribution, distribution.mean, distribution.identifiable),
        correlation=distribution.correlation,
        misfit=distribution.misfit,
        widening=distribution.widening,
        notes=tuple(notes),
        sweep=sweep,
    )


def read_estimate(path: Path, linkage: Linkage, count: int) -> Array:
    """Return (count, p) clearances drawn from an estimate that ``as_data`` wrote as JSON [m].

    Raises:
        FileFormatError: the file has no such estimate, or that of another linkage.
        ContradictionError: the measurement contradicts the model.
        TooFewError: a clearance is not identifiable.
    """
    mean, covariance = read_estimate_moments(path, linkage)
    draws = np.random.default_rng(0).multivariate_normal(mean, covariance, count)
    return np.maximum(draws, _MIN_CLEARANCE)


def read_estimate_moments(path: Path, linkage: Linkage) -> tuple[Array, Array]:
    """Return mean (p,) [m] and covariance (p, p) [m²] of the clearances of an estimate; see ``read_estimate``."""
    text = read_text(path)
    try:
        data = json.loads(text)
        misfit, parameters = float(data["misfit"]), dict(data["parameters"])
        correlation = np.array(data["correlation"], dtype=np.float64)
        mean, deviation = (np.array([entry[key] for entry in parameters.values()]) for key in ("mean", "deviation"))
        columns = [list(parameters).index(name) for name in linkage.clearances]
        identifiable = [parameters[name]["identifiable"] for name in linkage.clearances]
        # NaN is refused, too.
        if not (np.abs([mean[columns], deviation[columns]]) <= _MAX_VALUE).all():
            raise ValueError  # noqa: TRY301 - turned into a FileFormatError below
        covariance = correlation * np.outer(deviation, deviation)
        # It is one if numbers can be drawn by it.
        np.random.default_rng(0).multivariate_normal(mean, covariance, 1, check_valid="raise")
    except (AttributeError, KeyError, TypeError, ValueError, RecursionError, np.linalg.LinAlgError) as error:
        text = f"expected the output of `armwright clearance estimate --json` for {linkage.name}"
        raise FileFormatError(path, None, "", text) from error
    refuse_contradiction(misfit, [], [])
    unknown = [name for name, is_known in zip(linkage.clearances, identifiable, strict=True) if not is_known]
    if unknown:
        raise TooFewError(
            f"{path}: the measurement does not identify {', '.join(unknown)}; a path cannot be corrected for an "
            f"unknown clearance: measure more poses or paths, or give --clearance"
        )
    return mean[columns], covariance[np.ix_(columns, columns)]


def _parameters(fit: Estimate | Posterior, mean: Array, identifiable: Mapping[str, bool]) -> dict[str, dict[str, Any]]:
    """Return estimated parameters by the names of their pins, as plain data."""
    columns = zip(fit.names, mean.tolist(), fit.deviations.tolist(), fit.interval(_LEVEL).tolist(), strict=True)
    return {
        name.removeprefix("c_"): {"mean": m, "deviation": s, "interval": ends, "identifiable": identifiable[name]}
        for name, m, s, ends in columns
    }


def _unknown_noise_note(estimate: Estimate) -> str:
    """Return the note on the noise that was assumed where no readings of a pose differ."""
    if math.isfinite(estimate.noise_freedom):
        return (
            f"no readings of a pose differ and --noise-um is not specified: the residuals of "
            f"{estimate.noise * 1e6:.3g} µm are taken for the noise, so that the fit of the model cannot be tested"
        )
    return f"no readings of a pose differ: a noise of {estimate.noise * 1e6:.3g} µm is assumed"


def _fit_notes(misfit: float, widening: float) -> Iterator[str]:
    """Give the notes on the fit of the model to the data."""
    yield f"test of the residuals: p = {misfit:.3g}"
    if widening > 1:
        yield f"residuals are {widening:.3g} times the noise: deviations and intervals are widened by that factor"


def _predictability_notes(sweep: SweepSurrogate) -> Iterator[str]:
    """Give the notes on predictability, and on features that are random."""
    if not sweep.predictable_until:
        yield "the sweep has no replicates (--replicates 0): random variation is estimated from the scatter of its runs"
        return
    until = ", ".join(f"{path} {t:.3g} s" for path, t in sweep.predictable_until.items())
    yield f"predictable until, in half of the simulations: {until}; later variation counts as noise"
    if sweep.random_features:
        yield (
            f"excluded, since they vary more between indistinguishable runs than over the clearances: "
            f"{', '.join(sweep.random_features)}"
        )
