from .api import (
    ExportedProgram as ExportedProgram,
    export_compiled as export_compiled,
    export_program as export_program,
    export_run as export_run,
)
from .joint_motion import export_motion as export_motion
from .proof import Comparison as Comparison, Proof as Proof
from .refusals import ExportError as ExportError
