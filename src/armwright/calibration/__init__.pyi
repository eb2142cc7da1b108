from .compensation import CalibratedInverse as CalibratedInverse, inverse_calibrated as inverse_calibrated
from .correction import corrected_arm as corrected_arm, position_covariance as position_covariance
from .cross_validation import cross_validate as cross_validate
from .experiment_design import (
    MeasurementPlan as MeasurementPlan,
    Observability as Observability,
    observability as observability,
    plan_poses as plan_poses,
)
from .fitting import Calibration as Calibration, calibrate as calibrate, calibrate_points as calibrate_points
from .identifiability import Identifiability as Identifiability, select_identifiable as select_identifiable
from .measurements import Measurements as Measurements, read_measurements as read_measurements
from .nongeometric import (
    NongeometricCalibration as NongeometricCalibration,
    calibrate_nongeometric as calibrate_nongeometric,
)
from .readings import Readings as Readings
