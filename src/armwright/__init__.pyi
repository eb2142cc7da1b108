from . import (
    accuracy as accuracy,
    arm as arm,
    calibration as calibration,
    cell as cell,
    clearance as clearance,
    compiled as compiled,
    dynamics as dynamics,
    export as export,
    identification as identification,
    kinematics as kinematics,
    motion as motion,
    physics as physics,
    program as program,
    reliability as reliability,
    simulation as simulation,
    spatial as spatial,
    studio as studio,
    study as study,
    sweep as sweep,
    tracing as tracing,
)
from .arm.load import arm_names as arm_names, load_arm as load_arm
from .arm.model import Arm as Arm
from .arm.urdf.reader import load_urdf as load_urdf
from .compiled.arm import CompiledArm as CompiledArm, compile_arm as compile_arm
from .errors import ArmwrightError as ArmwrightError
from .motion.trajectory import Trajectory as Trajectory
from .studio.widget import show as show
from .version import __version__ as __version__
