from .arm import (
    compile_arm as compile_arm,
    CompiledArm as CompiledArm,
)
