"""URDF texts to read in tests, put together from links and joints."""

LIMIT = '<limit lower="-1" upper="2" effort="30" velocity="3"/>'
MASS = '<inertial><mass value="2"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'


def link(name: str, inside: str = "") -> str:
    return f'<link name="{name}">{inside}</link>\n'


def joint(name: str, kind: str, parent: str, child: str, inside: str = "") -> str:
    return f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>{inside}</joint>\n'


def robot(*parts: str) -> str:
    return f'<robot name="test">\n{"".join(parts)}</robot>\n'


def one(inside: str = LIMIT, kind: str = "revolute") -> str:
    """One joint between two links, about z."""
    axis = "" if "<axis" in inside else '<axis xyz="0 0 1"/>'
    return robot(link("base"), link("hand"), joint("turn", kind, "base", "hand", axis + inside))


ARM_WITH_GRIPPER = robot(
    *(link(name, MASS) for name in ("base", "arm", "palm", "left", "right")),
    link("camera"),
    joint("turn", "continuous", "base", "arm", '<axis xyz="0 0 1"/>'),
    joint("screws", "fixed", "arm", "palm", '<origin xyz="0.5 0 0"/>'),
    joint("left_slide", "prismatic", "palm", "left", f'<axis xyz="0 1 0"/>{LIMIT}'),
    joint("right_slide", "prismatic", "palm", "right", f'<axis xyz="0 1 0"/>{LIMIT}<mimic joint="left_slide"/>'),
    joint("clip", "fixed", "palm", "camera", '<origin xyz="0 0 0.1"/>'),
)
