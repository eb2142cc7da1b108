from .compensation import (
    CalibratedInverse as CalibratedInverse,
)
from .compensation import (
    inverse_calibrated as inverse_calibrated,
)
from .correction import (
    corrected_arm as corrected_arm,
)
from .correction import (
    position_covariance as position_covariance,
)
from .cross_validation import (
    cross_validate as cross_validate,
)
from .experiment_design import (
    MeasurementPlan as MeasurementPlan,
)
from .experiment_design import (
    Observability as Observability,
)
from .experiment_design import (
    observability as observability,
)
from .experiment_design import (
    plan_poses as plan_poses,
)
from .fitting import (
    Calibration as Calibration,
)
from .fitting import (
    calibrate as calibrate,
)
from .fitting import (
    calibrate_points as calibrate_points,
)
from .identifiability import (
    Identifiability as Identifiability,
)
from .identifiability import (
    select_identifiable as select_identifiable,
)
from .measurements import (
    Measurements as Measurements,
)
from .measurements import (
    read_measurements as read_measurements,
)
from .nongeometric import (
    NongeometricCalibration as NongeometricCalibration,
)
from .nongeometric import (
    calibrate_nongeometric as calibrate_nongeometric,
)
from .readings import (
    Readings as Readings,
)
