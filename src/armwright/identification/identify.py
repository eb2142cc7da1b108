"""Identification from logs: filter, delay, friction and prior chosen by held-out blocks, then fitted to everything."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import attrs
import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.errors import MissingExtraError, TooFewError
from armwright.identification.checks import (
    badly_explained,
    effort_warnings,
    log_warnings,
    refuse_other_units,
    refuse_reversed,
    refuse_swapped,
)
from armwright.identification.delay import with_delay
from armwright.identification.equations import equations
from armwright.identification.feasible import feasible
from armwright.identification.fitting import Fit, Sums, robust, summed, weighted
from armwright.identification.friction import LAWS, Law, held_share, without_dry
from armwright.identification.identifiability import weak_parameters
from armwright.identification.log import LEAST_SAMPLES, Log
from armwright.identification.misfit import friction_misfits
from armwright.identification.model import DynamicModel
from armwright.identification.result import Choice, Identification, Prediction, predict
from armwright.identification.signals import BORDER, Motion, Preparation, cut, motions, preparation_of

# Cut-off frequencies that are tried beside the one at which what is filtered off is white.
_CUTOFFS = (0.5, 1.0, 2.0)
# Weights of the drawing that are tried [squared standard deviations].
_WEIGHTS = (1.0, 30.0, 1000.0)
# The shortest block that is held out [s], and blocks per fold that a log is cut into.
_LEAST_BLOCK, _BLOCKS_PER_FOLD = 1.0, 2
# A law of friction is worth its terms if it predicts held-out blocks better by so many standard errors, and this part.
_WORTH, _LEAST_GAIN = 1.0, 0.002


def identify(
    arm: Arm,
    logs: Sequence[Log],
    *,
    check: Sequence[Log] = (),
    coupling: Array | None = None,
    laws: Sequence[Law] = LAWS,
    cutoff: float | None = None,
    decimation: int | None = None,
    delay: float | None = None,
    weight: float | None = None,
    folds: int = 5,
    progress: Callable[[str], None] | None = None,
) -> Identification:
    """Identify the dynamics of an arm.

    What has to be chosen is chosen by folds of the logs: blocks in time, each filtered by itself, so that none that is
    trained on knows anything of one that is held out. Then everything is fitted to all logs.

    Args:
        arm: the arm as drawn, with n joints; its masses are the prior of what motions cannot tell.
        logs: of its motions, sampled alike.
        check: logs that are held out from everything, to validate with.
        coupling: (n, n) positions of motors by those of joints; that of the arm when left out: see ``DynamicModel``.
        laws: of friction, to choose from.
        cutoff: of the filter [Hz]; chosen when left out.
        decimation: readings that are averaged to one equation; by the cut-off when left out.
        delay: by which positions are read later than efforts [s]; estimated when left out.
        weight: of the drawing: see ``feasible``; chosen when left out.
        folds: how many parts of the logs are held out in turn.
        progress: called with what is being done.

    Raises:
        InvalidValueError: a log is of another arm, or in other units.
        FileFormatError: positions look like degrees.
        TooFewError: too little motion is left.
        ContradictionError: the efforts of joints are swapped or reversed.
    """
    report = progress or (lambda _: None)
    if not logs:
        raise TooFewError("expected at least one log to identify with, got none")
    refuse_other_units(arm, [*logs, *check])
    logs = [log.without_spikes() for log in logs]
    warnings = list(log_warnings(arm, logs))
    logs = [log.moving() for log in logs]
    report("choosing the filter")
    preparation = preparation_of(logs, cutoff=cutoff, decimation=decimation)
    plain = DynamicModel(arm=arm) if coupling is None else DynamicModel(arm=arm, coupling=coupling)
    run = _Run(plain, logs, folds)
    speeds = run.speeds(preparation)
    rich = max(laws, key=lambda law: len(law.terms)).model(plain, speeds)
    refuse_swapped(rich, list(equations(rich, motions(logs, preparation), preparation.decimation)))
    preparation = attrs.evolve(preparation, delay=delay or 0.0)
    if delay is None:
        preparation = with_delay(rich, logs, preparation)
    choices: list[Choice] = []
    if cutoff is None and folds > 1:
        preparation, tried = run.filtered(rich, preparation)
        choices += tried
    report("choosing the law of friction")
    law, tried, by_fold = run.law(laws, preparation, speeds)
    choices += tried
    model = law.model(plain, speeds)
    report("fitting")
    fit, delay_error, sums, all_motions = run.fit(model, preparation)
    warnings += effort_warnings(arm, all_motions)
    refuse_reversed(model, fit.values, fit.errors)
    warnings += friction_misfits(model, fit, preparation, all_motions)
    held = held_share(model, fit.values, all_motions, preparation.slow)
    report("finding bodies")
    standard = None
    try:
        if weight is None:
            weight, tried = _drawing_weight(model, by_fold, fit.sigma)
            choices += tried
        standard = feasible(model, sums, fit.sigma, weight=weight)
    except MissingExtraError as error:
        warnings.append(f"no arm file: {error}")

    def predictions(of: Sequence[Log], values: Array) -> tuple[Prediction, ...]:
        return tuple(predict(model, values, motion, preparation, held) for motion in motions(of, preparation))

    training = tuple(predict(model, fit.values, motion, preparation, held) for motion in all_motions)
    warnings += badly_explained(arm, training)
    return Identification(
        model=model,
        law=law.name,
        preparation=preparation,
        fit=fit,
        standard=standard,
        held=held,
        choices=tuple(choices),
        validation=predictions(check, fit.values),
        validation_of_arm=predictions(check, standard.base) if standard else (),
        training=training,
        delay_error=delay_error,
        speeds=speeds,
        weak=tuple(weak_parameters(model, fit)),
        warnings=tuple(warnings),
    )


def hold_out(log: Log, how: str, *, share: float = 0.25, seconds: float | None = None) -> tuple[list[Log], list[Log]]:
    """Return a log in parts to train on and parts that are held out.

    Args:
        log: the log.
        how: ``blocks``: every so-manieth block in time; ``last``: its end.
        share: of the log that is held out.
        seconds: length of a block; a twentieth of the log when left out.
    """
    if how == "last":
        end = round((1 - share) * len(log.t))
        return [log.take(slice(end))], [log.take(slice(end, None))]
    blocks = cut(log, seconds or (log.t[-1] - log.t[0]) / 20)
    every = max(2, round(1 / share))
    held = blocks[every - 1 :: every]
    # What is next to each other in time stays together.
    kept = [block for i, block in enumerate(blocks) if i % every != every - 1]
    return kept, held


class _Run:
    """The choices of one identification, by folds of its logs."""

    def __init__(self, plain: DynamicModel, logs: Sequence[Log], folds: int) -> None:
        self._plain, self._logs, self._folds = plain, logs, folds

    def speeds(self, preparation: Preparation) -> Array:
        """Return the greatest speeds (n,)."""
        fastest = [np.abs(motion.qd).max(axis=0) for motion in motions(self._logs, preparation)]
        if not fastest:
            raise TooFewError(
                f"no log is longer than what the filter loses at its ends, {2 * preparation.border:.2g} s, and 50 "
                "readings"
            )
        return np.asarray(np.maximum(np.max(fastest, axis=0), np.finfo(float).tiny))

    def _folds_of(self, model: DynamicModel, preparation: Preparation) -> list[Sums]:
        """Return the sums of equations of each fold."""
        total = sum(log.t[-1] - log.t[0] for log in self._logs)
        least = max(_LEAST_BLOCK, (LEAST_SAMPLES + 10) * self._logs[0].period)
        seconds = max(least + 2 * preparation.border, total / (self._folds * _BLOCKS_PER_FOLD * len(self._logs)))
        blocks = [block for log in self._logs for block in cut(log, seconds)]
        found = []
        for fold in range(self._folds):
            own = list(equations(model, motions(blocks[fold :: self._folds], preparation), preparation.decimation))
            if own:
                found.append(summed(own))
        return found

    def filtered(self, model: DynamicModel, preparation: Preparation) -> tuple[Preparation, list[Choice]]:
        """Return the preparation with the cut-off that predicts held-out blocks best."""
        border = preparation.border / min(_CUTOFFS)
        tried = [attrs.evolve(preparation, cutoff=part * preparation.cutoff, border=border) for part in _CUTOFFS]
        folds = [self._folds_of(model, each) for each in tried]
        if any(len(each) < 2 for each in folds):
            return preparation, []
        # All by the same scale, else each would be as good as its own residuals.
        sigma = weighted(_total(folds[0])).sigma
        errors = [_held_out(each, sigma) for each in folds]
        best = int(np.argmin([error.mean() for error in errors]))
        # The lowest that is as good: what is above tells nothing, and noise is there.
        for k in range(best):
            loss = errors[k] - errors[best]
            if loss.mean() < _WORTH * loss.std(ddof=1) / np.sqrt(len(loss)):
                best = k
                break
        choices = [
            Choice("filter", f"{each.cutoff:.3g} Hz", float(np.sqrt(error.mean())), i == best)
            for i, (each, error) in enumerate(zip(tried, errors, strict=True))
        ]
        chosen = tried[best].cutoff
        return attrs.evolve(preparation, cutoff=chosen, border=BORDER / chosen), choices

    def law(self, laws: Sequence[Law], preparation: Preparation, speeds: Array) -> tuple[Law, list[Choice], list[Sums]]:
        """Return the law of friction that predicts held-out blocks best, none with more terms for nothing.

        Returns:
            The law, what was tried, and the sums of its equations by folds.
        """
        sigma: Array | None = None
        folds: list[list[Sums]] = []
        errors: list[Array] = []
        by_speed: dict[float, tuple[DynamicModel, list[Sums]]] = {}
        for law in laws:
            if law.speed_part not in by_speed:
                # Laws are parts of one with all terms, whose sums hold theirs.
                of_same = (each.terms for each in laws if each.speed_part in (0.0, law.speed_part))
                terms = dict.fromkeys(term for terms in of_same for term in terms)
                model = Law("all", tuple(terms), law.speed_part).model(self._plain, speeds)
                by_speed[law.speed_part] = model, self._folds_of(model, preparation)
            model, sums = by_speed[law.speed_part]
            if len(sums) < 2:
                return law, [], []
            names = law.model(self._plain, speeds).base.names
            folds.append([fold.columns([model.base.names.index(name) for name in names]) for fold in sums])
            if sigma is None:
                sigma = weighted(_total(folds[-1])).sigma
            errors.append(_held_out(folds[-1], sigma))
        best = 0
        for k in range(1, len(laws)):
            gain = errors[best] - errors[k]
            doubt = gain.std(ddof=1) / np.sqrt(len(gain))
            if gain.mean() > max(_WORTH * doubt, _LEAST_GAIN * errors[best].mean()):
                best = k
        choices = [
            Choice("friction", law.name, float(np.sqrt(error.mean())), i == best)
            for i, (law, error) in enumerate(zip(laws, errors, strict=True))
        ]
        return laws[best], choices if len(laws) > 1 else [], folds[best]

    def fit(self, model: DynamicModel, preparation: Preparation) -> tuple[Fit, float, Sums, list[Motion]]:
        """Return the fit to all logs, the error of the delay, the sums of its equations, and the motions."""
        all_motions = list(motions(self._logs, preparation))
        start = weighted(summed(equations(model, all_motions, preparation.decimation)))
        blocks = list(equations(model, all_motions, preparation.decimation, values=without_dry(model, start.values)))
        fit = robust(blocks)
        sums = summed(blocks, fit)
        own = range(len(fit.values) - 1)
        # What little delay is left goes with the efforts, not with the parameters.
        shifted = [block._replace(tau=block.tau - fit.values[-1] * block.columns[:, :, -1]) for block in blocks]
        shifted = [block._replace(columns=block.columns[:, :, :-1]) for block in shifted]
        sums = summed(shifted, fit.take(own))
        return fit.take(own), float(fit.errors[-1]), sums, all_motions


def _total(sums: Sequence[Sums]) -> Sums:
    total = sums[0]
    for each in sums[1:]:
        total = total + each
    return total


def _mean(sums: Sums, values: Array, sigma: Array) -> float:
    """Return the mean square of residuals, by the variances of the joints."""
    return float((sums.squares(values) / sigma**2).sum() / max(sums.counts.sum(), 1.0))


def _held_out(folds: Sequence[Sums], sigma: Array) -> Array:
    """Return the mean squares of residuals of each fold, from parameters that were fitted without it."""
    total = _total(folds)
    return np.array([_mean(fold, weighted(total - fold).values, sigma) for fold in folds])


def _drawing_weight(model: DynamicModel, folds: Sequence[Sums], sigma: Array) -> tuple[float, list[Choice]]:
    """Return the weight of the drawing with which held-out blocks are predicted best."""
    if len(folds) < 2:
        return _WEIGHTS[0], []
    total = _total(folds)

    def error(fold: Sums, weight: float) -> float:
        return _mean(fold, feasible(model, total - fold, sigma, weight=weight, is_refined=False).base, sigma)

    errors = [float(np.mean([error(fold, weight) for fold in folds])) for weight in _WEIGHTS]
    best = int(np.argmin(errors))
    return _WEIGHTS[best], [
        Choice("drawing", f"weight {each:g}", float(np.sqrt(error)), i == best)
        for i, (each, error) in enumerate(zip(_WEIGHTS, errors, strict=True))
    ]
