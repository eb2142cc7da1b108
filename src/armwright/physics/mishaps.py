"""What goes wrong in a world between the statements of a program, in words.

R603: fingers closed on nothing. R604: an arm presses on what it should not. R605: a held part is lost.
R606: an arm deviates from its motion. R607: the world has become unstable.
"""

from __future__ import annotations

import math

from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.cell.hardware import Mishap
from armwright.physics.contacts import Touch

_LOOK_AGAIN = "look again before the MOVE to it: put both in a TRY, and RETRY after opening and moving away"


def closed_on_nothing(time: float, arm: str, part: str, distance: float) -> Mishap:
    """Return the mishap of fingers that close on nothing, while the part is a distance away [m]."""
    return Mishap(
        time=time,
        arm=arm,
        code="R603",
        message=f"{arm} closed on nothing: {part} is {distance * 1e3:.3g} mm away",
        label="the gripper closes here",
        helps=(_LOOK_AGAIN,),
    )


def touched(time: float, touch: Touch) -> Mishap:
    """Return the mishap of an arm that presses on something."""
    return Mishap(
        time=time,
        arm=touch.arm,
        code="R604",
        message=f"{touch.what} hits {touch.other} with {touch.force:.3g} N",
        label=f"{touch.arm} was under way here",
        helps=("approach from where nothing is in the way, or end the MOVE by force: `ON FORCE(Z) > 10 DO HALT`",),
    )


def lost(time: float, arm: str, part: str, holds: float, mass: float) -> Mishap:
    """Return the mishap of a part that has left the gripper.

    Args:
        time: when [s].
        arm: that held it.
        part: its name.
        holds: the mass that the gripper holds at rest [kg].
        mass: of the part [kg].
    """
    too_heavy = mass > holds
    cause = f"at rest its gripper holds {holds:.3g} kg of such a surface, and {part} has {mass:.3g} kg"
    advice = "a larger force_N or friction of the gripper holds it" if too_heavy else "a lower speed jerks less"
    return Mishap(
        time=time,
        arm=arm,
        code="R605",
        message=f"{arm} has lost {part}",
        label="it was in the hand here",
        helps=(f"{cause}: {advice}",),
    )


def off_track(time: float, arm: str, model: Arm, error: Array, limits: Array) -> Mishap:
    """Return the mishap of joints that are farther than the limits from their planned positions, (n,) each."""
    joint = int((error / limits).argmax())
    revolute = model.joints[joint].revolute
    amount = f"{math.degrees(error[joint]):.3g} deg" if revolute else f"{error[joint] * 1e3:.3g} mm"
    return Mishap(
        time=time,
        arm=arm,
        code="R606",
        message=f"{arm} does not follow its motion: {model.joint_label(joint)} is {amount} off",
        label=f"{arm} was under way here",
        helps=("use a lower speed, a lighter load, or check what blocks the arm",),
    )


def pressed_too_deep(time: float, arm: str, depth: float, allowed: float) -> Mishap:
    """Return the mishap of an arm that presses into the plane of contact deeper than the cell allows [m]."""
    return Mishap(
        time=time,
        arm=arm,
        code="E404",
        message=f"{arm} presses {depth * 1e3:.3g} mm deep into the plane, more than {allowed * 1e3:g} mm",
        label="this MOVE is stopped there",
        helps=("end the MOVE at a smaller force, or use a lower speed",),
    )


def unstable(time: float) -> Mishap:
    """Return the mishap of a world whose numbers have no meaning any more."""
    return Mishap(
        time=time,
        arm=None,
        code="R607",
        message="the simulated world has become unstable, and its numbers have no meaning any more",
        label="it happened here",
        helps=("check masses and stiffnesses of the cell file, or use a shorter servo_ms",),
    )
