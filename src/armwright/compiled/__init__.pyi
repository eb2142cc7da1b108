from .arm import (
    CompiledArm as CompiledArm,
)
from .arm import (
    compile_arm as compile_arm,
)
