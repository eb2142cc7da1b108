"""How the arms of a cell are driven and sensed where the cell is simulated with physics."""

from __future__ import annotations

from typing import Literal, TypeAlias

import attrs

Law: TypeAlias = Literal["computed torque", "pd"]


@attrs.frozen(kw_only=True)
class Servo:
    """The controller of the joints of an arm.

    Attributes:
        bandwidth: natural frequency of the errors of each joint [rad/s].
        integral: whether errors that stay are integrated.
        knows_parts: whether the controller knows of a held part: its mass as the cell file has it.
        law: ``computed torque`` with the model of the arm, or ``pd`` with the weight of the arm taken off.
    """

    bandwidth: float = 50.0
    integral: bool = True
    knows_parts: bool = True
    law: Law = "computed torque"


@attrs.frozen(kw_only=True)
class Sensors:
    """What an arm's controller knows of its joints.

    Attributes:
        counts: of the encoder per revolution of the motor, or per metre before the gear of a prismatic joint; 0 for
            exact positions.
        effort_noise: standard deviation of measured efforts, by the largest effort of each joint.
        delay: of all readings [servo ticks].
    """

    counts: float = 0.0
    effort_noise: float = 0.0
    delay: int = 0

    @property
    def exact(self) -> bool:
        """Whether positions and speeds are known as they are, at once."""
        return self.counts == 0 and self.delay == 0


@attrs.frozen(kw_only=True)
class ForceSensor:
    """The sensor of forces and moments between an arm and its tool.

    Attributes:
        noise: standard deviation of each force [N].
        bias: constant error of each force [N].
        moment_noise: standard deviation of each moment [N m].
        moment_bias: constant error of each moment [N m].
        rate: readings per second [1/s]; 0 for one at every servo tick.
    """

    noise: float = 0.0
    bias: float = 0.0
    moment_noise: float = 0.0
    moment_bias: float = 0.0
    rate: float = 0.0


@attrs.frozen(kw_only=True)
class Alarms:
    """What stops a program in a cell with physics.

    Attributes:
        touch: force with which an arm may press on what it should not [N].
        tracking_angle: how far a revolute joint may be from where it was sent [rad].
        tracking_length: how far a prismatic joint may be [m].
        slip: how far a part may move in the gripper [m].
    """

    touch: float = 20.0
    tracking_angle: float = 0.017453292519943295
    tracking_length: float = 0.01
    slip: float = 5e-3
