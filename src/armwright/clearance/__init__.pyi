from .correction import Correction as Correction, correct_nodes as correct_nodes, correct_path as correct_path
from .dimensions import Dimension as Dimension, deviate as deviate, dimensions_of as dimensions_of
from .estimation.static_estimate import Estimate as Estimate, estimate_at_rest as estimate_at_rest
from .linkage import Linkage as Linkage
from .natural_modes import NaturalModes as NaturalModes, natural_modes as natural_modes
from .paths import named_path as named_path, thesis_path as thesis_path
from .poses import closed_along as closed_along, closed_at as closed_at
from .reader import linkage_names as linkage_names, load_linkage as load_linkage
from .scenario import Scenario as Scenario, prepare_scenario as prepare_scenario
from .sensitivities import RestSensitivities as RestSensitivities, rest_sensitivities as rest_sensitivities
from .settings import Settings as Settings
from .simulation import Simulation as Simulation, simulate as simulate
from .static_equilibrium import find_static_equilibrium as find_static_equilibrium
