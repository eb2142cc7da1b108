from .scalar import (
    atan2 as atan2,
    cbrt as cbrt,
    cos as cos,
    exp as exp,
    round_half_even as round_half_even,
    select as select,
    sin as sin,
    sqrt as sqrt,
)
