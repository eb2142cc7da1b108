from .api import (
    Compilation as Compilation,
)
from .api import (
    ProgramError as ProgramError,
)
from .api import (
    compile as compile,
)
from .api import (
    run as run,
)
from .bytecode.instructions import (
    Code as Code,
)
from .bytecode.verifier import (
    CodeError as CodeError,
)
from .language.diagnostic import (
    Diagnostic as Diagnostic,
)
from .language.source import (
    Source as Source,
)
from .language.words import (
    Standard as Standard,
)
from .semantics.cell_symbols import (
    KnownCell as KnownCell,
)
from .semantics.cell_symbols import (
    known_cell as known_cell,
)
from .vm.interpreter import (
    interpret as interpret,
)
from .vm.machine import (
    Limits as Limits,
)
from .vm.machine import (
    RunError as RunError,
)
from .vm.recording import (
    Recording as Recording,
)
