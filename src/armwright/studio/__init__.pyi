from .live_arm import LiveArm as LiveArm
