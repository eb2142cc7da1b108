"""Move laws of a straight path, and the search for the one with which journals lose least energy in impacts.

All candidates take as long as the path itself, and none accelerates more. They differ in how long they speed up and
slow down, and in how: with a constant acceleration, which jumps, or with one that grows from 0 and falls to 0.

Source:
    Spec of the life, 3: least loss, subject to the goals.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Literal, TypeAlias

import attrs
import numpy as np

from armwright.arrays import LARGEST, Array, ArrayLike, exact_shape, positive
from armwright.clearance.correction import Correction, correct_path
from armwright.clearance.linkage import Linkage
from armwright.clearance.paths import TEST_PATHS, Path, thesis_path
from armwright.clearance.settings import Settings
from armwright.clearance.vibration.rattling import DWELL, Rattling, rattle
from armwright.errors import InvalidValueError, one_of

Law: TypeAlias = Literal["jumps", "smooth"]
# The largest acceleration of each law, by the mean one of its ramp.
_PEAKS: dict[Law, float] = {"jumps": 1.0, "smooth": 1.5}
# Ramps of each law, from the shortest that the acceleration allows to half the path; runs of each are a second or two.
_RAMPS = 5
# Rounds of the correction of both ends of a path.
_ROUNDS = 3


@attrs.frozen(kw_only=True, eq=False)
class Move:
    """A straight path with a move law, and how the linkage rattles on it.

    Attributes:
        law: of the ramps: the acceleration ``jumps``, or is ``smooth``.
        ramp: how long it speeds up, and slows down [s].
        speed: its top [m/s].
        acceleration: its largest [m/s²].
        rattling: on it.
    """

    law: Law
    ramp: float
    speed: float
    acceleration: float
    rattling: Rattling

    @property
    def loss(self) -> float:
        """Mean energy lost in impacts [J]."""
        return float(self.rattling.loss.mean())


@attrs.frozen(kw_only=True, eq=False)
class Aim:
    """The move law with the least loss in impacts with which the tip reaches its goals.

    Attributes:
        limit: mean distance from the goal that counts as reached [m].
        candidates: the path itself first, as it is.
        move: the one that was chosen; its path is corrected at both ends.
        goal: (r,) distance of the tip from its goal at the end of the corrected path, of r runs [m].
        passed_over: how many candidates with less loss did not reach the goal.
    """

    limit: float
    candidates: tuple[Move, ...]
    move: Move
    goal: Array
    passed_over: int


def straight_move(name: str, start: ArrayLike, goal: ArrayLike, *, duration: float, ramp: float, law: Law) -> Path:
    """Return a straight path of a duration.

    Args:
        name: of the path.
        start: (2,) [m].
        goal: (2,) [m].
        duration: [s].
        ramp: how long it speeds up, and slows down; at most half the duration [s].
        law: of the ramps.
    """
    a, b = (exact_shape(end, (2,), what, LARGEST) for end, what in ((start, "start"), (goal, "goal")))
    one_of("move law", law, _PEAKS)
    if not 0 < positive(ramp, "ramp", "s") <= duration / 2:
        raise InvalidValueError(f"ramp: expected at most half of {duration:g} s, got {ramp:g} s")
    way = float(np.linalg.norm(b - a))
    speed = way / (duration - ramp)
    rest = speed * ramp / 2
    # Distances over the time of each piece; slowing down mirrors speeding up.
    if law == "jumps":
        up, down = [0, 0, speed / ramp / 2], [way - rest, speed, -speed / ramp / 2]
    else:
        up = [0, 0, 0, speed / ramp**2, -speed / (2 * ramp**3)]
        down = [way - rest, speed, 0, -speed / ramp**2, speed / (2 * ramp**3)]
    between = [rest, speed]
    knots = np.array([0.0, ramp, duration - ramp, duration])
    pieces = np.zeros((3, 2, len(up)))
    for piece, coefficients in zip(pieces, (up, between, down), strict=True):
        piece[:, : len(coefficients)] = np.outer((b - a) / way, coefficients)
    pieces[..., 0] += a
    keep = np.diff(knots) > 1e-12
    return Path(name=name, knots=np.append(knots[:-1][keep], duration), pieces=pieces[keep], targets=(duration,))


def aim_for_least_loss(
    linkage: Linkage,
    name: str,
    clearances: Array,
    settings: Settings | None = None,
    *,
    friction: float | None = None,
    limit: float = 5e-5,
    dwell: float = DWELL,
    progress: Callable[[int, int], None] | None = None,
) -> Aim:
    """Return the move law of a test path with the least loss in impacts with which the tip reaches its goals.

    Candidates are simulated as indistinguishable runs. The best is corrected at both ends of its path; where its tip
    does not reach the goal then, the next one is.

    Args:
        linkage: a five-bar with p pins.
        name: of a test path.
        clearances: (p,) [m].
        settings: of the simulations.
        friction: coefficient of friction; that of the material when left out.
        limit: mean distance from the goal that counts as reached [m].
        dwell: how long the tip is watched after the path [s].
        progress: called with the number of simulated candidates, and of all.

    Raises:
        UnknownNameError: the path is no test path.
        InvalidValueError: the tip reaches its goal with no candidate, or see ``rattle``.
    """
    positive(limit, "distance from the goal", "m")
    material = attrs.evolve(linkage.material, friction=linkage.material.friction if friction is None else friction)
    linkage = attrs.evolve(linkage, material=material)
    own = thesis_path(name)
    laws = list(_candidates(own))
    moves = []
    for number, (law, ramp) in enumerate(laws):
        path = straight_move(name, *TEST_PATHS[name], duration=own.duration, ramp=ramp, law=law)
        moves.append(_move(path, law, ramp, rattle(linkage, path, clearances, settings, dwell=dwell)))
        if progress is not None:
            progress(number + 1, len(laws))
    nearest = np.inf
    for passed_over, move in enumerate(sorted(moves, key=lambda move: move.loss)):
        correction = _corrected(linkage, move.rattling.path, clearances, settings)
        goal = correction.after[:, -1]
        if goal.mean() <= limit:
            corrected = rattle(linkage, correction.path, clearances, settings, dwell=dwell)
            chosen = attrs.evolve(move, rattling=corrected)
            return Aim(limit=limit, candidates=tuple(moves), move=chosen, goal=goal, passed_over=passed_over)
        nearest = min(nearest, float(goal.mean()))
    raise InvalidValueError(
        f"{name}: with no move law the tip comes nearer to its goal than {nearest * 1e3:.3g} mm on average; expected a "
        f"limit above that, got {limit * 1e3:g} mm"
    )


def _corrected(linkage: Linkage, path: Path, clearances: Array, settings: Settings | None) -> Correction:
    """Return a path moved at both ends, and smoothly between: more knots would accelerate the tip anew."""
    return correct_path(linkage, path, clearances, settings, knots=2, rounds=_ROUNDS)


def _candidates(own: Path) -> Iterator[tuple[Law, float]]:
    """Give law and ramp of the path itself, and of others that do not accelerate more."""
    duration, ramp = own.duration, float(own.knots[1])
    yield "jumps", ramp
    for law, peak in _PEAKS.items():
        # The acceleration falls with ramp (duration - ramp), which is largest for half the duration.
        product = peak * ramp * (duration - ramp)
        if product <= duration**2 / 4:
            least = duration / 2 - np.sqrt(duration**2 / 4 - product)
            ramps = np.linspace(least, duration / 2, _RAMPS)
            yield from ((law, float(x)) for x in (ramps[1:] if law == "jumps" else ramps))


def _move(path: Path, law: Law, ramp: float, rattling: Rattling) -> Move:
    way = float(np.linalg.norm(path.evaluate(path.duration).position - path.evaluate(0.0).position))
    speed = way / (path.duration - ramp)
    return Move(law=law, ramp=ramp, speed=speed, acceleration=_PEAKS[law] * speed / ramp, rattling=rattling)
