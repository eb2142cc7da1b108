"""The springs at the joints, over abstract scalars: efforts and energy by the positions alone."""

from __future__ import annotations

from armwright.arm.model import Arm
from armwright.dynamics.arguments import Scalars
from armwright.tracing.scalar import Scalar


def with_springs(arm: Arm, efforts: Scalars, q: Scalars) -> list[Scalar]:
    """Return efforts and what the springs require beside them; the same where there are none."""
    sprung = zip(efforts, spring_efforts(arm, q), strict=True)
    return [effort if spring is None else effort + spring for effort, spring in sprung]


def less_springs(arm: Arm, tau: Scalars, q: Scalars) -> list[Scalar]:
    """Return the efforts less what the springs take; the same where there are none."""
    sprung = zip(tau, spring_efforts(arm, q), strict=True)
    return [effort if spring is None else effort - spring for effort, spring in sprung]


def spring_efforts(arm: Arm, q: Scalars) -> list[Scalar | None]:
    """Return the efforts that hold the springs at positions q; None for a joint without a spring."""
    springs = [joint.spring for joint in arm.joints]
    return [
        spring.stiffness * (position - spring.rest) if spring.stiffness else None
        for spring, position in zip(springs, q, strict=True)
    ]


def spring_energy(arm: Arm, q: Scalars) -> Scalar:
    """Return the energy in the springs; 0.0 where there are none."""
    energy: Scalar = 0.0
    for joint, position in zip(arm.joints, q, strict=True):
        if joint.spring.stiffness:
            strain = position - joint.spring.rest
            energy = energy + 0.5 * joint.spring.stiffness * (strain * strain)
    return energy
