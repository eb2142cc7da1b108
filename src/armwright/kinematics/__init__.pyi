from .damping import (
    DampedRates as DampedRates,
)
from .damping import (
    damped_rates as damped_rates,
)
from .differential import (
    DifferentialInverse as DifferentialInverse,
)
from .differential import (
    SingularConfigurationError as SingularConfigurationError,
)
from .differential import (
    differential_inverse as differential_inverse,
)
from .forward_kinematics import (
    forward as forward,
)
from .forward_kinematics import (
    link_poses as link_poses,
)
from .inverse_kinematics.solution import (
    Branch as Branch,
)
from .inverse_kinematics.solution import (
    InverseSolution as InverseSolution,
)
from .inverse_kinematics.solution import (
    NoSolutionError as NoSolutionError,
)
from .inverse_kinematics.solution import (
    Outcome as Outcome,
)
from .inverse_kinematics.solution import (
    Violation as Violation,
)
from .inverse_kinematics.solve import (
    inverse as inverse,
)
from .inverse_kinematics.solve import (
    inverse_branches as inverse_branches,
)
from .inverse_kinematics.wrapping import (
    equivalent_configurations as equivalent_configurations,
)
from .inverse_kinematics.wrapping import (
    nearest_equivalent as nearest_equivalent,
)
from .jacobians import (
    jacobian as jacobian,
)
from .jacobians import (
    jacobian_rate as jacobian_rate,
)
from .jacobians import (
    tool_twist as tool_twist,
)
from .manipulability_index import (
    manipulability as manipulability,
)
from .singularity_analysis import (
    Singularities as Singularities,
)
from .singularity_analysis import (
    singularities as singularities,
)
from .singularity_analysis import (
    singularity_factors as singularity_factors,
)
from .wrist_partitioned import (
    wrist_partitioned_inverse as wrist_partitioned_inverse,
)
from .wrist_partitioned import (
    wrist_partitioned_jacobian as wrist_partitioned_jacobian,
)
