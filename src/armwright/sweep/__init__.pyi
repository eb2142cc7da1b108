from .designs import (
    Design as Design,
    full_factorial as full_factorial,
    latin_hypercube as latin_hypercube,
    sobol as sobol,
)
from .errors import SweepError as SweepError
from .machines import Machines as Machines, evaluate_on as evaluate_on
from .progress import Progress as Progress
from .results import load as load
from .runner import run as run
from .task import Axis as Axis, Output as Output, Status as Status, Task as Task
