from .correction import (
    correct_nodes as correct_nodes,
    correct_path as correct_path,
    Correction as Correction,
)
from .estimation.static import (
    Estimate as Estimate,
    estimate_at_rest as estimate_at_rest,
)
from .linkage import (
    Linkage as Linkage,
)
from .paths import (
    named_path as named_path,
    thesis_path as thesis_path,
)
from .reader import (
    linkage_names as linkage_names,
    load_linkage as load_linkage,
)
from .scenario import (
    prepare as prepare,
    Scenario as Scenario,
)
from .settings import (
    Settings as Settings,
)
from .simulation import (
    simulate as simulate,
    Simulation as Simulation,
)
from .rest import (
    at_rest as at_rest,
)
