from .blends import (
    blend_timing as blend_timing,
    blended as blended,
    via_deviations as via_deviations,
    via_distances as via_distances,
)
from .certificate import Certificate as Certificate
from .certified_motion import CertifiedMotion as CertifiedMotion
from .continuity_report import Continuity as Continuity, continuity as continuity
from .controlled_stop import brake as brake
from .cubic_polynomials import cubic as cubic, cubic_through as cubic_through
from .detour import Detour as Detour, line_or_detour as line_or_detour
from .efforts import effort_peaks as effort_peaks, slowing_for_efforts as slowing_for_efforts
from .flat_feedforward import FlatMotion as FlatMotion, flat_motion as flat_motion, ninth as ninth
from .limit_utilization import limit_use as limit_use, slowing_for_limits as slowing_for_limits
from .mode_shaping import ModeShaping as ModeShaping
from .moves import (
    Move as Move,
    cartesian_move as cartesian_move,
    joint_move as joint_move,
    stopping_move as stopping_move,
)
from .obstruction import PathError as PathError
from .online import OnlineError as OnlineError, replace_goal as replace_goal, retarget as retarget
from .quintic_polynomials import point_to_point as point_to_point, quintic as quintic
from .shaping import Shaper as Shaper, combined as combined, shaped as shaped, shaper as shaper
from .smooth_move import (
    Settling as Settling,
    SmoothMove as SmoothMove,
    settling as settling,
    smooth_move as smooth_move,
)
from .straight import straight_line as straight_line
from .through import through_frames as through_frames
from .time_optimal_path import TimeOptimal as TimeOptimal, time_optimal as time_optimal
from .trajectory import Samples as Samples, Trajectory as Trajectory, hold as hold, join as join
from .trapezoidal_profile import trapezoid as trapezoid
from .xspline_online import xspline_kernel as xspline_kernel
from .xspline_path import xspline as xspline, xspline_along as xspline_along
