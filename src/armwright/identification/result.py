"""What an identification found: parameters, how well they are known, and how well they predict."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any, NamedTuple

import attrs
import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import Array, read_only
from armwright.dynamics.regressors import OF_LINK
from armwright.errors import counted, listed
from armwright.files.result_table import ResultTable
from armwright.identification.feasible import Standard, arm_of, link_of
from armwright.identification.fitting import Fit, Outlier
from armwright.identification.friction import predicted
from armwright.identification.groupings import groupings
from armwright.identification.identifiability import LARGEST_ERROR, UNKNOWN, WeakParameter
from armwright.identification.model import LINK_NAMES, DynamicModel
from armwright.identification.signals import Motion, Preparation

# Standard errors to both sides of an interval of 95 %.
_NORMAL_95 = 1.96
_MAX_NAMED = 5


class Choice(NamedTuple):
    """An alternative that was tried on held-out blocks.

    Attributes:
        what: ``filter``, ``friction`` or ``drawing``.
        option: its name.
        error: root mean square of held-out residuals, those of each joint by the standard deviation of its own.
        chosen: whether it was chosen.
    """

    what: str
    option: str
    error: float
    chosen: bool


@attrs.frozen(kw_only=True, eq=False)
class Prediction:
    """How well efforts of a motion are predicted that nothing was fitted to.

    Attributes:
        name: of the log.
        t: (k,) times [s].
        measured: (k, n) efforts [N m] or [N].
        predicted: (k, n) the same by the model.
    """

    name: str
    t: Array = attrs.field(converter=read_only)
    measured: Array = attrs.field(converter=read_only)
    predicted: Array = attrs.field(converter=read_only)

    @property
    def rms(self) -> Array:
        """(n,) root mean squares of the errors [N m] or [N]."""
        return np.asarray(np.sqrt(((self.measured - self.predicted) ** 2).mean(axis=0)))

    @property
    def relative(self) -> Array:
        """(n,) the same by the root mean square of the efforts; 1 where there are none."""
        size = np.sqrt((self.measured**2).mean(axis=0))
        return np.asarray(np.divide(self.rms, size, out=np.ones_like(size), where=size > 0))

    @property
    def correlation(self) -> Array:
        """(n,) correlations of measured and predicted efforts."""
        a, b = self.measured - self.measured.mean(axis=0), self.predicted - self.predicted.mean(axis=0)
        lengths = np.linalg.norm(a, axis=0) * np.linalg.norm(b, axis=0)
        return np.asarray((a * b).sum(axis=0) / np.maximum(lengths, np.finfo(float).tiny))

    def as_data(self) -> dict[str, Any]:
        """Return its errors as plain data in SI units."""
        errors = {name: getattr(self, name).tolist() for name in ("rms", "relative", "correlation")}
        return {"log": self.name, **errors}


@attrs.frozen(kw_only=True, eq=False)
class Identification:
    """What was identified.

    Attributes:
        model: of the arm, with the law of friction that was chosen.
        law: its name.
        preparation: how motions were made of readings.
        fit: of the base parameters.
        standard: parameters of links and drives that can be; None without Clarabel.
        held: share of dry friction that joints keep when they have stopped.
        choices: what was tried on held-out blocks.
        validation: of logs or blocks that were held out from everything, by the base parameters.
        validation_of_arm: the same by ``standard``, as the arm file has it; empty without.
        training: of the logs that were fitted to.
        delay_error: standard error of the delay [s].
        speeds: (n,) greatest speeds of the joints [rad/s] or [m/s].
        weak: base parameters that are hardly known.
        warnings: of unusual logs.
    """

    model: DynamicModel
    law: str
    preparation: Preparation
    fit: Fit
    standard: Standard | None
    held: float
    choices: tuple[Choice, ...]
    validation: tuple[Prediction, ...]
    validation_of_arm: tuple[Prediction, ...]
    training: tuple[Prediction, ...]
    delay_error: float
    speeds: Array
    weak: tuple[WeakParameter, ...]
    warnings: tuple[str, ...]

    @property
    def arm(self) -> Arm | None:
        """The identified arm; None without Clarabel."""
        if self.standard is None:
            return None
        return arm_of(self.model, self.standard.values, f"identified, {self.law}")

    @property
    def notes(self) -> tuple[str, ...]:
        """What a reader must know beside the numbers."""
        return (*self.warnings, *self._facts())

    def _facts(self) -> Iterator[str]:
        """Give how the numbers were found."""
        fit, preparation = self.fit, self.preparation
        yield (
            f"{len(fit.values)} base parameters of {int(fit.counts.sum())} equations, each an average of "
            f"{counted(preparation.decimation, 'reading')}; condition {fit.condition:.3g}; friction: {self.law}"
        )
        yield (
            f"filter of {preparation.cutoff:.3g} Hz; positions are read {preparation.delay * 1e3:.2f} "
            f"± {self.delay_error * 1e3:.2f} ms later than efforts"
        )
        if fit.correlation.size and fit.correlation.max() > 1:
            most = int(np.argmax(fit.correlation))
            count, alone = int(fit.counts[most]), int(fit.counts[most] / fit.correlation[most])
            yield (
                f"residuals hang together in time: {count:,} of {self.model.arm.joint_label(most)} tell as much as "
                f"{alone:,} independent ones; the errors know it"
            )
        if fit.outliers:
            where = listed([_outlier_text(each) for each in fit.outliers], _MAX_NAMED)
            yield f"{counted(len(fit.outliers), 'outlier')}, with hardly any weight: {where}"
        if self.weak:
            named = listed([each.name for each in self.weak], _MAX_NAMED)
            yield f"{counted(len(self.weak), 'base parameter')} hardly known, to {LARGEST_ERROR:.0%} or worse: {named}"
        if self.model.coupled_motors and self.model.arm.coupling is None:
            yield "the arm has no coupling: rotors and friction of coupled motors are among the base parameters alone"
        elif self.model.coupled_motors:
            named = listed([self.model.arm.joint_label(motor) for motor in self.model.coupled_motors], _MAX_NAMED)
            yield (
                f"{named}: the arm has rotors and friction of the coupled motors; what the joints have beside is among "
                "the base parameters alone"
            )

    def as_data(self) -> dict[str, Any]:
        """Return it as plain data in SI units."""
        fit, base = self.fit, self.model.base
        low, high = fit.values - _NORMAL_95 * fit.errors, fit.values + _NORMAL_95 * fit.errors
        columns = zip(base.names, groupings(self.model), fit.values, fit.errors, low, high, strict=True)
        data: dict[str, Any] = {
            "arm": self.model.arm.name,
            "friction": self.law,
            "base_parameters": [
                {
                    "name": name,
                    "combines": text,
                    "value": float(x),
                    "error": float(e),
                    "low": float(a),
                    "high": float(b),
                }
                for name, text, x, e, a, b in columns
            ],
            "covariance": fit.covariance.tolist(),
            "residuals": {"sigma": fit.sigma.tolist(), "equations": fit.counts.tolist()},
            "condition": fit.condition,
            "cutoff": self.preparation.cutoff,
            "decimation": self.preparation.decimation,
            "delay": self.preparation.delay,
            "delay_error": self.delay_error,
            "held_friction": self.held,
            "choices": [choice._asdict() for choice in self.choices],
            "outliers": [outlier._asdict() for outlier in fit.outliers],
            "weak": [each._asdict() for each in self.weak],
            "validation": [each.as_data() for each in _by_log(self.validation)],
            "training": [each.as_data() for each in _by_log(self.training)],
            "notes": list(self.notes),
        }
        if self.standard is not None:
            data["standard_parameters"] = dict(zip(self.model.names, self.standard.values.tolist(), strict=True))
            data["weight_of_drawing"] = self.standard.weight
            data["validation_of_arm"] = [each.as_data() for each in _by_log(self.validation_of_arm)]
        return data

    def tables(self) -> Iterator[ResultTable]:
        """Give held-out errors, then what was tried, the parameters, and the links."""
        joints = [f"j{i}" for i in range(1, self.model.arm.n + 1)]
        numbers = range(2, 2 + len(joints))
        sets = {"held out": self.validation, "held out, arm file": self.validation_of_arm, "fitted": self.training}
        shown = [(name, each) for name, of in sets.items() for each in _by_log(of)]
        rows = [(name, each.name, *(f"{x:.3g}" for x in each.rms)) for name, each in shown]
        units = sorted({joint.units.effort for joint in self.model.arm.joints})
        yield ResultTable(
            title=f"Root mean square of what is not predicted, {' or '.join(units)}",
            heads=("", "log", *joints),
            rows=rows,
            numbers=numbers,
        )
        rows = [(name, each.name, *(f"{100 * x:.1f}" for x in each.relative)) for name, each in shown]
        yield ResultTable(
            title="The same by the root mean square of the efforts, %",
            heads=("", "log", *joints),
            rows=rows,
            numbers=numbers,
        )
        yield ResultTable(
            title="Tried on held-out blocks",
            heads=("choice", "option", "error", ""),
            rows=[(c.what, c.option, f"{c.error:.4f}", "chosen" if c.chosen else "") for c in self.choices],
            numbers=(2,),
            remark="errors by the standard deviations of the residuals",
        )
        yield ResultTable(
            title="Hardly known, and what would tell",
            heads=("parameter", "known to", "motion", "then to"),
            rows=[
                (
                    each.name,
                    _known_to(each.error),
                    each.motion or "none of one or two joints",
                    _known_to(each.error_after),
                )
                for each in self.weak
            ],
            numbers=(1, 3),
        )
        yield from self.parameter_tables()
        if self.standard is not None:
            yield _link_table(self.model, self.standard)

    def parameter_tables(self) -> Iterator[ResultTable]:
        """Give the base parameters with their errors: those of links, and those of drives, which combine nothing."""
        weak = {each.name for each in self.weak}
        unknown = {each.name for each in self.weak if each.error >= UNKNOWN}
        combined = groupings(self.model)
        drives = [name.rstrip("0123456789") not in LINK_NAMES for name in self.model.base.names]
        for title, of_drives in (("links", False), ("drives", True)):
            kept = [k for k, is_drive in enumerate(drives) if is_drive == of_drives]
            names = [self.model.base.names[k] for k in kept]
            yield ResultTable(
                title=f"Base parameters of the {title}, SI units",
                heads=("parameter", "value", "±", *([] if of_drives else ["combines"])),
                rows=[
                    (
                        self.model.base.names[k],
                        "not known" if self.model.base.names[k] in unknown else f"{self.fit.values[k]:+z.5g}",
                        "-" if self.model.base.names[k] in unknown else f"{self.fit.errors[k]:.2g}",
                        *([] if of_drives else [combined[k]]),
                    )
                    for k in kept
                ],
                numbers=(1, 2),
                marks=["faded" if name in weak else "" for name in names],
            )


def predict(model: DynamicModel, values: Array, motion: Motion, preparation: Preparation, held: float) -> Prediction:
    """Return how well the efforts of a motion are predicted, averaged over as many readings as equations are.

    Args:
        model: of the arm.
        values: (b,) base parameters.
        motion: of the arm.
        preparation: of the motion.
        held: share of dry friction that joints keep when they have stopped.
    """
    tau = predicted(model, values, motion, preparation.slow, held)
    size = preparation.decimation
    count = len(tau) // size * size

    def averaged(values: Array) -> Array:
        return np.asarray(values[:count].reshape(-1, size, *values.shape[1:]).mean(axis=1))

    return Prediction(name=motion.name, t=averaged(motion.t), measured=averaged(motion.tau), predicted=averaged(tau))


def _by_log(predictions: Iterable[Prediction]) -> list[Prediction]:
    """Return predictions with the blocks of each log as one."""
    logs: dict[str, list[Prediction]] = {}
    for each in predictions:
        logs.setdefault(each.name, []).append(each)
    return [
        Prediction(
            name=name,
            t=np.concatenate([each.t for each in blocks]),
            measured=np.concatenate([each.measured for each in blocks]),
            predicted=np.concatenate([each.predicted for each in blocks]),
        )
        for name, blocks in logs.items()
    ]


def _known_to(error: float) -> str:
    return f"{error:.0%}" if error < UNKNOWN else "not at all"


def _outlier_text(outlier: Outlier) -> str:
    return f"joint {outlier.joint + 1} at {outlier.t:.2f} s of {outlier.log} ({outlier.deviations:+.0f} sigma)"


def _link_table(model: DynamicModel, standard: Standard) -> ResultTable:
    """Return masses and centres of the links, beside those of the drawing."""
    rows = []
    for i, drawn in enumerate(model.arm.links):
        link = link_of(standard.values[OF_LINK * i : OF_LINK * (i + 1)])
        centre = (f"{x * 1e3:z.1f}" for x in link.com)
        mass = f"{drawn.mass:.3f}" if drawn.mass and not drawn.unknown else "-"
        rows.append((str(i + 1), f"{link.mass:.3f}", mass, *centre))
    return ResultTable(
        title="Links that explain the efforts and are nearest to the drawing",
        heads=("link", "kg", "drawn kg", "x mm", "y mm", "z mm"),
        rows=rows,
        numbers=range(1, 6),
    )
