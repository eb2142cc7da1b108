"""All configurations of any arm of six joints, by continuation: paths from the configurations of one pose to another's.

With complex joint positions nearly every pose of such an arm has the same number of configurations, sixteen at most
with six revolute joints. They move steadily as the pose moves, and never meet on a way that is chosen at random. So
once they are known for one complex pose, they are known for all: each is followed to the pose that is asked for, and
the real ones are kept. For the first pose they are found from configurations at random, which are followed to it from
their own poses, and by going round in closed loops through a real pose, from which they come back exchanged.

Source:
    Sommese & Wampler (2005), "The numerical solution of systems of polynomials", parameter continuation; Duff, Hill,
    Jensen, Lee, Leykin & Sommars (2018), "Solving polynomial systems via homotopy continuation and monodromy".
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache
from typing import Any, NamedTuple, TypeAlias

import attrs
import numpy as np
from numpy.typing import NDArray

from armwright.arm.model import Arm
from armwright.arrays import Array, Flags
from armwright.kinematics.inverse_kinematics.axes import SAME, are_parallel, are_perpendicular, joint_axes
from armwright.kinematics.inverse_kinematics.decompositions import label_of, stance
from armwright.kinematics.inverse_kinematics.numeric import numeric_inverse, ranked, search_from
from armwright.kinematics.inverse_kinematics.solution import InverseSolution
from armwright.spatial.rotations import rotation_vector

Complex: TypeAlias = NDArray[np.complex128]

# Configurations at random whose paths to the first pose begin to find all that it has, and as many near singular ones,
# between 0.1 and this power of ten off: with a wrist that is nearly spherical some solutions are far from all others.
_SEEDS, _NEAREST = 48, 5.0
# Loops that bring nothing new before the configurations are said to be all, and loops at most.
_IDLE_LOOPS, _LOOPS = 6, 60
# Complex joint positions closer than this are one [rad], in parts of the length of the arm for slides.
_SAME = 1e-5
# Ways tried to a pose, where paths of the first do not arrive.
_WAYS = 3
# A step along a path: at first, at most and at least, in parts of the way.
_FIRST, _LONGEST, _SHORTEST = 0.01, 0.2, 1e-9
# A step is taken when the first correction is smaller than this, and lengthened when smaller than that [rad].
_RIGHT, _EASY = 0.1, 0.02
_CORRECTIONS, _CORRECTED = 3, 1e-6
# Steps of all paths together.
_STEPS = 2000
# Configurations with imaginary parts below this may be real ones [rad]: they are followed down to the pose.
_REAL = 1e-2
_TURN = 2 * math.pi
_IDENTITY = np.eye(4)
# Where the linear and the angular part of a twist are in its matrix, row by row.
_TWIST_ENTRIES = [3, 7, 11, 9, 2, 4]


class _Pose(NamedTuple):
    """Complex poses: quaternions and positions in homogeneous coordinates, (..., 4) each; scales do not matter."""

    rotation: Complex
    position: Complex

    def scaled(self, rotation: complex, position: complex) -> _Pose:
        """Return the same pose in other coordinates, to which another way leads."""
        return _Pose(self.rotation * rotation, self.position * position)

    def of(self, rows: Any) -> _Pose:
        """Return some of the poses."""
        return _Pose(self.rotation[rows], self.position[rows])


@attrs.frozen(kw_only=True, eq=False)
class _Chain:
    """The displacements that an arm makes, lengths in parts of its size.

    Attributes:
        twists: (6, 4, 4) of the joint axes at joint positions 0.
        squares: (6, 4, 4) of the same matrices.
        revolute: (6,) which joints rotate.
        size: the length that counts as 1 [m].
    """

    twists: Array
    squares: Array
    revolute: Flags
    size: float

    def displacements(self, q: Complex) -> tuple[Complex, Complex]:
        """Return the displacements (k, 4, 4) of the tool at joint positions (k, 6), and their Jacobians (k, 6, 6)."""
        first = np.where(self.revolute, np.sin(q), q)[..., None, None]
        second = np.where(self.revolute, 1 - np.cos(q), 0.0)[..., None, None]
        each = _IDENTITY + first * self.twists + second * self.squares
        frames = np.empty((len(q), q.shape[1] + 1, 4, 4), dtype=np.complex128)
        frames[:, 0] = _IDENTITY
        for i in range(q.shape[1]):
            np.matmul(frames[:, i], each[:, i], out=frames[:, i + 1])
        before = frames[:, :-1]
        back = np.zeros_like(before)
        back[..., :3, :3] = np.swapaxes(before[..., :3, :3], -1, -2)
        back[..., :3, 3:] = -back[..., :3, :3] @ before[..., :3, 3:]
        back[..., 3, 3] = 1
        moved = before @ self.twists @ back
        columns = moved.reshape(*moved.shape[:-2], 16)[..., _TWIST_ENTRIES]
        return frames[:, -1], np.swapaxes(columns, -1, -2)


class _Fibre(NamedTuple):
    """An arm, and all its configurations (k, 6) at one complex pose; with ways from there to any other pose."""

    chain: _Chain
    pose: _Pose
    q: Complex
    scales: tuple[Complex, ...]


def every_solution(arm: Arm, X: Array, near: Array) -> InverseSolution:
    """Return all configurations of any arm of six joints at one pose.

    Where the pose is singular, a path could not be followed to its end, or a conjugate is missing, other ways to the
    pose are tried, and what ``numeric_inverse`` finds is added.

    Args:
        arm: an arm of six joints.
        X: (4, 4) tool pose in the base frame.
        near: (6,) the present joint positions.
    """
    fibre = _fibre(arm)
    target = _target(arm, fibre.chain, X)
    ends, real, regular = [], [], False
    for scales in fibre.scales:
        q, arrived = _followed(fibre.chain, fibre.q, fibre.pose, target.scaled(*scales))
        ends.append(q)
        real.append(np.abs(q.imag).max(axis=-1) < np.where(arrived, _REAL, 10 * _REAL))
        # Of a real pose they are all there only if each is another one and has its conjugate among them.
        whole = len(q) == len(_distinct(fibre.chain, q)) == len(_distinct(fibre.chain, np.concatenate([q, q.conj()])))
        regular = len(q) > 0 and bool(arrived.all()) and whole
        if regular:
            break
    starts = np.concatenate(ends).real[np.concatenate(real)]
    starts = np.where(arm.revolute, np.remainder(starts + math.pi, _TURN) - math.pi, starts * fibre.chain.size)
    solutions = search_from(arm, X, near, starts, more=not regular)
    return numeric_inverse(arm, X, near) if not len(solutions) else ranked(arm, X, near, solutions, _name(arm))


def _name(arm: Arm) -> Callable[[Array], str] | None:
    """Return what names configurations by how shoulder and elbow stand; None where the axes do not tell."""
    axes = joint_axes(arm)
    w = axes.directions
    if axes.kinds != "RRRRRR" or not are_parallel(w[1], w[2]) or not are_perpendicular(w[0], w[1]):
        return None
    end = axes.points[3]
    if not are_parallel(w[2], w[3]) and not are_parallel(w[3], w[4]):
        # The forearm ends where axis 4 comes nearest to axis 5.
        across = np.cross(w[3], w[4])
        end = end + w[3] * (np.cross(axes.points[4] - end, w[4]) @ across) / (across @ across)
    return lambda q: label_of((1, 3), stance(axes, q, end)) + ", wrist"


@lru_cache(maxsize=64)  # found once for an arm, with some hundred paths
def _fibre(arm: Arm) -> _Fibre:
    """Return all configurations of an arm at some complex pose, found by paths from others and round in loops."""
    rng = np.random.default_rng(0)
    chain = _chain(arm)
    shape = (_SEEDS, arm.n)
    q = rng.uniform(-math.pi, math.pi, size=shape) + 0.4j * rng.normal(size=shape)
    q = np.where(chain.revolute, q, 0.5 * _complex(rng, *shape))
    q = np.concatenate([q, _near_singular(arm, q.real, rng)])
    here, there = _Pose(_complex(rng, 4), _complex(rng, 4)), _Pose(*rng.normal(size=(2, 4)).astype(np.complex128))
    q, arrived = _followed(chain, q, _poses(chain.displacements(q)[0]), here)
    q = _distinct(chain, q[arrived])
    idle = 0
    for _ in range(_LOOPS):
        known = len(q)
        away, arrived = _followed(chain, q, here, there.scaled(*_complex(rng, 2)))
        # That pose is real: of every configuration the conjugate is one as well.
        away = _distinct(chain, np.concatenate([away[arrived], away[arrived].conj()]))
        back, returned = _followed(chain, away, there, here.scaled(*_complex(rng, 2)))
        q = _distinct(chain, np.concatenate([q, back[returned]]))
        idle = idle + 1 if len(q) == known else 0
        if idle == _IDLE_LOOPS:
            break
    return _Fibre(chain, here, q, tuple(_complex(rng, 2) for _ in range(_WAYS)))


def _near_singular(arm: Arm, q: Array, rng: np.random.Generator) -> Complex:
    """Return configurations (k, n) with one joint moved so that the axes before and behind it are in one plane with it.

    They are off by random complex parts of many sizes. Joints take their turns; those beside parallel axes, and slides,
    do not.
    """
    w, q = joint_axes(arm).directions, q.copy()
    level = {}
    for i in range(1, arm.n - 1):
        before, behind = (v - w[i] * (v @ w[i]) for v in (w[i - 1], w[i + 1]))
        if arm.revolute[i] and min(np.linalg.norm(before), np.linalg.norm(behind)) > SAME:
            level[i] = math.atan2(w[i] @ np.cross(behind, before), behind @ before)
    for k, row in enumerate(q if level else ()):
        joint = list(level)[k % len(level)]
        row[joint] = level[joint] + math.pi * rng.integers(2)
    return np.asarray(q + 10.0 ** -rng.uniform(1.0, _NEAREST, size=(len(q), 1)) * _complex(rng, *q.shape))


def _chain(arm: Arm) -> _Chain:
    axes = joint_axes(arm)
    spread = np.linalg.norm(axes.points - axes.points.mean(axis=0), axis=-1).max()
    size = float(max(spread, np.linalg.norm(axes.X_BT[:3, 3] - axes.points[-1]))) or 1.0
    twists = np.zeros((arm.n, 4, 4))
    for i, (kind, o, w) in enumerate(zip(axes.kinds, axes.points / size, axes.directions, strict=True)):
        if kind == "R":
            twists[i, :3, :3] = [[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]]
            twists[i, :3, 3] = np.cross(o, w)
        else:
            twists[i, :3, 3] = w
    return _Chain(twists=twists, squares=twists @ twists, revolute=arm.revolute, size=size)


def _target(arm: Arm, chain: _Chain, X: Array) -> _Pose:
    """Return the displacement of the tool to a pose (4, 4)."""
    T = X @ np.linalg.inv(joint_axes(arm).X_BT)
    position = np.append(T[:3, 3] / chain.size, 1.0)
    half = rotation_vector(T[:3, :3]) / 2
    angle = float(np.linalg.norm(half))
    rotation = np.append(math.cos(angle), np.sinc(angle / math.pi) * half)
    return _Pose(rotation.astype(np.complex128), position.astype(np.complex128))


def _poses(T: Complex) -> _Pose:
    """Return complex displacements (k, 4, 4) as quaternions, scalar first, and positions."""
    w = np.sqrt(np.trace(T, axis1=-2, axis2=-1)) / 2
    v = np.stack([T[:, 2, 1] - T[:, 1, 2], T[:, 0, 2] - T[:, 2, 0], T[:, 1, 0] - T[:, 0, 1]], axis=-1)
    return _Pose(np.concatenate([w[:, None], v / (4 * w[:, None])], axis=-1), T[..., 3].copy())


def _crossing(v: Complex) -> Complex:
    """Return the matrices (k, 3, 3) of the cross products with vectors (k, 3)."""
    K = np.zeros((len(v), 3, 3), dtype=np.complex128)
    K[:, 0, 1], K[:, 0, 2], K[:, 1, 2] = -v[:, 2], v[:, 1], -v[:, 0]
    return np.asarray(K - np.swapaxes(K, -1, -2))


def _complex(rng: np.random.Generator, *shape: int) -> Complex:
    return np.asarray(rng.normal(size=shape) + 1j * rng.normal(size=shape))


def _on_way(start: _Pose, goal: _Pose, t: Array) -> tuple[Complex, Complex, Complex]:
    """Return rotations (k, 3, 3), positions (k, 3) and velocities (k, 6) on ways from poses to one, at parts (k,)."""
    t = t[:, None]
    Q, Q_rate = start.rotation + t * (goal.rotation - start.rotation), goal.rotation - start.rotation
    P, P_rate = start.position + t * (goal.position - start.position), goal.position - start.position
    norm = (Q * Q).sum(axis=-1, keepdims=True)
    w, v = Q[:, :1], Q[:, 1:]
    # Twice the vector part of the rate times the conjugate: where its length goes does not count.
    K = _crossing(v)
    turn = 2 * (Q_rate[:, 1:] * w - Q_rate[:, :1] * v + (K @ Q_rate[:, 1:, None])[..., 0]) / norm
    R = np.eye(3) + 2 * (w[..., None] * K + K @ K) / norm[..., None]
    p = P[:, :3] / P[:, 3:]
    p_rate = (P_rate[:, :3] - p * P_rate[:, 3:]) / P[:, 3:]
    spin = _crossing(turn)
    return R, p, np.concatenate([p_rate - (spin @ p[..., None])[..., 0], turn], axis=-1)


@np.errstate(all="ignore")
def _followed(chain: _Chain, q: Complex, start: _Pose, goal: _Pose) -> tuple[Complex, NDArray[np.bool_]]:
    """Follow configurations (k, 6) of one pose, or each of its own, to those of another: these, and which arrive.

    Each path takes steps of its own length: a cubic through the last two points and their tangents says where the next
    is, and Newton's method corrects it.
    """
    q = q.copy()
    shape = (len(q), 4)
    start = _Pose(np.broadcast_to(start.rotation, shape), np.broadcast_to(start.position, shape))
    t, step = np.zeros(len(q)), np.full(len(q), _FIRST)
    rate = _rates(chain, q, _on_way(start, goal, t)[2])
    before, before_rate, last_step = q - _FIRST * rate, rate.copy(), np.full(len(q), _FIRST)
    running = np.arange(len(q))
    for _ in range(_STEPS):
        if not len(running):
            break
        h = np.minimum(step[running], 1 - t[running])
        guess = _extrapolated(
            (before[running], before_rate[running]), (q[running], rate[running]), last_step[running], h
        )
        R, p, velocity = _on_way(start.of(running), goal, t[running] + h)
        moved, moved_rate, first, last = _corrected(chain, guess, R, p, velocity)
        good = (first < _RIGHT) & (last < _CORRECTED)
        taken = running[good]
        before[taken], before_rate[taken], last_step[taken] = q[taken], rate[taken], h[good]
        q[taken], rate[taken] = moved[good], moved_rate[good]
        t[taken] += h[good]
        factor = np.clip((_EASY / np.maximum(first, 1e-12)) ** 0.25, 0.5, 2.0)
        factor = np.where(good, factor, np.minimum(factor, 0.4))
        step[running] = np.minimum(h * factor, _LONGEST)
        t[taken[1 - t[taken] < 1e-14]] = 1.0
        running = running[(t[running] < 1) & (step[running] > _SHORTEST)]
    return q, t >= 1


def _extrapolated(one: tuple[Complex, Complex], two: tuple[Complex, Complex], way: Array, on: Array) -> Complex:
    """Return where the cubic through two points (k, 6), each with its rate, is: ``on`` (k,) beyond the second."""
    (q_0, rate_0), (q_1, rate_1) = one, two
    s = (1 + on / way)[:, None]
    way = way[:, None]
    return np.asarray(
        (2 * s**3 - 3 * s**2 + 1) * q_0
        + (s**3 - 2 * s**2 + s) * way * rate_0
        + (3 * s**2 - 2 * s**3) * q_1
        + (s**3 - s**2) * way * rate_1
    )


def _corrected(
    chain: _Chain, q: Complex, R: Complex, p: Complex, velocity: Complex
) -> tuple[Complex, Complex, Array, Array]:
    """Return configurations (k, 6) after Newton's method, their rates, and the sizes of first and last correction."""
    first = last = np.zeros(len(q))
    rate = q
    for number in range(_CORRECTIONS):
        T, J = chain.displacements(q)
        E = R @ np.swapaxes(T[:, :3, :3], -1, -2)
        both = np.stack([velocity, velocity], axis=-1)
        both[:, :3, 0] = p - (E @ T[:, :3, 3, None])[..., 0]
        both[:, 3, 0], both[:, 4, 0], both[:, 5, 0] = E[:, 2, 1], E[:, 0, 2], E[:, 1, 0]
        both[:, 3, 0] -= E[:, 1, 2]
        both[:, 4, 0] -= E[:, 2, 0]
        both[:, 5, 0] -= E[:, 0, 1]
        both[:, 3:, 0] *= 0.5
        solved = _solved(J, both)
        q, rate = q + solved[..., 0], solved[..., 1]
        last = np.abs(solved[..., 0]).max(axis=-1)
        if number == 0:
            first = last
        if (last[first < _RIGHT] < _CORRECTED).all():
            break
    return q, rate, np.nan_to_num(first, nan=np.inf), np.nan_to_num(last, nan=np.inf)


def _rates(chain: _Chain, q: Complex, velocity: Complex) -> Complex:
    return np.asarray(_solved(chain.displacements(q)[1], velocity[..., None])[..., 0])


def _solved(J: Complex, b: Complex) -> Complex:
    """Solve equations (k, 6, 6), NaN where one has no solution."""
    try:
        return np.asarray(np.linalg.solve(J, b))
    except np.linalg.LinAlgError:
        singular = np.abs(np.linalg.det(J)) == 0
        J = np.where(singular[:, None, None], np.eye(6), J)
        return np.where(singular[:, None, None], np.nan, np.linalg.solve(J, b))


def _distinct(chain: _Chain, q: Complex) -> Complex:
    """Return configurations (k, 6) without those that another one equals but for whole revolutions."""
    apart = q[:, None] - q
    turned = np.remainder(apart.real + math.pi, _TURN) - math.pi + 1j * apart.imag
    apart = np.where(chain.revolute, turned, apart)
    same = np.abs(apart).max(axis=-1) < _SAME
    return np.asarray(q[~np.tril(same, -1).any(axis=1)])
