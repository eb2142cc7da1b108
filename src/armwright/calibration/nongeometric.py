"""What geometry leaves: joints that give, gears that run out of true, and what is learnt of the rest.

Each is tried on top of what was kept before, and kept only if points that it has not seen are hit better: by more
than chance makes of it, and by a part worth having. What was kept is left out again if what came later does without.

Points that were held out to choose by are hit better for that by chance, too. So how good the whole is, choice
included, is seen on points that no choice has seen: one part after the other is left out, and the others alone choose
and fit.

Source:
    Thesis, outlook of chapter 5; spec of the calibration.
"""

import warnings
from collections.abc import Callable
from typing import Any, NamedTuple

import attrs
import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import Array, ArrayLike, Flags, joint_array, one_core
from armwright.calibration.chain import JointErrorModel
from armwright.calibration.cross_validation import (
    HeldOut,
    calibrate_without,
    distinct_configurations,
    held_out_errors,
    random_folds,
)
from armwright.calibration.fitting import Calibration, calibrate
from armwright.calibration.joint_errors import compliances, transmission_errors
from armwright.calibration.readings import Numbers, Readings
from armwright.errors import ContradictionError, InvalidValueError, MissingExtraError, TooFewError

# A gain that is so many times as large as chance makes it is one, if it is such a part of what there was. Four things
# are tried, and chance is to be taken for any of them as rarely as two deviations are for one (Bonferroni).
_SURE, _WORTH = 2.53, 0.01
# From so many points the lengths are learnt over which what is left changes; more cost time with their cube.
_MOST = 300
# Lengths in sines and cosines of the joints, and noise as a part of the variance of what is left.
_LENGTHS, _AMPLITUDE, _NOISE = (0.1, 100.0), (1e-4, 10.0), (1e-3, 10.0)
_ORDERS = (1, 2)


class ModelComparison(NamedTuple):
    """Something beyond geometry that was tried.

    Attributes:
        name: what.
        held_out: mean distance of held-out points with it [m]; None where it could not be tried.
        gain: by how much less that is than without [m].
        chance: standard deviation of the gain [m].
        kept: whether it is kept.
        why: in words.
    """

    name: str
    held_out: float | None
    gain: float
    chance: float
    kept: bool
    why: str


@attrs.frozen(kw_only=True, eq=False)
class NongeometricCalibration:
    """A calibration with all beyond geometry that held-out points confirm.

    Attributes:
        calibration: with the bends of joints that are kept.
        learnt: what is added to where it has the tool; None where learning did not help.
        tried: everything that was tried, in order; the first is geometry alone.
        geometry: held out, of geometry alone.
        held_out: of all that is kept, by which it was chosen.
        unseen: held out of the choice, too; None where this was not asked for, or too few readings are left.
    """

    calibration: Calibration
    learnt: "ResidualModel | None"
    tried: tuple[ModelComparison, ...]
    geometry: HeldOut
    held_out: HeldOut
    unseen: HeldOut | None

    def pose_errors(self, seen: Readings) -> HeldOut:
        """Return by how much readings miss the arm."""
        return _missed(self.calibration, self.learnt, seen)

    def predict(self, q: ArrayLike) -> Array:
        """Return (m, 3) where the arm has its tool, in the frame of the measurements [m]."""
        places = self.calibration.predict(q)
        return places if self.learnt is None else np.asarray(places + self.learnt.shift(q), dtype=np.float64)


class ResidualModel:
    """What geometry leaves, as a Gaussian process of the posture.

    Three coordinates share the lengths over which they change: how much, over what, and what is noise is learnt from
    the points themselves. Far from all points it is 0.
    """

    def __init__(self, arm: Arm, process: Any, scale: float) -> None:
        """Keep a process and its unit [m]."""
        self._arm, self._process, self._scale = arm, process, scale

    def shift(self, q: ArrayLike) -> Array:
        """Return (m, 3) what is to be added to where the arm has its tool [m]."""
        with one_core():
            mean = self._process.predict(_features(self._arm, np.atleast_2d(joint_array(q, self._arm.n))))
        return np.asarray(mean * self._scale, dtype=np.float64)


def compare_held_out(name: str, before: Array, after: Array, posture: Numbers) -> ModelComparison:
    """Return whether held-out distances got smaller by more than chance makes of it.

    Args:
        name: of what was tried.
        before: (p,) distances without it [m].
        after: (p,) distances with it [m].
        posture: (p,) of each by number; readings of one posture are off together, and count once.
    """
    gain = float((before - after).mean())
    by_posture = np.bincount(np.unique(posture, return_inverse=True)[1], before - after - gain)
    count = len(by_posture)
    chance = float(np.sqrt(count / max(1, count - 1) * np.sum(by_posture**2)) / len(before))
    sure, worth = gain > _SURE * chance, gain > _WORTH * float(before.mean())
    if sure and worth:
        why = "held-out points are hit better"
    elif gain <= 0:
        why = "held-out points are hit no better"
    elif not sure:
        why = "the gain may be chance"
    else:
        why = "the gain is not worth it"
    return ModelComparison(name, float(after.mean()), gain, chance, kept=sure and worth, why=why)


class _Parts:
    """Readings dealt out into parts, and what was fitted without some of them: each is fitted once."""

    def __init__(self, arm: Arm, seen: Readings, *, folds: int, seed: int, base: Array | None) -> None:
        self.arm, self.seen, self.seed, self.base = arm, seen, seed, base
        self.away = random_folds(seen.q, folds, seed)
        self.points = seen.with_point & (seen.frame == 0)
        self.posture = distinct_configurations(seen.q)
        self._fitted: dict[tuple[frozenset[int], tuple[str, ...]], Calibration] = {}
        self._learnt: dict[tuple[frozenset[int], tuple[str, ...]], ResidualModel] = {}

    def within(self, out: frozenset[int]) -> Flags:
        """Return (m,) which readings are not in some parts."""
        return ~np.any([self.away[part] for part in out], axis=0) if out else np.ones(len(self.seen), dtype=np.bool_)

    def fitted(self, out: frozenset[int], bends: tuple[JointErrorModel, ...]) -> Calibration:
        """Return the arm as calibrated without some parts."""
        key = (out, tuple(bend.name for bend in bends))
        if key not in self._fitted:
            self._fitted[key] = (
                calibrate_without(
                    self.arm, self.seen, ~self.within(out), self._called(out), base=self.base, bends=bends
                )
                if out
                else calibrate(self.arm, self.seen, base=self.base, bends=bends)
            )
        return self._fitted[key]

    def _called(self, out: frozenset[int]) -> str:
        return f"part {' and '.join(str(part + 1) for part in sorted(out))} of {len(self.away)}"

    def learnt(self, out: frozenset[int], bends: tuple[JointErrorModel, ...]) -> "ResidualModel":
        """Return what the same readings teach of what it leaves."""
        key = (out, tuple(bend.name for bend in bends))
        if key not in self._learnt:
            found, train = self.fitted(out, bends), self.points & self.within(out)
            q = self.seen.q[train]
            self._learnt[key] = _learn(self.arm, q, self.seen.points[train] - found.predict(q), self.seed)
        return self._learnt[key]

    def held(self, out: frozenset[int], bends: tuple[JointErrorModel, ...], *, learn: bool = False) -> HeldOut:
        """Return by how much readings miss arms that were fitted without their part, and without some others."""
        held = HeldOut.unknown(len(self.seen))
        for part in set(range(len(self.away))) - out:
            without = out | {part}
            found, away = self.fitted(without, bends), self.away[part]
            held.put(away, _missed(found, self.learnt(without, bends) if learn else None, self.seen.take(away)))
        return held


class _Choice(NamedTuple):
    """What held-out points chose."""

    bends: tuple[JointErrorModel, ...]
    learn: bool
    geometry: HeldOut
    held: HeldOut
    tried: tuple[ModelComparison, ...]


def calibrate_nongeometric(
    arm: Arm,
    seen: Readings,
    *,
    folds: int = 5,
    seed: int = 0,
    base: Array | None = None,
    unseen: bool = False,
    progress: Callable[[str], None] | None = None,
) -> NongeometricCalibration:
    """Calibrate an arm, and try what is not geometry: springs, gears once and twice a turn, a learnt residual.

    Args:
        arm: as it is said to be, with n joints.
        seen: readings of it, points among them.
        folds: parts in which postures are held out.
        seed: of the parts.
        base: see ``calibrate``.
        unseen: whether to hold points out of the choice, too, which takes about three times as long.
        progress: told what is being done.

    Raises:
        InvalidValueError: no point was measured, or see ``calibrate``.
    """

    def told(what: str) -> None:
        if progress is not None:
            progress(what)

    parts = _Parts(arm, seen, folds=folds, seed=seed, base=base)
    if not parts.points.any():
        raise InvalidValueError("expected points in the measuring frame, on which what is left is seen; got none")
    chosen = _chosen(parts, frozenset(), told)
    told("fitting all that is kept")
    found = parts.fitted(frozenset(), chosen.bends)
    return NongeometricCalibration(
        calibration=found,
        learnt=parts.learnt(frozenset(), chosen.bends) if chosen.learn else None,
        tried=chosen.tried,
        geometry=chosen.geometry,
        held_out=chosen.held,
        unseen=_unseen(parts, told) if unseen else None,
    )


def _unseen(parts: _Parts, told: Callable[[str], None]) -> HeldOut | None:
    """Return by how much readings miss arms of which they chose nothing; None where too few are left to choose by."""
    held = HeldOut.unknown(len(parts.seen))
    for number, away in enumerate(parts.away):
        out = frozenset({number})
        told(f"holding points out of the choice, part {number + 1} of {len(parts.away)}")
        try:
            chosen = _chosen(parts, out, lambda _: None)
        except (ContradictionError, InvalidValueError):
            return None
        found = parts.fitted(out, chosen.bends)
        learnt = parts.learnt(out, chosen.bends) if chosen.learn else None
        held.put(away, _missed(found, learnt, parts.seen.take(away)))
    return held


def _chosen(parts: _Parts, out: frozenset[int], told: Callable[[str], None]) -> _Choice:
    """Return what the points outside of some parts confirm.

    Args:
        parts: the readings.
        out: parts that are left out of everything.
        told: is told what is being done.
    """
    if len(parts.away) - len(out) < 2:
        raise TooFewError("two parts of the readings at least must be left to choose by")
    points = parts.points & parts.within(out)
    posture = parts.posture[points]

    def of_points(name: str, before: HeldOut, after: HeldOut) -> ModelComparison:
        return compare_held_out(name, before.distance[points], after.distance[points], posture)

    told("holding points out: geometry")
    held = geometry = parts.held(out, ())
    tried = [ModelComparison("geometry", float(held.distance[points].mean()), 0.0, 0.0, kept=True, why="")]
    bends, held = _kept_bends(
        parts.arm, held, judged=of_points, validated=lambda bends: parts.held(out, bends), tried=tried, told=told
    )
    told("learning what is left")
    name, learn = "what is left, learnt", False
    try:
        better = parts.held(out, bends, learn=True)
    except MissingExtraError as error:
        tried.append(ModelComparison(name, None, 0.0, 0.0, kept=False, why=str(error)))
    else:
        tried.append(of_points(name, held, better))
        learn = tried[-1].kept
        held = better if learn else held
    return _Choice(bends, learn, geometry, held, tuple(tried))


def _kept_bends(
    arm: Arm,
    held: HeldOut,
    *,
    judged: Callable[[str, HeldOut, HeldOut], ModelComparison],
    validated: Callable[[tuple[JointErrorModel, ...]], HeldOut],
    tried: list[ModelComparison],
    told: Callable[[str], None],
) -> tuple[tuple[JointErrorModel, ...], HeldOut]:
    """Return the bends that held-out points confirm, and these points with them; say what was tried.

    Args:
        arm: as it is said to be.
        held: of geometry alone.
        judged: says whether readings are hit better.
        validated: holds readings out, with some bends.
        tried: grows by what is tried here.
        told: is told what is being done.
    """
    candidates = [("joints that give under gravity", compliances(arm))]
    candidates += [
        (f"gears, {('once', 'twice')[order - 1]} a turn", transmission_errors(arm, order)) for order in _ORDERS
    ]
    bends: tuple[JointErrorModel, ...] = ()
    parts: list[tuple[int, tuple[JointErrorModel, ...]]] = []
    for name, more in candidates:
        if not more:
            tried.append(ModelComparison(name, None, 0.0, 0.0, kept=False, why=_not_there(name, arm)))
            continue
        told(f"holding points out: {name}")
        try:
            better = validated((*bends, *more))
        except (ContradictionError, InvalidValueError) as error:
            tried.append(ModelComparison(name, None, 0.0, 0.0, kept=False, why=str(error)))
            continue
        tried.append(judged(name, held, better))
        if tried[-1].kept:
            bends, held = (*bends, *more), better
            parts.append((len(tried) - 1, more))
    # What was kept first may have stood in for what came later.
    for number, part in parts[:-1]:
        told(f"holding points out: without {tried[number].name}")
        fewer = tuple(bend for bend in bends if bend not in part)
        less = validated(fewer)
        if not judged(tried[number].name, less, held).kept:
            bends, held = fewer, less
            tried[number] = tried[number]._replace(kept=False, why="what was kept later does it too")
    return bends, held


def _not_there(name: str, arm: Arm) -> str:
    return f"{arm.name} has no masses" if "gravity" in name else f"no joint of {arm.name} turns"


def _missed(found: Calibration, learnt: "ResidualModel | None", seen: Readings) -> HeldOut:
    """Return by how much readings miss a calibrated arm, with what was learnt added where they are points."""
    off, points = held_out_errors(found, seen), seen.with_point & (seen.frame == 0)
    if learnt is not None and points.any():
        off.places[points] += learnt.shift(seen.q[points])
        off.distance[points] = np.linalg.norm(off.places[points] - seen.points[points], axis=1)
    return off


def _learn(arm: Arm, q: Array, left: Array, seed: int) -> ResidualModel:
    """Learn what is left (m, 3) as a function of the posture (m, n).

    Raises:
        MissingExtraError: scikit-learn is not installed.
    """
    try:
        from sklearn.exceptions import ConvergenceWarning  # noqa: PLC0415 - an extra
        from sklearn.gaussian_process import GaussianProcessRegressor  # noqa: PLC0415
        from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel  # noqa: PLC0415
    except ImportError as error:
        raise MissingExtraError(
            'learning what is left needs scikit-learn: pip install "armwright[calibration]"'
        ) from error
    x = _features(arm, q)
    scale = float(np.sqrt(np.mean(left**2))) or 1.0
    some = np.random.default_rng(seed).permutation(len(x))[:_MOST]
    kernel = ConstantKernel(0.3, _AMPLITUDE) * RBF([1.0] * x.shape[1], _LENGTHS) + WhiteKernel(0.7, _NOISE)
    first = GaussianProcessRegressor(kernel, random_state=seed)
    with warnings.catch_warnings(), one_core():
        # A length at its bound is a joint that hardly matters.
        warnings.simplefilter("ignore", ConvergenceWarning)
        first.fit(x[some], left[some] / scale)
        process = GaussianProcessRegressor(first.kernel_, optimizer=None).fit(x, left / scale)
    return ResidualModel(arm, process, scale)


def _features(arm: Arm, q: Array) -> Array:
    """Return sines and cosines of turning joints, and positions of slides [m], (m, k)."""
    turning = [joint.revolute for joint in arm.joints]
    turns, slides = q[:, turning], q[:, [not one for one in turning]]
    return np.hstack([np.sin(turns), np.cos(turns), slides])
