"""What the controller and the drives of a real cell are connected to: outputs of devices, encoders of joints."""

import attrs

from armwright.arrays import Array, read_only


@attrs.frozen(kw_only=True)
class Output:
    """A digital output of a controller.

    Attributes:
        number: by which most controllers know it; None where only its name is known.
        signal: the name by which others know it; None where only its number is known.
    """

    number: int | None = None
    signal: str | None = None


@attrs.frozen(kw_only=True, eq=False)
class Encoders:
    """How drives count the positions of the joints of an arm.

    Attributes:
        counts: (n,) per revolution of a joint, its gear included, or per metre of a prismatic one.
        offset: (n,) counts at position zero.
        signs: (n,) 1 where a drive counts up with its joint, else -1.
        period: at which the drives take positions [s]; None for that of the servo.
    """

    counts: Array = attrs.field(converter=read_only)
    offset: Array = attrs.field(converter=read_only)
    signs: Array = attrs.field(converter=read_only)
    period: float | None = None
