from .excitation import Excitation as Excitation, MotionLimits as MotionLimits, plan_excitation as plan_excitation
from .feasible import Standard as Standard, arm_of as arm_of, feasible as feasible
from .fitting import Fit as Fit, ordinary as ordinary, robust as robust, summed as summed, weighted as weighted
from .gains import Gains as Gains, drive_gains as drive_gains
from .identify import hold_out as hold_out, identify as identify
from .log import Log as Log, with_gains as with_gains
from .model import BaseParameters as BaseParameters, DynamicModel as DynamicModel
from .payload import Payload as Payload, identify_payload as identify_payload
from .reading import read_logs as read_logs
from .result import Identification as Identification, Prediction as Prediction
from .signals import Preparation as Preparation, motions as motions, preparation_of as preparation_of
from .structure import structural_count as structural_count
