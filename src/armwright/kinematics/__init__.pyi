from .damped_least_squares import DampedRates as DampedRates, damped_rates as damped_rates
from .differential import (
    DifferentialInverse as DifferentialInverse,
    SingularConfigurationError as SingularConfigurationError,
    differential_inverse as differential_inverse,
)
from .forward_kinematics import forward as forward, link_poses as link_poses
from .inverse_kinematics.redundancy import (
    SwivelInterval as SwivelInterval,
    swivel_intervals as swivel_intervals,
    swivel_of as swivel_of,
)
from .inverse_kinematics.revolutions import (
    equivalent_configurations as equivalent_configurations,
    nearest_equivalent as nearest_equivalent,
)
from .inverse_kinematics.solution import (
    Branch as Branch,
    InverseSolution as InverseSolution,
    NoSolutionError as NoSolutionError,
    Outcome as Outcome,
    Violation as Violation,
)
from .inverse_kinematics.solve import inverse as inverse, inverse_branches as inverse_branches
from .jacobians import jacobian as jacobian, jacobian_rate as jacobian_rate, tool_twist as tool_twist
from .manipulability_index import manipulability as manipulability
from .singularity_analysis import (
    Singularities as Singularities,
    singularities as singularities,
    singularity_factors as singularity_factors,
)
from .wrist_partition import (
    wrist_partitioned_inverse as wrist_partitioned_inverse,
    wrist_partitioned_jacobian as wrist_partitioned_jacobian,
)
