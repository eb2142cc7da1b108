from .assessment import (
    assess as assess,
    Assessment as Assessment,
)
from .compliance import (
    static_compliance as static_compliance,
    StaticCompliance as StaticCompliance,
)
from .corner import (
    corner_deviations as corner_deviations,
    CornerDeviation as CornerDeviation,
)
from .distance import (
    distance_accuracy as distance_accuracy,
    distance_repeatability as distance_repeatability,
    DistanceAccuracy as DistanceAccuracy,
    DistanceRepeatability as DistanceRepeatability,
)
from .measurement_file import (
    PathTest as PathTest,
    PoseTest as PoseTest,
    read_measurements as read_measurements,
)
from .path import (
    path_deviation as path_deviation,
    path_velocity as path_velocity,
    PathDeviation as PathDeviation,
    PathVelocity as PathVelocity,
)
from .pose import (
    pose_accuracy as pose_accuracy,
    pose_repeatability as pose_repeatability,
    PoseAccuracy as PoseAccuracy,
    PoseRepeatability as PoseRepeatability,
)
from .settling_time import (
    posing_time as posing_time,
    PosingTime as PosingTime,
    Settling as Settling,
    settling as settling,
)
from .trace import (
    Trace as Trace,
)
from .variation import (
    exchangeability as exchangeability,
    multidirectional_variation as multidirectional_variation,
    pose_drift as pose_drift,
    PoseDrift as PoseDrift,
    Variation as Variation,
)
from .weaving import (
    weaving_deviation as weaving_deviation,
    WeavingDeviation as WeavingDeviation,
)
