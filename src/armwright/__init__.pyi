from . import (
    accuracy as accuracy,
)
from . import (
    arm as arm,
)
from . import (
    calibration as calibration,
)
from . import (
    cell as cell,
)
from . import (
    clearance as clearance,
)
from . import (
    compiled as compiled,
)
from . import (
    dynamics as dynamics,
)
from . import (
    kinematics as kinematics,
)
from . import (
    motion as motion,
)
from . import (
    program as program,
)
from . import (
    simulation as simulation,
)
from . import (
    spatial as spatial,
)
from . import (
    study as study,
)
from . import (
    sweep as sweep,
)
from .arm.load import (
    arm_names as arm_names,
)
from .arm.load import (
    load_arm as load_arm,
)
from .arm.model import Arm as Arm
from .arm.urdf.reader import load_urdf as load_urdf
from .compiled.arm import (
    CompiledArm as CompiledArm,
)
from .compiled.arm import (
    compile_arm as compile_arm,
)
from .errors import ArmwrightError as ArmwrightError
from .motion.trajectory import Trajectory as Trajectory
from .version import __version__ as __version__
