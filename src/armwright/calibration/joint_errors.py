"""Error models of joints: compliance about three axes under gravity, and the transmission error of gears."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from armwright.arm.model import Arm
from armwright.arm.positions import ranges
from armwright.arrays import Array
from armwright.calibration.chain import JointErrorModel
from armwright.calibration.fitting import Calibration
from armwright.dynamics.static_deflection import joint_loads

# Configurations over which the largest load of gravity is looked for.
_SAMPLES = 500
# Loads below this part of the arm's largest deflect no joint measurably.
_NEGLIGIBLE = 1e-3
# For so many sets of configurations loads are cached.
_CACHED = 8
# Names of the coefficients by axis: x and y of the frame of a joint are lateral, z is its own.
_COEFFICIENTS = ("sag_x", "sag_y", "sag")


def compliances(arm: Arm) -> tuple[JointErrorModel, ...]:
    """Return a model for each joint that gravity loads: its deflection under the largest effort that gravity makes.

    That effort divided by the deflection is the stiffness of the joint: ``largest_gravity_loads``. There are none
    where the arm has no masses, or not all are known.

    Source:
        Judd & Knasinski (1990); Dumas et al. (2011).
    """
    return _compliances(arm, (2,))


def lateral_compliances(arm: Arm) -> tuple[JointErrorModel, ...]:
    """Return two models for each joint that gravity bends: rotations about x and y of its frame on the link before it.

    They are the deflections of bearing and link under the largest moments that gravity makes about these axes. The
    loads are those of the rigid arm: a deflection of 1 mrad alters them by about 0.1 %.
    """
    return _compliances(arm, (0, 1))


def _compliances(arm: Arm, axes: tuple[int, ...]) -> tuple[JointErrorModel, ...]:
    if any(link.unknown for link in arm.links):
        return ()
    largest = largest_gravity_loads(arm)

    # A fit asks for the same configurations again and again, and every joint for the loads of all.
    @lru_cache(maxsize=_CACHED)
    def loads(q: bytes, payload: bytes) -> Array:
        masses = np.frombuffer(payload).reshape(-1, 4)
        return joint_loads(arm, np.frombuffer(q).reshape(-1, arm.n), payload=masses)

    def compliance(joint: int, axis: int) -> JointErrorModel:
        def law(q: Array, payload: Array) -> Array:
            return np.asarray(loads(q.tobytes(), payload.tobytes())[:, joint, axis] / largest[joint, axis])

        return JointErrorModel(f"joint{joint + 1}.{_COEFFICIENTS[axis]}", joint, law, axis)

    threshold = _NEGLIGIBLE * largest[:, axes].max()
    return tuple(compliance(i, axis) for i in range(arm.n) for axis in axes if largest[i, axis] > threshold)


def largest_gravity_loads(arm: Arm) -> Array:
    """Return (n, 3) the largest load of gravity about x, y and z of each joint in many configurations [N m] or [N]."""
    lower, upper = ranges(arm)
    q = lower + (upper - lower) * np.random.default_rng(0).random((_SAMPLES, arm.n))
    return np.asarray(np.abs(joint_loads(arm, q)).max(axis=0), dtype=np.float64)


def identified_compliance(calibration: Calibration) -> Array:
    """Return (n, 3) the compliance about x, y and z of each joint that a calibration has fitted [rad/(N m)], [m/N].

    It is 0 where none was fitted. One below 0 is no spring: it is within its error, or another error is in it.
    """
    chain = calibration.chain
    compliance, largest = np.zeros((chain.arm.n, 3)), largest_gravity_loads(chain.arm)
    values = dict(zip(chain.names, calibration.arm_errors.tolist(), strict=True))
    for name, joint, _, axis in chain.joint_errors:
        if name.endswith(f".{_COEFFICIENTS[axis]}"):
            compliance[joint, axis] = values[name] / largest[joint, axis]
    return compliance


def transmission_errors(arm: Arm, order: int) -> tuple[JointErrorModel, ...]:
    """Return two models for each revolute joint: sine and cosine of the ``order``-th harmonic of its transmission.

    Source:
        Whitney, Lozinski, Rourke (1986).
    """

    def harmonic(joint: int, kind: str) -> JointErrorModel:
        function = np.sin if kind == "sin" else np.cos

        def law(q: Array, _: Array) -> Array:
            return np.asarray(function(order * q[:, joint]), dtype=np.float64)

        return JointErrorModel(f"joint{joint + 1}.{kind}{order}", joint, law)

    return tuple(harmonic(i, kind) for i, joint in enumerate(arm.joints) if joint.revolute for kind in ("sin", "cos"))
