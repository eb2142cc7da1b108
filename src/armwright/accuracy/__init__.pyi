from .assessment import Assessment as Assessment, assess as assess
from .compliance import StaticCompliance as StaticCompliance, static_compliance as static_compliance
from .corner import CornerDeviation as CornerDeviation, corner_deviations as corner_deviations
from .distance import (
    DistanceAccuracy as DistanceAccuracy,
    DistanceRepeatability as DistanceRepeatability,
    distance_accuracy as distance_accuracy,
    distance_repeatability as distance_repeatability,
)
from .measurement_file import PathTest as PathTest, PoseTest as PoseTest, read_measurements as read_measurements
from .path import (
    PathDeviation as PathDeviation,
    PathVelocity as PathVelocity,
    path_deviation as path_deviation,
    path_velocity as path_velocity,
)
from .pose import (
    PoseAccuracy as PoseAccuracy,
    PoseRepeatability as PoseRepeatability,
    pose_accuracy as pose_accuracy,
    pose_repeatability as pose_repeatability,
)
from .settling_time import (
    PosingTime as PosingTime,
    Settling as Settling,
    posing_time as posing_time,
    settling as settling,
)
from .trace import Trace as Trace
from .variation import (
    PoseDrift as PoseDrift,
    Variation as Variation,
    exchangeability as exchangeability,
    multidirectional_variation as multidirectional_variation,
    pose_drift as pose_drift,
)
from .weaving import WeavingDeviation as WeavingDeviation, weaving_deviation as weaving_deviation
