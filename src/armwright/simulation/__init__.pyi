from .controllers import (
    Controller as Controller,
    computed_torque as computed_torque,
    gravity_compensation as gravity_compensation,
    no_effort as no_effort,
    pd as pd,
    pd_with_gravity as pd_with_gravity,
)
from .flexible_joints import (
    FlexibleSimulation as FlexibleSimulation,
    simulate_flexible as simulate_flexible,
)
from .integrators import Adaptive as Adaptive, Gill as Gill
from .plant import Plant as Plant
from .result import Event as Event, JointState as JointState, Simulation as Simulation, Status as Status
from .simulator import simulate as simulate
