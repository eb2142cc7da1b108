from .controllers import (
    Controller as Controller,
)
from .controllers import (
    computed_torque as computed_torque,
)
from .controllers import (
    gravity_compensation as gravity_compensation,
)
from .controllers import (
    no_effort as no_effort,
)
from .controllers import (
    pd as pd,
)
from .controllers import (
    pd_with_gravity as pd_with_gravity,
)
from .integrators import (
    Adaptive as Adaptive,
)
from .integrators import (
    Gill as Gill,
)
from .plant import (
    Plant as Plant,
)
from .result import (
    Event as Event,
)
from .result import (
    JointState as JointState,
)
from .result import (
    Simulation as Simulation,
)
from .result import (
    Status as Status,
)
from .time_stepping import (
    simulate as simulate,
)
