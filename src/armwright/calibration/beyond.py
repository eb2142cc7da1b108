"""What geometry leaves: joints that give, gears that run out of true, and what is learnt of the rest.

Each is tried on top of what was kept before, and kept only if points that it has not seen are hit better: by more
than chance makes of it, and by a part worth having. What was kept is left out again if what came later does without.

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
from armwright.calibration.bending import gears, springs
from armwright.calibration.chain import Bend
from armwright.calibration.fitting import Calibration, calibrate_to
from armwright.calibration.readings import Readings
from armwright.calibration.validation import HeldOut, cross_validated, dealt
from armwright.errors import InvalidValueError, MissingExtraError

# A gain that is so many times as large as chance makes it is one, if it is such a part of what there was. Four things
# are tried, and chance is to be taken for any of them as rarely as two deviations are for one (Bonferroni).
_SURE, _WORTH = 2.53, 0.01
# From so many points the lengths are learnt over which what is left changes; more cost time with their cube.
_MOST = 300
# Lengths in sines and cosines of the joints, and noise as a part of the variance of what is left.
_LENGTHS, _AMPLITUDE, _NOISE = (0.1, 100.0), (1e-4, 10.0), (1e-3, 10.0)
_ORDERS = (1, 2)


class Tried(NamedTuple):
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
class Beyond:
    """A calibration with all beyond geometry that held-out points confirm.

    Attributes:
        calibration: with the bends of joints that are kept.
        learnt: what is added to where it has the tool; None where learning did not help.
        tried: everything that was tried, in order; the first is geometry alone.
        geometry: held out, of geometry alone.
        held_out: of all that is kept.
    """

    calibration: Calibration
    learnt: "Learnt | None"
    tried: tuple[Tried, ...]
    geometry: HeldOut
    held_out: HeldOut

    def predict(self, q: ArrayLike) -> Array:
        """Return (m, 3) where the arm has its tool, in the frame of the measurements [m]."""
        places = self.calibration.predict(q)
        return places if self.learnt is None else np.asarray(places + self.learnt.shift(q), dtype=np.float64)


class Learnt:
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


def calibrate_beyond(
    arm: Arm,
    seen: Readings,
    *,
    folds: int = 5,
    seed: int = 0,
    base: Array | None = None,
    progress: Callable[[str], None] | None = None,
) -> Beyond:
    """Calibrate an arm, and try what is not geometry: springs, gears once and twice a turn, a learnt residual.

    Args:
        arm: as it is said to be, with n joints.
        seen: readings of it, points among them.
        folds: parts in which postures are held out.
        seed: of the parts.
        base: see ``calibrate_to``.
        progress: told what is being done.

    Raises:
        InvalidValueError: no point was measured, or see ``calibrate_to``.
    """

    def told(what: str) -> None:
        if progress is not None:
            progress(what)

    points = seen.with_point & (seen.frame == 0)
    if not points.any():
        raise InvalidValueError("expected points in the measuring frame, on which what is left is seen; got none")
    told("holding points out: geometry")
    held = geometry = cross_validated(arm, seen, folds=folds, seed=seed, base=base)
    tried = [Tried("geometry", float(held.distance[points].mean()), 0.0, 0.0, kept=True, why="")]
    bends, held = _kept_bends(
        arm,
        held,
        points=points,
        validated=lambda bends: cross_validated(arm, seen, folds=folds, seed=seed, base=base, bends=bends),
        tried=tried,
        told=told,
    )
    told("fitting all that is kept")
    found = calibrate_to(arm, seen, base=base, bends=bends)
    told("learning what is left")
    try:
        better = _learnt_held_out(arm, seen, points, bends=bends, base=base, folds=folds, seed=seed)
    except MissingExtraError as error:
        tried.append(Tried("what is left, learnt", None, 0.0, 0.0, kept=False, why=str(error)))
        return Beyond(calibration=found, learnt=None, tried=tuple(tried), geometry=geometry, held_out=held)
    tried.append(_judged("what is left, learnt", held.distance[points], better.distance[points]))
    learnt = None
    if tried[-1].kept:
        held = better
        learnt = _learn(arm, seen.q[points], seen.points[points] - found.predict(seen.q[points]), seed)
    return Beyond(calibration=found, learnt=learnt, tried=tuple(tried), geometry=geometry, held_out=held)


def _kept_bends(
    arm: Arm,
    held: HeldOut,
    *,
    points: Flags,
    validated: Callable[[tuple[Bend, ...]], HeldOut],
    tried: list[Tried],
    told: Callable[[str], None],
) -> tuple[tuple[Bend, ...], HeldOut]:
    """Return the bends that held-out points confirm, and these points with them; say what was tried.

    Args:
        arm: as it is said to be.
        held: of geometry alone.
        points: (m,) which readings are judged by.
        validated: holds readings out, with some bends.
        tried: grows by what is tried here.
        told: is told what is being done.
    """
    candidates = [("joints that give under gravity", springs(arm))]
    candidates += [(f"gears, {('once', 'twice')[order - 1]} a turn", gears(arm, order)) for order in _ORDERS]
    bends: tuple[Bend, ...] = ()
    parts: list[tuple[int, tuple[Bend, ...]]] = []
    for name, more in candidates:
        if not more:
            tried.append(Tried(name, None, 0.0, 0.0, kept=False, why=_not_there(name, arm)))
            continue
        told(f"holding points out: {name}")
        try:
            better = validated((*bends, *more))
        except InvalidValueError as error:
            tried.append(Tried(name, None, 0.0, 0.0, kept=False, why=str(error)))
            continue
        tried.append(_judged(name, held.distance[points], better.distance[points]))
        if tried[-1].kept:
            bends, held = (*bends, *more), better
            parts.append((len(tried) - 1, more))
    # What was kept first may have stood in for what came later.
    for number, part in parts[:-1]:
        told(f"holding points out: without {tried[number].name}")
        fewer = tuple(bend for bend in bends if bend not in part)
        less = validated(fewer)
        if not _judged(tried[number].name, less.distance[points], held.distance[points]).kept:
            bends, held = fewer, less
            tried[number] = tried[number]._replace(kept=False, why="what was kept later does it too")
    return bends, held


def _not_there(name: str, arm: Arm) -> str:
    return f"{arm.name} has no masses" if "gravity" in name else f"no joint of {arm.name} turns"


def _judged(name: str, before: Array, after: Array) -> Tried:
    """Return whether held-out distances got smaller."""
    gain, chance = float((before - after).mean()), float((before - after).std(ddof=1) / np.sqrt(len(before)))
    sure, worth = gain > _SURE * chance, gain > _WORTH * float(before.mean())
    if sure and worth:
        why = "held-out points are hit better"
    elif gain <= 0:
        why = "held-out points are hit no better"
    elif not sure:
        why = "the gain may be chance"
    else:
        why = "the gain is not worth it"
    return Tried(name, float(after.mean()), gain, chance, kept=sure and worth, why=why)


def _learnt_held_out(
    arm: Arm, seen: Readings, points: Flags, *, bends: tuple[Bend, ...], base: Array | None, folds: int, seed: int
) -> HeldOut:
    """Return by how much points miss when what is left is learnt from the others."""
    held = HeldOut(np.full(len(seen), np.nan), np.full(len(seen), np.nan), np.full((len(seen), 3), np.nan))
    for away in dealt(seen.q, folds, seed):
        found = calibrate_to(arm, seen.take(~away), base=base, bends=bends)
        train, test = points & ~away, points & away
        learnt = _learn(arm, seen.q[train], seen.points[train] - found.predict(seen.q[train]), seed)
        held.distance[away], held.turn[away] = found.model.off(seen.take(away), found.errors)
        if test.any():
            held.places[test] = found.predict(seen.q[test]) + learnt.shift(seen.q[test])
            held.distance[test] = np.linalg.norm(held.places[test] - seen.points[test], axis=1)
    return held


def _learn(arm: Arm, q: Array, left: Array, seed: int) -> Learnt:
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
    return Learnt(arm, process, scale)


def _features(arm: Arm, q: Array) -> Array:
    """Return sines and cosines of turning joints, and positions of slides [m], (m, k)."""
    turning = [joint.revolute for joint in arm.joints]
    turns, slides = q[:, turning], q[:, [not one for one in turning]]
    return np.hstack([np.sin(turns), np.cos(turns), slides])
