from .correction import (
    Correction as Correction,
)
from .correction import (
    correct_nodes as correct_nodes,
)
from .correction import (
    correct_path as correct_path,
)
from .estimation.static import (
    Estimate as Estimate,
)
from .estimation.static import (
    estimate_at_rest as estimate_at_rest,
)
from .linkage import (
    Linkage as Linkage,
)
from .paths import (
    named_path as named_path,
)
from .paths import (
    thesis_path as thesis_path,
)
from .reader import (
    linkage_names as linkage_names,
)
from .reader import (
    load_linkage as load_linkage,
)
from .rest import (
    at_rest as at_rest,
)
from .scenario import (
    Scenario as Scenario,
)
from .scenario import (
    prepare as prepare,
)
from .settings import (
    Settings as Settings,
)
from .simulation import (
    Simulation as Simulation,
)
from .simulation import (
    simulate as simulate,
)
