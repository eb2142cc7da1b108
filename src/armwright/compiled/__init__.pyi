from .arm import CompiledArm as CompiledArm, compile_arm as compile_arm
from .derivatives import derivative as derivative
from .device_arm import DeviceArm as DeviceArm
from .normal_equations import NormalEquations as NormalEquations, normal_equations as normal_equations
