from .load import (
    arm_names as arm_names,
)
from .load import (
    load_arm as load_arm,
)
from .model import (
    Arm as Arm,
)
from .model import (
    Joint as Joint,
)
from .model import (
    Limits as Limits,
)
from .model import (
    Link as Link,
)
from .model import (
    Motor as Motor,
)
from .uncertainty import (
    Uncertainty as Uncertainty,
)
from .urdf.reader import (
    load_urdf as load_urdf,
)
from .urdf.writer import (
    urdf_text as urdf_text,
)
from .write import (
    toml_text as toml_text,
)
