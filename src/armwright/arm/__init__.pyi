from .collision_pairs import CollisionPairs as CollisionPairs
from .coupling import Coupling as Coupling
from .drive import Motor as Motor, Spring as Spring
from .limits import Limits as Limits
from .load import arm_names as arm_names, load_arm as load_arm
from .mjcf.reader import load_mjcf as load_mjcf
from .model import Arm as Arm, Joint as Joint, Link as Link
from .uncertainty import Uncertainty as Uncertainty
from .universal_robots.calibrated_arm import calibrated_arm as calibrated_arm
from .universal_robots.calibration_conf import calibration_conf as calibration_conf
from .universal_robots.kinematics_yaml import kinematics_yaml as kinematics_yaml
from .urdf.reader import load_urdf as load_urdf
from .urdf.writer import urdf_text as urdf_text
from .write import toml_text as toml_text
