from .hardware import DeviceError as DeviceError, Hardware as Hardware
from .model import Cell as Cell, CellArm as CellArm, ContactPlane as ContactPlane, JointTarget as JointTarget
from .reader import read_cell as read_cell
from .simulator import Simulator as Simulator
