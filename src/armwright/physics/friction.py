"""Friction of drives in a world of MuJoCo: what the numbers of its joints do not hold, set anew before every step.

Drives that do not move as joints do are tendons there, which have the same numbers.

MuJoCo has a viscous friction, and a dry one that is the same in both directions and at every speed; the rest is

- a constant effort, for an offset and for dry friction that differs between the directions,
- for Stribeck friction, a dry friction by the speed at the beginning of a step: a constraint of MuJoCo, which holds a
  joint at rest up to its break-away effort. As an effort by the sign of the speed it would chatter there.
- for friction by the cube root of the speed, a viscous one that is as large at the speed at the beginning of a step.
  MuJoCo integrates it implicitly, so that its steep rise at rest is stable.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.dynamics.drives import SLOW, drive_speeds, efforts_at_joints, friction_law
from armwright.physics.plant import ArmIndices


def dry_offsets(arm: Arm) -> Array:
    """Return the constant efforts (n,) of the drives that make two-sided dry friction of friction alike both ways."""
    return (arm.motor_values("coulomb_backward") - arm.motor_values("coulomb_forward")) / 2


def constant_efforts(arm: Arm) -> Array:
    """Return the constant efforts (n,) of friction on the joints: those of ``dry_offsets``, and the offset."""
    return efforts_at_joints(arm, dry_offsets(arm) - arm.motor_values("offset"))


class SpeedFriction:
    """The friction of an arm that depends on the speed, beyond what is in proportion to it."""

    def __init__(self, arm: Arm, indices: ArmIndices) -> None:
        """Take the arm that stands in a world, and where it is in the arrays of that."""
        self._arm, self._law, self._speeds = arm, friction_law(arm), indices.speeds
        # Which drives are joints of the world, and which are tendons of it, and their numbers there.
        self._at_joints, self._tendons = indices.tendons < 0, indices.tendons[indices.tendons >= 0]
        self._dry = (arm.motor_values("coulomb_forward") + arm.motor_values("coulomb_backward")) / 2

    @property
    def is_there(self) -> bool:
        """Whether the arm has any."""
        return self._law.stribeck is not None or self._law.cube_root is not None

    def set(self, model: Any, data: Any) -> None:
        """Set the friction of the joints in a world for its next step."""
        law, speed = self._law, np.abs(drive_speeds(self._arm, data.qvel[self._speeds]))
        if (fading := law.fading(speed)) is not None:
            self._spread(model.dof_frictionloss, model.tendon_frictionloss, self._dry + fading)
        if law.cube_root is not None:
            viscous = law.viscous + law.cube_root * np.maximum(speed, SLOW) ** (-2 / 3)
            self._spread(model.dof_damping, model.tendon_damping, viscous)

    def _spread(self, of_joints: Array, of_tendons: Array, values: Array) -> None:
        """Set values (n,) of the drives in the arrays of a world."""
        if len(self._tendons):
            of_joints[self._speeds[self._at_joints]] = values[self._at_joints]
            of_tendons[self._tendons] = values[~self._at_joints]
        else:
            of_joints[self._speeds] = values
