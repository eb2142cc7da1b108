"""Joints that are not where their encoders say: they give under gravity, or their gears run out of true."""

from functools import lru_cache

import numpy as np

from armwright.arm.model import Arm
from armwright.arm.positions import ranges
from armwright.arrays import Array
from armwright.calibration.chain import JointErrorModel
from armwright.dynamics.shares import gravity_efforts

# Postures over which the largest effort of gravity is looked for.
_LOOKS = 500
# Efforts below this part of the arm's largest bend nothing that could be measured.
_SLIGHT = 1e-3
# For so many sets of postures efforts are kept.
_KEPT = 8


def compliances(arm: Arm) -> tuple[JointErrorModel, ...]:
    """Return a bend for each joint that gravity loads: how far it gives under the largest effort that gravity makes.

    That effort by the bend is the stiffness of the joint: ``largest_gravity_efforts``. There are none where the arm has
    no masses, or not all are known.

    Source:
        Judd & Knasinski (1990); Dumas et al. (2011).
    """
    if any(link.unknown for link in arm.links):
        return ()
    largest = largest_gravity_efforts(arm)

    # A fit asks for the same postures again and again, and every joint for the efforts of all.
    @lru_cache(maxsize=_KEPT)
    def efforts(q: bytes) -> Array:
        return gravity_efforts(arm, np.frombuffer(q).reshape(-1, arm.n))

    def spring(joint: int) -> JointErrorModel:
        def law(q: Array) -> Array:
            return np.asarray(-efforts(q.tobytes())[:, joint] / largest[joint], dtype=np.float64)

        return JointErrorModel(f"joint{joint + 1}.sag", joint, law)

    return tuple(spring(i) for i in range(arm.n) if largest[i] > _SLIGHT * largest.max() > 0)


def largest_gravity_efforts(arm: Arm) -> Array:
    """Return (n,) the largest effort of gravity that each joint meets in many postures [N m] or [N]."""
    lower, upper = ranges(arm)
    q = lower + (upper - lower) * np.random.default_rng(0).random((_LOOKS, arm.n))
    return np.asarray(np.abs(gravity_efforts(arm, q)).max(axis=0), dtype=np.float64)


def transmission_errors(arm: Arm, order: int) -> tuple[JointErrorModel, ...]:
    """Return two bends for each turning joint, the sine and cosine of what comes back ``order`` times a turn.

    Source:
        Whitney, Lozinski, Rourke (1986).
    """

    def wave(joint: int, kind: str) -> JointErrorModel:
        of = np.sin if kind == "sin" else np.cos

        def law(q: Array) -> Array:
            return np.asarray(of(order * q[:, joint]), dtype=np.float64)

        return JointErrorModel(f"joint{joint + 1}.{kind}{order}", joint, law)

    return tuple(wave(i, kind) for i, joint in enumerate(arm.joints) if joint.revolute for kind in ("sin", "cos"))
