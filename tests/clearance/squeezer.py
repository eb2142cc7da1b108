"""Andrews' squeezing mechanism: seven bodies, three loops, one motor, one spring.

Numbers and the solution at t = 0.03 s as the test set for initial value problems has them (Hairer & Wanner; Mazzia &
Magherini). Coordinates there are β, Θ, γ, Φ, δ, Ω, ε, some of them angles between bodies; ours are all against the
ground. The pins of its loops are pins with play here, closed.
"""

import math

import numpy as np

from armwright.clearance.linkage import Body, BodyPoint, ClearancePin, Drive, Linkage, Load, Pin

A, B, C = (-0.06934, -0.00227), (-0.03635, 0.03273), (0.014, 0.072)
D, DA, E, EA, RR, RA = 0.028, 0.0115, 0.02, 0.01421, 0.007, 0.00092
SS, SA, SB, SC, SD = 0.035, 0.01874, 0.01043, 0.018, 0.02
TA, TB, U, UA, UB, ZF, ZT, FA = 0.02308, 0.00916, 0.04, 0.01228, 0.00449, 0.02, 0.04, 0.01421
MASSES = (0.04325, 0.00365, 0.02373, 0.00706, 0.07050, 0.00706, 0.05498)
INERTIAS = (2.194e-6, 4.410e-7, 5.255e-6, 5.667e-7, 1.169e-5, 5.667e-7, 1.912e-5)
MOMENT, SPRING, UNSTRETCHED = 0.033, 4530.0, 0.07785

START = np.array(
    (
        -0.0617138900142764496,
        0.0,
        0.455279819163070380,
        0.222668390165885885,
        0.487364979543842550,
        -0.222668390165885885,
        1.23054744454982119,
    )
)
END = np.array(
    (
        15.81077119629904,
        -15.75637105984298,
        0.04082224013073101,
        -0.5347301163226948,
        0.5244099658805304,
        0.5347301163226948,
        1.048080741042263,
    )
)
END_SPEEDS = np.array(
    (
        1139.920302151208,
        -1424.379294994111,
        11.03291221937134,
        19.29337464421385,
        0.5735699284790808,
        -19.29337464421385,
        0.3231791658026955,
    )
)
# The multipliers of the loops, and at the start how β and Θ speed up.
START_FORCES = np.array(((98.5668703962410896, -6.12268834425566265), (0.0, 0.0), (0.0, 0.0)))
START_ACCELERATIONS = np.array((14222.4439199541138705, -10666.8329399655854801, 0, 0, 0, 0, 0))
END_FORCES = np.array(
    (
        (199.1753333731910, -29.75531228015052),
        (23.06654120098399, 31.45271365475927),
        (22.64249232082739, 11.61740700019673),
    )
)

# Which of our bodies turn by which of theirs: the second by β + Θ, the fourth by Φ + δ, the sixth by Ω + ε.
TURNS = np.eye(7)
TURNS[1, 0] = TURNS[3, 4] = TURNS[5, 6] = 1.0


def squeezer(gamma: float) -> Linkage:
    """The mechanism, with the pull of its spring at one angle of the body that it hangs on."""
    s, c = math.sin(gamma), math.cos(gamma)
    # Where the spring is held, and from there to its other end.
    pull = np.array((SD * c + SC * s + B[0] - C[0], SD * s - SC * c + B[1] - C[1]))
    length = float(np.hypot(*pull))
    bodies = [
        ("K1", (RA, 0), {"O": (0, 0), "F": (RR, 0)}),
        ("K2", (-DA, 0), {"F": (0, 0), "E": (-D, 0)}),
        ("K3", (SA, -SB), {"B": (0, 0), "E": (0, -SS), "D": (SD, -SC)}),
        ("K5", (TA, TB), {"A": (0, 0), "G": (ZT, 0)}),
        ("K4", (0, -(E - EA)), {"G": (0, 0), "E": (0, -E)}),
        ("K7", (UA, -UB), {"A": (0, 0), "H": (0, -U)}),
        ("K6", (ZF - FA, 0), {"H": (0, 0), "E": (ZF, 0)}),
    ]
    numbers = [int(name[1]) - 1 for name, _, _ in bodies]
    hung = {
        "K1": "ground:O",
        "K2": "K1:F",
        "K3": "ground:B",
        "K5": "ground:A",
        "K4": "K5:G",
        "K7": "ground:A",
        "K6": "K7:H",
    }
    return Linkage(
        name="squeezer",
        ground=Body(name="ground", points={"O": (0, 0), "A": A, "B": B, "C": C}),
        bodies=[
            Body(name=name, mass=MASSES[i], inertia=INERTIAS[i], centre=centre, points=points)
            for i, (name, centre, points) in zip(numbers, bodies, strict=True)
        ],
        joints=[
            Pin(body=name, point=joint_point.split(":")[1], on=BodyPoint(*joint_point.split(":")))
            for name, joint_point in hung.items()
        ],
        pins=[
            ClearancePin(
                name=name,
                bearing=BodyPoint(name, "E"),
                journal=BodyPoint("K2", "E"),
                clearance=1e-5,
                journal_radius=1e-3,
            )
            for name in ("K3", "K4", "K6")
        ],
        drives=[Drive(body="K1")],
        loads=[Load(point=BodyPoint("K3", "D"), force=-SPRING * (length - UNSTRETCHED) / length * pull)],
        tip=BodyPoint("K2", "E"),
        gravity=(0.0, 0.0),
    )


def ours(theirs: np.ndarray) -> np.ndarray:
    """Our angles, in the order of our bodies, from theirs."""
    return np.asarray((TURNS @ theirs)[[0, 1, 2, 4, 3, 6, 5]])
