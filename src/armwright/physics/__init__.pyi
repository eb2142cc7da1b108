from .clearance import ClearanceChecker as ClearanceChecker
from .servo import Reference as Reference, TorqueLaw as TorqueLaw
from .world import PhysicsCell as PhysicsCell
