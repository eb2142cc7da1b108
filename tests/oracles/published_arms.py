"""Arms of classes that the catalogue has no example of: most with numbers that others have published."""

import numpy as np

from armwright.arm.model import Arm, Joint, Limits

RIGHT = np.pi / 2
TURN = Limits(lower=-np.pi, upper=np.pi)


def _turning(d: float = 0.0, a: float = 0.0, alpha: float = 0.0, *, theta: float = 0.0, limits: Limits = TURN) -> Joint:
    return Joint(kind="revolute", theta=theta, d=d, a=a, alpha=alpha, limits=limits)


def _degrees(lower: float, upper: float | None = None) -> Limits:
    return Limits(
        lower=np.radians(-lower if upper is None else lower), upper=np.radians(lower if upper is None else upper)
    )


def cobra600() -> Arm:
    """Adept Cobra 600, a SCARA: the table of roboticstoolbox 1.5.0, models/DH/Cobra600.py."""
    return Arm(
        name="cobra600",
        joints=[
            _turning(0.387, 0.325, limits=_degrees(50)),
            _turning(0.0, 0.275, np.pi, limits=_degrees(88)),
            Joint(kind="prismatic", limits=Limits(lower=0.0, upper=0.210)),
            _turning(),
        ],
    )


def wx250() -> Arm:
    """Interbotix WidowX 250, five joints: interbotix_ros_manipulators, wx250.urdf.xacro, up to ee_arm_link."""
    upper, raised = np.hypot(0.04975, 0.25), np.arctan2(0.25, 0.04975)
    return Arm(
        name="wx250",
        joints=[
            _turning(0.072 + 0.03865, alpha=-RIGHT),
            _turning(a=upper, theta=-raised, limits=_degrees(-108, 114)),
            _turning(a=0.25, theta=raised, limits=_degrees(-123, 92)),
            _turning(theta=RIGHT, alpha=RIGHT, limits=_degrees(-100, 123)),
            _turning(0.065 + 0.043),
        ],
    )


def xarm6() -> Arm:
    """UFACTORY xArm 6, a wrist with an offset: xarm_ros, xarm6_default_kinematics.yaml, its right angles exact."""
    upper, raised = np.hypot(0.0535, 0.2845), np.arctan2(0.2845, 0.0535)
    return Arm(
        name="xarm6",
        joints=[
            _turning(0.267, alpha=-RIGHT),
            _turning(a=upper, theta=-raised),
            _turning(a=0.0775, alpha=-RIGHT, theta=raised),
            _turning(0.3425, alpha=RIGHT),
            _turning(a=0.076, alpha=-RIGHT),
            _turning(0.097),
        ],
    )


def jaco() -> Arm:
    """Kinova Jaco with its bent wrist: "DH Parameters of Jaco" 1.0.8, in roboticstoolbox 1.5.0, models/DH/Jaco.py."""
    bent = np.radians(30)
    share = np.sin(bent) / np.sin(2 * bent)
    return Arm(
        name="jaco",
        joints=[
            _turning(0.2755, alpha=RIGHT),
            _turning(a=0.41, alpha=np.pi, theta=-RIGHT),
            _turning(-0.0098, alpha=RIGHT, theta=RIGHT),
            _turning(-(0.2073 + share * 0.0743), alpha=2 * bent),
            _turning(-2 * share * 0.0743, alpha=2 * bent, theta=-np.pi),
            _turning(-(share * 0.0743 + 0.1687), alpha=np.pi, theta=np.radians(100)),
        ],
    )


def sixteen() -> Arm:
    """The arm of Manseur & Doty (1989), "A robot manipulator with 16 real inverse kinematic solution sets"."""
    rows = [(0.0, 0.3, 90), (0.0, 1.0, 1), (0.2, 0.0, 90), (0.0, 1.5, 1), (0.0, 0.0, 90), (0.0, 1.0, 1)]
    return Arm(name="sixteen", joints=[_turning(d, a, np.radians(alpha)) for d, a, alpha in rows])


def bent_wrist() -> Arm:
    """An elbow arm whose wrist axes meet at 40 and 63 degrees, and whose first two axes are not at right angles."""
    rows = [(0.3, 0.1, 0.8), (0.1, 0.4, 0.0), (0.05, 0.03, 1.2), (0.35, 0.0, 0.7), (0.0, 0.0, 1.1), (0.1, 0.05, 0.3)]
    return Arm(name="bent-wrist", joints=[_turning(*row, theta=0.3) for row in rows])


def skew_shoulder() -> Arm:
    """Three parallel axes that are not at right angles to those before and after them."""
    rows = [(0.3, 0.1, 0.8), (0.1, 0.4, np.pi), (0.05, 0.33, 0.0), (0.1, 0.06, 1.1), (0.1, 0.0, 0.8), (0.07, 0.03, 0.2)]
    return Arm(name="skew-shoulder", joints=[_turning(*row, theta=0.3) for row in rows])


def iiwa14() -> Arm:
    """KUKA LBR iiwa 14 R820: iiwa_stack, iiwa14.xacro, up to link_ee."""
    rows = [(0.36, -1, 170), (0, 1, 120), (0.42, 1, 170), (0, -1, 120), (0.4, -1, 170), (0, 1, 120), (0.126, 0, 175)]
    return Arm(
        name="iiwa14",
        joints=[_turning(d, alpha=side * RIGHT, limits=_degrees(limit)) for d, side, limit in rows],
    )


def panda() -> Arm:
    """Franka Emika Panda: the table of roboticstoolbox 1.5.0, models/DH/Panda.py, up to the flange."""
    rows = [
        (0.333, 0.0, -1, -2.8973, 2.8973),
        (0.0, 0.0, 1, -1.7628, 1.7628),
        (0.316, 0.0825, 1, -2.8973, 2.8973),
        (0.0, -0.0825, -1, -3.0718, -0.0698),
        (0.384, 0.0, 1, -2.8973, 2.8973),
        (0.0, 0.088, 1, -0.0175, 3.7525),
        (0.107, 0.0, 0, -2.8973, 2.8973),
    ]
    return Arm(
        name="panda",
        joints=[
            _turning(d, a, side * RIGHT, limits=Limits(lower=lower, upper=upper)) for d, a, side, lower, upper in rows
        ],
    )
