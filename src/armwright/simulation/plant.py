"""An arm as a simulation sees it: what its joints feel at one moment, and what they do between two events."""

from __future__ import annotations

import math
from functools import cached_property
from typing import NamedTuple

import attrs
import numpy as np
import numpy.typing as npt

from armwright.arm.model import Arm
from armwright.arrays import Array, Flags
from armwright.compiled.arm import CompiledArm, compile_arm
from armwright.dynamics.drives import FrictionLaw, drive_speeds, efforts_at_joints, friction_law
from armwright.simulation.complementarity import solve_complementarity
from armwright.simulation.controllers import Controller
from armwright.simulation.result import Brake, JointState

# A speed and a distance that are nothing [rad/s, m/s, rad, m]. Events are found to within them.
STILL = 1e-11
TOUCH = 1e-12
# A held joint moves when the effort exceeds the bound by this part, more than rounding can.
_OVER = 1e-9


class Moment(NamedTuple):
    """Efforts and accelerations at one moment, each (n,): M qdd + bias = tau + friction + hold.

    Of a joint that is held, friction is its offset alone: what holds it is in ``hold``.
    """

    qdd: Array
    tau: Array
    friction: Array
    hold: Array


@attrs.frozen(kw_only=True, eq=False)
class Phase:
    """What the joints do between two events.

    Attributes:
        locked: (n,) which are kept at rest.
        direction: (n,) direction in which the others move, or are about to; 0 for those that are held.
        lower: (n,) smallest effort that can hold a joint.
        upper: (n,) largest effort that can hold a joint.
        state: (n,) numbers of ``JointState``.
    """

    locked: Flags
    direction: Array
    lower: Array
    upper: Array
    state: npt.NDArray[np.int8]


class Start(NamedTuple):
    """What a phase starts from.

    Attributes:
        q: (n,) joint positions.
        qd: (n,) joint speeds.
        phase: what the joints do from now on.
        collided: (n,) numbers of ``JointState``: what each joint has just run into, ``MOVES`` for none.
        loss: energy that stops and brakes took [J].
    """

    q: Array
    qd: Array
    phase: Phase
    collided: npt.NDArray[np.int8]
    loss: float


@attrs.frozen(kw_only=True, eq=False)
class Plant:
    """An arm, its controller and its surroundings.

    Attributes:
        arm: the arm, with n joints.
        controller: of its drives.
        brakes: which are on, and when.
        lower: (n,) where the lower stops are; minus infinity where there is none.
        upper: (n,) where the upper stops are.
        effort: (n,) largest efforts at the joints.
        drive_effort: (n,) largest efforts of the drives where these are coupled.
    """

    arm: Arm
    controller: Controller
    brakes: tuple[Brake, ...]
    lower: Array
    upper: Array
    effort: Array
    drive_effort: Array

    @cached_property
    def compiled(self) -> CompiledArm:
        """The arm's equations, compiled: they are asked for many thousands of times."""
        return compile_arm(self.arm)

    @cached_property
    def law(self) -> FrictionLaw:
        """The friction of its drives."""
        return friction_law(self.arm)

    @cached_property
    def offset(self) -> Array:
        """The part of friction that does not change, (n,)."""
        return self.arm.motor_values("offset")

    @cached_property
    def break_away(self) -> tuple[Array, Array]:
        """Dry friction against motion that begins forward and backward, (n,) each, above 0."""
        rest = np.zeros(self.arm.n)
        return self.law.dry(rest, rest + 1.0), -self.law.dry(rest, rest - 1.0)

    @property
    def dry(self) -> Flags:
        """Which joints have dry friction, (n,)."""
        forward, backward = self.break_away
        return (forward > 0) | (backward > 0)

    def moment(self, t: float, q: Array, qd: Array, phase: Phase) -> Moment:
        """Return what the joints feel at one moment of a phase."""
        M, tau, friction, surplus = self._pushed(t, q, qd, phase.direction, phase.locked)
        qdd, hold = np.zeros_like(q), np.zeros_like(q)
        free = ~phase.locked
        qdd[free] = np.linalg.solve(M[np.ix_(free, free)], surplus[free])
        hold[phase.locked] = M[phase.locked] @ qdd - surplus[phase.locked]
        return Moment(qdd=qdd, tau=tau, friction=friction, hold=hold)

    def _pushed(
        self, t: float, q: Array, qd: Array, direction: Array, locked: Flags
    ) -> tuple[Array, Array, Array, Array]:
        """Return mass matrix, efforts of drives, of friction, and the remainder for acceleration."""
        M, bias = self.compiled.mass_and_bias(q, qd)
        tau = np.clip(np.asarray(self.controller(t, q, qd), dtype=np.float64), -self.effort, self.effort)
        law = self.law
        if self.arm.coupling is None:
            friction = np.where(locked, 0.0 - self.offset, -law.viscous * qd - law.beyond_viscous(qd, direction))
        else:
            # Coupled drives have no dry friction here, which alone would ask for their directions.
            most, speeds = self.drive_effort, drive_speeds(self.arm, qd)
            efforts = np.clip(self.arm.coupling.drive_efforts(tau), -most, most)
            tau = efforts_at_joints(self.arm, efforts)
            friction = -efforts_at_joints(self.arm, law.viscous * speeds + law.smooth(speeds))
        return M, tau, friction, tau + friction - bias

    def braked(self, t: float) -> Flags:
        """Return which joints have a brake on at a time, (n,)."""
        flags = np.zeros(self.arm.n, dtype=bool)
        for brake in self.brakes:
            flags[brake.joint] |= brake.on(t)
        return flags

    def begin(self, t: float, q: Array, qd: Array) -> Start:
        """Begin a phase: stops and brakes take what hits them, and it is found which joints are held.

        Args:
            t: time [s].
            q: (n,) joint positions.
            qd: (n,) joint speeds.

        Returns:
            What to go on from.
        """
        at_lower, at_upper, braked = q <= self.lower + TOUCH, q >= self.upper - TOUCH, self.braked(t)
        q = np.where(at_lower, self.lower, np.where(at_upper, self.upper, q))
        hit = ((at_lower | braked) & (qd < -STILL)) | ((at_upper | braked) & (qd > STILL))
        loss = 0.0
        if hit.any():
            qd, loss = self._collide(q, qd, at_lower | braked, at_upper | braked)
        touched = at_lower | at_upper | braked
        at_rest = (touched | self.dry) & (np.abs(qd) <= 10 * STILL)
        qd = np.where(at_rest, 0.0, qd)
        lower = np.where(at_upper | braked, -np.inf, -self.break_away[0])
        upper = np.where(at_lower | braked, np.inf, self.break_away[1])
        M, _, _, surplus = self._pushed(t, q, qd, np.where(at_rest, 0.0, np.sign(qd)), at_rest)
        direction = solve_complementarity(M, surplus, at_rest, lower, upper).direction
        locked = at_rest & (direction == 0)
        state = np.where(
            braked,
            JointState.BRAKED,
            np.where(at_lower, JointState.LOWER_STOP, np.where(at_upper, JointState.UPPER_STOP, JointState.STICKS)),
        )
        phase = Phase(
            locked=locked,
            direction=np.where(at_rest, direction, np.sign(qd)).astype(np.float64),
            lower=lower,
            upper=upper,
            state=np.where(locked, state, JointState.MOVES).astype(np.int8),
        )
        collided = np.where(hit, state, JointState.MOVES).astype(np.int8)
        return Start(q=q, qd=qd, phase=phase, collided=collided, loss=loss)

    def _collide(self, q: Array, qd: Array, from_below: Flags, from_above: Flags) -> tuple[Array, float]:
        """Return speeds after impacts that leave no speed against a stop or under a brake, and the energy lost."""
        M, _ = self.compiled.mass_and_bias(q, qd)
        lower, upper = np.where(from_above, -np.inf, 0.0), np.where(from_below, np.inf, 0.0)
        after = solve_complementarity(M, M @ qd, from_below | from_above, lower, upper).x
        return after, float(qd @ M @ qd - after @ M @ after) / 2

    def watch(self, t: float, q: Array, qd: Array, phase: Phase) -> float:
        """Return how far the nearest event is, in units of what counts as nothing; below 0 behind it."""
        moving = ~phase.locked
        slides = moving & self.dry & (phase.direction != 0)
        below, above = moving & np.isfinite(self.lower), moving & np.isfinite(self.upper)
        distances = [(phase.direction * qd)[slides] / STILL + 1]
        distances += [(q - self.lower)[below] / TOUCH + 1, (self.upper - q)[above] / TOUCH + 1]
        if (phase.locked & (phase.state != JointState.BRAKED)).any():
            hold = self.moment(t, q, qd, phase).hold
            for bound, side in ((phase.lower, 1.0), (phase.upper, -1.0)):
                limited = phase.locked & np.isfinite(bound)
                spare = side * (hold - bound)[limited]
                distances.append(spare / (_OVER * (1 + np.abs(bound[limited]))) + 1)
        return min((float(x.min()) for x in distances if x.size), default=math.inf)
