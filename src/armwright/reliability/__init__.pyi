from .allocation import Allocation as Allocation, allocate as allocate, error_bounds as error_bounds
from .arm_errors import (
    assess_tolerances as assess_tolerances,
    sampled_errors as sampled_errors,
    tool_error as tool_error,
)
from .arm_life import (
    ArmLife as ArmLife,
    ComponentLife as ComponentLife,
    RepeatedMotion as RepeatedMotion,
    assess_life as assess_life,
)
from .assessment import Mechanism as Mechanism, ToleranceAssessment as ToleranceAssessment
from .exceedance import exceedance as exceedance
from .first_order import (
    form as form,
    nearest_failure as nearest_failure,
    reliability_index as reliability_index,
)
from .gamma_process import GammaProcess as GammaProcess, gamma_process as gamma_process
from .life_file import LifeFile as LifeFile, PlayGrowth as PlayGrowth, read_life_file as read_life_file
from .linear_error import Estimate as Estimate, LinearError as LinearError, fosm as fosm
from .linkage_assessment import (
    LinkageReliability as LinkageReliability,
    WearStatement as WearStatement,
    assess_linkage as assess_linkage,
)
from .linkage_errors import RandomClearances as RandomClearances, RandomLinkage as RandomLinkage
from .linkage_life import LinkageLife as LinkageLife
from .linkage_tolerances import (
    LinkageTolerances as LinkageTolerances,
    read_linkage_tolerances as read_linkage_tolerances,
)
from .linkage_wear import GapGrowth as GapGrowth, WearingLinkage as WearingLinkage
from .play_life import (
    PlayLife as PlayLife,
    WearRates as WearRates,
    play_life as play_life,
    repeatability_factors as repeatability_factors,
)
from .reducer_life import (
    Load as Load,
    Rating as Rating,
    joint_speed as joint_speed,
    life_hours as life_hours,
    load_of as load_of,
)
from .tip_errors import (
    assess_linkage_tolerances as assess_linkage_tolerances,
    sampled_tip_errors as sampled_tip_errors,
)
from .tip_samples import TipErrorTask as TipErrorTask, tip_samples as tip_samples
from .tolerances import (
    Tolerance as Tolerance,
    dimensions as dimensions,
    read_tolerances as read_tolerances,
    sampled_deviations as sampled_deviations,
)
from .wear_measurements import (
    WearMeasurement as WearMeasurement,
    measured_residuals as measured_residuals,
    read_wear_measurements as read_wear_measurements,
)
from .wear_update import RatePosterior as RatePosterior, updated_rate as updated_rate
from .weighted_draws import WeightedDraws as WeightedDraws, draw as draw
from .worst_case import longest_sum as longest_sum
