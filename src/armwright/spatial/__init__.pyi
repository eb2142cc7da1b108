from .constructors import (
    pose as pose,
)
from .euler import (
    from_zyz as from_zyz,
)
from .euler import (
    to_rpy as to_rpy,
)
from .euler import (
    to_zyz as to_zyz,
)
from .poses import (
    between as between,
)
from .poses import (
    from_noap as from_noap,
)
from .poses import (
    homogeneous as homogeneous,
)
from .poses import (
    inverse as inverse,
)
from .poses import (
    to_noap as to_noap,
)
from .rotations import (
    angle_between as angle_between,
)
from .rotations import (
    nearest_rotation as nearest_rotation,
)
from .rotations import (
    orthonormality_error as orthonormality_error,
)
from .rotations import (
    rotation_from_quaternion as rotation_from_quaternion,
)
from .rotations import (
    rotation_from_vector as rotation_from_vector,
)
from .rotations import (
    rotation_vector as rotation_vector,
)
