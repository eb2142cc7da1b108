"""Real controllers: how they count joints, and the outputs and encoders that they are connected to."""

import attrs

from armwright.arrays import Array, read_only


@attrs.frozen(kw_only=True)
class Output:
    """A digital output of a controller, or an input.

    Attributes:
        number: by which most controllers know it; None where only its name is known.
        signal: the name by which others know it; None where only its number is known.
    """

    number: int | None = None
    signal: str | None = None


@attrs.frozen(kw_only=True)
class Device:
    """A device of a cell, which programs operate.

    Attributes:
        output: of a controller that switches it; None where none is known.
        analogue: whether it can be set to any number, and not only on and off.
    """

    output: Output | None = None
    analogue: bool = False


@attrs.frozen(kw_only=True, eq=False)
class Encoders:
    """How drives count their positions behind the gears: those of the joints, where no drives are coupled.

    Attributes:
        counts: (n,) per revolution of a joint, its gear included, or per metre of a prismatic one; of coupled drives
            per revolution or metre of the drive behind its gear.
        offset: (n,) counts at position zero.
        signs: (n,) 1 where a drive counts up with its joint, else -1.
        period: at which the drives take positions [s]; None for that of the servo.
    """

    counts: Array = attrs.field(converter=read_only)
    offset: Array = attrs.field(converter=read_only)
    signs: Array = attrs.field(converter=read_only)
    period: float | None = None


@attrs.frozen(kw_only=True, eq=False)
class Controller:
    """What is known of the real controller of an arm.

    Attributes:
        convention: name of how it counts joints and where its frames stand; None for that which lists the arm.
        gripper_output: the output that closes the gripper; None where none is named.
        encoders: of the drives; None where nothing is known of them.
    """

    convention: str | None = None
    gripper_output: Output | None = None
    encoders: Encoders | None = None
