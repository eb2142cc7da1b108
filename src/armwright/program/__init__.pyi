from .api import Compilation as Compilation, ProgramError as ProgramError, compile as compile, run as run
from .bytecode.instructions import Code as Code
from .bytecode.verifier import CodeError as CodeError
from .language.diagnostic import Diagnostic as Diagnostic
from .language.source import Source as Source
from .language.words import Standard as Standard
from .semantics.cell_symbols import KnownCell as KnownCell, known_cell as known_cell
from .vm.interpreter import interpret as interpret
from .vm.machine import Limits as Limits, RunError as RunError
from .vm.recording import Recording as Recording
