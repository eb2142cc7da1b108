from .arm import CompiledArm as CompiledArm, compile_arm as compile_arm
