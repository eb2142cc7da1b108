from .assessment import (
    Assessment as Assessment,
)
from .assessment import (
    assess as assess,
)
from .compliance import (
    StaticCompliance as StaticCompliance,
)
from .compliance import (
    static_compliance as static_compliance,
)
from .corner import (
    CornerDeviation as CornerDeviation,
)
from .corner import (
    corner_deviations as corner_deviations,
)
from .distance import (
    DistanceAccuracy as DistanceAccuracy,
)
from .distance import (
    DistanceRepeatability as DistanceRepeatability,
)
from .distance import (
    distance_accuracy as distance_accuracy,
)
from .distance import (
    distance_repeatability as distance_repeatability,
)
from .measurement_file import (
    PathTest as PathTest,
)
from .measurement_file import (
    PoseTest as PoseTest,
)
from .measurement_file import (
    read_measurements as read_measurements,
)
from .path import (
    PathDeviation as PathDeviation,
)
from .path import (
    PathVelocity as PathVelocity,
)
from .path import (
    path_deviation as path_deviation,
)
from .path import (
    path_velocity as path_velocity,
)
from .pose import (
    PoseAccuracy as PoseAccuracy,
)
from .pose import (
    PoseRepeatability as PoseRepeatability,
)
from .pose import (
    pose_accuracy as pose_accuracy,
)
from .pose import (
    pose_repeatability as pose_repeatability,
)
from .settling_time import (
    PosingTime as PosingTime,
)
from .settling_time import (
    Settling as Settling,
)
from .settling_time import (
    posing_time as posing_time,
)
from .settling_time import (
    settling as settling,
)
from .trace import (
    Trace as Trace,
)
from .variation import (
    PoseDrift as PoseDrift,
)
from .variation import (
    Variation as Variation,
)
from .variation import (
    exchangeability as exchangeability,
)
from .variation import (
    multidirectional_variation as multidirectional_variation,
)
from .variation import (
    pose_drift as pose_drift,
)
from .weaving import (
    WeavingDeviation as WeavingDeviation,
)
from .weaving import (
    weaving_deviation as weaving_deviation,
)
