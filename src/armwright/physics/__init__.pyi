from .clearance import ClearanceChecker as ClearanceChecker
from .mjcf import MjcfFile as MjcfFile, arm_mjcf as arm_mjcf, cell_mjcf as cell_mjcf
from .mjcf_cell import CellReading as CellReading, read_cell_mjcf as read_cell_mjcf
from .servo import Reference as Reference, TorqueLaw as TorqueLaw
from .world import PhysicsCell as PhysicsCell
