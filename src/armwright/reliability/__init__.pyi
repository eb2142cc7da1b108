from .allocation import Allocation as Allocation, allocate as allocate, error_bounds as error_bounds
from .arm_errors import sampled_errors as sampled_errors, tool_error as tool_error
from .assessment import ToleranceAssessment as ToleranceAssessment, assess_tolerances as assess_tolerances
from .exceedance import exceedance as exceedance
from .first_order import (
    form as form,
    nearest_failure as nearest_failure,
    reliability_index as reliability_index,
)
from .linear_error import Estimate as Estimate, LinearError as LinearError, fosm as fosm
from .tolerances import Tolerance as Tolerance, dimensions as dimensions, read_tolerances as read_tolerances
from .worst_case import longest_sum as longest_sum
