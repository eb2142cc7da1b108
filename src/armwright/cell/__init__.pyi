from .hardware import (
    DeviceError as DeviceError,
)
from .hardware import (
    Hardware as Hardware,
)
from .model import (
    Cell as Cell,
)
from .model import (
    CellArm as CellArm,
)
from .reader import (
    read_cell as read_cell,
)
from .simulator import (
    Simulator as Simulator,
)
