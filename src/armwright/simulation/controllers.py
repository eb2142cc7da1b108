"""Controllers: what the drives do at a moment, given where the arm is."""

from __future__ import annotations

from collections.abc import Callable
from typing import Concatenate, ParamSpec, Protocol, TypeAlias

import numpy as np

from armwright.arm.model import Arm
from armwright.arm.positions import known_arm
from armwright.arrays import LARGEST, Array, ArrayLike, floats, one_or_each
from armwright.dynamics.arguments import weighed
from armwright.dynamics.drives import drive_speeds, efforts_at_joints, friction_law
from armwright.dynamics.newton_euler import newton_euler
from armwright.dynamics.shares import gravity_shares
from armwright.dynamics.springs import with_springs
from armwright.errors import InvalidValueError, KindError, ShapeError, shown

# Where the arm should be: (n,) positions at a time, or their derivative of an order 1 or 2. A trajectory is one.
Reference: TypeAlias = Callable[[float, int], Array]
_Rest = ParamSpec("_Rest")


class Controller(Protocol):
    """Anything that can be called for the efforts of the drives."""

    def __call__(self, t: float, q: Array, qd: Array, /) -> ArrayLike:
        """Return n efforts.

        It may be asked for any moment, more than once and not in order: it must depend on its arguments only.

        Args:
            t: time [s].
            q: (n,) joint positions.
            qd: (n,) joint speeds.
        """


def returning(
    function: Callable[Concatenate[float, _Rest], ArrayLike], n: int, what: str
) -> Callable[Concatenate[float, _Rest], Array]:
    """Return a function of time that is refused at the first moment at which it does not return n numbers.

    Args:
        function: of a time and whatever else.
        n: how many numbers it must return; they may be infinite or not a number.
        what: they are, for a message.
    """

    def checked(t: float, /, *rest: _Rest.args, **named: _Rest.kwargs) -> Array:
        returned = function(t, *rest, **named)
        try:
            array = np.asarray(returned, dtype=np.float64)
        except (TypeError, ValueError) as error:
            raise KindError(f"{what} at {t:g} s: expected numbers, got {shown(returned)}") from error
        if array.shape != (n,):
            raise ShapeError(f"{what} at {t:g} s: expected shape ({n},), got {array.shape}")
        return array

    return checked


def standing(q: ArrayLike) -> Reference:
    """Return the reference of an arm that should stay at q (n,)."""
    position = floats(q, "q", LARGEST)
    position.setflags(write=False)
    zero = np.zeros_like(position)
    return lambda _t, order: zero if order else position


def no_effort(arm: Arm) -> Controller:
    """Return the controller of an arm whose drives are off."""
    zero = np.zeros(known_arm(arm).n)
    return lambda _t, _q, _qd: zero


def gravity_compensation(arm: Arm) -> Controller:
    """Return a controller that carries the weight of the arm and holds its springs, and does nothing else."""
    weighed(arm)
    return lambda _t, q, _qd: np.array(gravity_shares(arm, q.tolist()))


def pd(arm: Arm, reference: Reference, kp: ArrayLike, kd: ArrayLike) -> Controller:
    """Return a controller that pulls every joint to its reference like a spring with a damper.

    Args:
        arm: the arm, with n joints.
        reference: where it should be.
        kp: stiffness, (n,) or one for all [N m/rad] or [N/m].
        kd: damping, (n,) or one for all [N m s/rad] or [N s/m].

    Raises:
        ShapeError: ``kp`` or ``kd`` are not n long.
        InvalidValueError: a gain is negative.
    """
    stiffness, damping = _gains(arm, kp, "kp"), _gains(arm, kd, "kd")
    return lambda t, q, qd: stiffness * (reference(t, 0) - q) + damping * (reference(t, 1) - qd)


def pd_with_gravity(arm: Arm, reference: Reference, kp: ArrayLike, kd: ArrayLike) -> Controller:
    """Return a controller that carries the weight and pulls every joint to its reference.

    Args:
        arm: the arm, with n joints.
        reference: where it should be.
        kp: stiffness, (n,) or one for all [N m/rad] or [N/m].
        kd: damping, (n,) or one for all [N m s/rad] or [N s/m].

    Raises:
        ShapeError: ``kp`` or ``kd`` are not n long.
        InvalidValueError: a gain is negative.

    Source:
        Takegaki & Arimoto (1981).
    """
    weight, pull = gravity_compensation(arm), pd(arm, reference, kp, kd)
    return lambda t, q, qd: np.asarray(weight(t, q, qd)) + np.asarray(pull(t, q, qd))


def computed_torque(arm: Arm, reference: Reference, kp: ArrayLike, kd: ArrayLike) -> Controller:
    """Return a controller that makes the arm n separate double integrators and steers those.

    Rotors, springs and viscous friction count. Other friction is overcome as the reference moves: compensated by the
    measured speed, it would push a joint at rest to and fro.

    Args:
        arm: the arm as the controller knows it, with n joints.
        reference: where it should be.
        kp: acceleration per error of position, (n,) or one for all [1/s²].
        kd: acceleration per error of speed, (n,) or one for all [1/s].

    Raises:
        ShapeError: ``kp`` or ``kd`` are not n long.
        InvalidValueError: a gain is negative.

    Source:
        Luh, Walker & Paul (1980), resolved acceleration in joint space; Spong, Hutchinson & Vidyasagar (2006),
        section 8.3.
    """
    stiffness, damping = _gains(arm, kp, "kp"), _gains(arm, kd, "kd")
    inertia, law = arm.motor_values("inertia"), friction_law(arm)

    def own_efforts(acceleration: Array, speed: Array, wanted: Array) -> Array:
        return np.asarray(inertia * acceleration + law.viscous * speed + law.beyond_viscous(wanted, wanted))

    def efforts(t: float, q: Array, qd: Array) -> Array:
        speed = reference(t, 1)
        acceleration = reference(t, 2) + damping * (speed - qd) + stiffness * (reference(t, 0) - q)
        position = q.tolist()
        links = np.array(with_springs(arm, newton_euler(arm, position, qd.tolist(), acceleration.tolist()), position))
        at_drives = (drive_speeds(arm, x) for x in (acceleration, qd, speed))
        return links + efforts_at_joints(arm, np.asarray(own_efforts(*at_drives)))

    return efforts


def _gains(arm: Arm, value: ArrayLike, name: str) -> Array:
    gains = one_or_each(value, known_arm(arm).n, name, "joint")
    if (gains < 0).any():
        raise InvalidValueError(f"{name}: expected 0 or more for every joint, got {gains.tolist()}")
    return gains
