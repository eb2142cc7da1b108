from .constructors import pose as pose
from .euler import from_zyz as from_zyz, to_rpy as to_rpy, to_zyz as to_zyz
from .poses import (
    between as between,
    from_noap as from_noap,
    homogeneous as homogeneous,
    inverse as inverse,
    to_noap as to_noap,
)
from .rotations import (
    angle_between as angle_between,
    nearest_rotation as nearest_rotation,
    orthonormality_error as orthonormality_error,
    rotation_from_quaternion as rotation_from_quaternion,
    rotation_from_vector as rotation_from_vector,
    rotation_vector as rotation_vector,
)
