from .accelerations import forward_dynamics as forward_dynamics, toacc as toacc
from .bejczy import bejczy_efforts as bejczy_efforts
from .derivatives import (
    AccelerationDerivatives as AccelerationDerivatives,
    EffortDerivatives as EffortDerivatives,
    forward_dynamics_derivatives as forward_dynamics_derivatives,
    inverse_dynamics_derivatives as inverse_dynamics_derivatives,
)
from .energy import kinetic_energy as kinetic_energy, potential_energy as potential_energy
from .equation_of_motion import Terms as Terms, terms as terms
from .flexible_joints import (
    Modes as Modes,
    deflection as deflection,
    gear_efforts as gear_efforts,
    links_at_rest as links_at_rest,
    modes as modes,
    tool_compliance as tool_compliance,
    with_gears as with_gears,
)
from .identification import (
    BaseParameters as BaseParameters,
    base_parameters as base_parameters,
    base_regressor as base_regressor,
    parameter_names as parameter_names,
)
from .inertia_matrix import mass_matrix as mass_matrix
from .lagrange_euler import (
    coriolis_matrix as coriolis_matrix,
    coriolis_tensor as coriolis_tensor,
    pose_derivative_matrices as pose_derivative_matrices,
)
from .newton_euler import LinkForces as LinkForces, inverse_dynamics as inverse_dynamics, link_forces as link_forces
from .payloads import payload as payload
from .regressors import dynamic_parameters as dynamic_parameters, regressor as regressor
from .shares import coriolis_efforts as coriolis_efforts, gravity_efforts as gravity_efforts
from .static_deflection import (
    CompensatedPositions as CompensatedPositions,
    StaticDeflection as StaticDeflection,
    compensated_positions as compensated_positions,
    joint_loads as joint_loads,
    static_deflection as static_deflection,
)
from .stiffness_file import read_stiffness as read_stiffness
from .vibration import VibrationAssessment as VibrationAssessment, assess_vibration as assess_vibration
