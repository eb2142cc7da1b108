from .arm_readings import ArmAccuracy as ArmAccuracy, ArmReadings as ArmReadings
from .board import Board as Board, BoardView as BoardView, BoardViews as BoardViews, board_views as board_views
from .board_detection import board_finder as board_finder, views_of_pictures as views_of_pictures
from .camera_calibration import CameraCalibration as CameraCalibration, calibrate_camera as calibrate_camera
from .camera_intrinsics import CameraIntrinsics as CameraIntrinsics, calibrate_intrinsics as calibrate_intrinsics
from .camera_tables import (
    read_corners as read_corners,
    read_lens as read_lens,
    read_picture_joints as read_picture_joints,
)
from .compensation import CalibratedInverse as CalibratedInverse, inverse_calibrated as inverse_calibrated
from .correction import (
    corrected_arm as corrected_arm,
    position_covariance as position_covariance,
    robot_files as robot_files,
)
from .cross_validation import cross_validate as cross_validate
from .experiment_design import (
    MeasurementPlan as MeasurementPlan,
    Observability as Observability,
    observability as observability,
    plan_poses as plan_poses,
)
from .fitting import Calibration as Calibration, calibrate as calibrate, calibrate_points as calibrate_points
from .hand_eye import HandEyeCalibration as HandEyeCalibration, calibrate_hand_eye as calibrate_hand_eye
from .identifiability import Identifiability as Identifiability, select_identifiable as select_identifiable
from .joint_errors import identified_compliance as identified_compliance
from .measurements import Measurements as Measurements, read_measurements as read_measurements
from .nongeometric import (
    NongeometricCalibration as NongeometricCalibration,
    calibrate_nongeometric as calibrate_nongeometric,
)
from .readings import Readings as Readings
