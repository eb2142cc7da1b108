"""What programs are exported to."""

from typing import Literal, TypeAlias

Target: TypeAlias = Literal["ros2", "csv", "urscript", "krl", "rapid", "fanuc"]
Mode: TypeAlias = Literal["program", "plan"]
