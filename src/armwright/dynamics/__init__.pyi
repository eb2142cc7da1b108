from .accelerations import (
    forward_dynamics as forward_dynamics,
)
from .accelerations import (
    toacc as toacc,
)
from .bejczy import (
    bejczy_efforts as bejczy_efforts,
)
from .energy import (
    kinetic_energy as kinetic_energy,
)
from .energy import (
    potential_energy as potential_energy,
)
from .equation_of_motion import (
    Terms as Terms,
)
from .equation_of_motion import (
    terms as terms,
)
from .inertia_matrix import (
    mass_matrix as mass_matrix,
)
from .lagrange_euler import (
    coriolis_matrix as coriolis_matrix,
)
from .lagrange_euler import (
    coriolis_tensor as coriolis_tensor,
)
from .lagrange_euler import (
    pose_derivative_matrices as pose_derivative_matrices,
)
from .newton_euler import (
    LinkForces as LinkForces,
)
from .newton_euler import (
    inverse_dynamics as inverse_dynamics,
)
from .newton_euler import (
    link_forces as link_forces,
)
from .payloads import (
    payload as payload,
)
from .shares import (
    coriolis_efforts as coriolis_efforts,
)
from .shares import (
    gravity_efforts as gravity_efforts,
)
