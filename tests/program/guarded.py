"""Random programs whose arms are stopped on their way: by guards, contact, HALT, errors, and MOVEs in actions."""

import numpy as np

# The frames of each arm: two on either side, one below the plane of contact.
_FRAMES = ("f", "g", "h", "k", "low")
# Where the second arm stands, and its turned base, as in examples/two_arms.toml [m].
_APART = 1.1


def guarded_program(rng: np.random.Generator, *, arms: int, corners: bool, fails: bool) -> str:
    """Return the text of a program for one or two arms that stand face to face.

    Args:
        rng: what the program is drawn by.
        arms: 1 or 2; two move side by side.
        corners: whether the first arm goes past frames at any rate, with a guard.
        fails: whether one arm fails at last, at full speed, with no TRY around it.
    """
    names = ", ".join(f"{frame}{a}" for a in range(1, arms + 1) for frame in _FRAMES)
    lines = [f"VAR {names} : FRAME ; n, m : SCALAR ;", "BEGIN", "n = 0 ; m = 0 ;"]
    for a in range(1, arms + 1):
        lines += [f"{frame}{a} = {_place(rng, a, frame)} ;" for frame in _FRAMES]
    failing = int(rng.integers(1, arms + 1)) if fails else 0
    bodies = [_body(rng, a, corners=corners and a == 1, fails=a == failing) for a in range(1, arms + 1)]
    if arms == 1:
        lines += bodies
    else:
        branches = " ;\n".join(f"PRIORITY {a} : BEGIN\n{body}\nEND" for a, body in enumerate(bodies, 1))
        lines.append(f"COBEGIN\n{branches}\nCOEND")
    return "\n".join([*lines, "END."]) + "\n"


def _place(rng: np.random.Generator, arm: int, frame: str) -> str:
    """Return a frame in front of an arm, its hand pointing down, as it is written in a program."""
    side = 1 if frame in "fh" else -1
    x, y, z = rng.uniform(0.35, 0.50), side * rng.uniform(0.12, 0.30), rng.uniform(0.10, 0.25)
    if frame == "low":
        x, y, z = 0.45, rng.uniform(-0.1, 0.1), -0.05
    if arm == 1:
        return f"(1,0,0, 0,-1,0, 0,0,-1, {x:.4f},{y:.4f},{z:.4f})"
    return f"(-1,0,0, 0,1,0, 0,0,-1, {_APART - x:.4f},{-y:.4f},{z:.4f})"


def _body(rng: np.random.Generator, a: int, *, corners: bool, fails: bool) -> str:
    statements = [_across(rng, a)] + [_past_frames(rng, a)] * corners
    statements += [_any(rng, a) for _ in range(int(rng.integers(0, 3)))]
    if fails:
        statements.append(_failing(rng, a))
    return " ;\n".join(statements)


def _any(rng: np.random.Generator, a: int) -> str:
    kinds = (_across, _past_frames, _down, _down, _other)
    return kinds[int(rng.integers(len(kinds)))](rng, a)


def _action(rng: np.random.Generator, a: int) -> str:
    """Return what an ON does: some stop the arm, some send it elsewhere, some let it go on first."""
    return str(
        rng.choice(
            [
                "HALT",
                "BEGIN n = n + 1 ; HALT END",
                f"BEGIN MOVE ARM_{a} TO h{a} END",
                f"BEGIN PAUSE 0.05 ; OPEN ARM_{a} ; MOVE ARM_{a} TO h{a} WITH SPEED = 60 END",
                f"BEGIN GRASP ARM_{a} ; HALT END",
                "BEGIN TRY n = 1 / m RECOVER n = 5 END ; HALT END",
                "BEGIN LOCK (n) DO n = n + 1 ; HALT END",
            ]
        )
    )


def _across(rng: np.random.Generator, a: int) -> str:
    """Return two MOVEs to the other side, the second with a guard in the middle of its way."""
    return (
        f"MOVE ARM_{a} TO f{a} WITH SPEED = 120 ;\n"
        f"MOVE ARM_{a} TO g{a} WITH SPEED = {rng.uniform(100, 120):.1f}, "
        f"ON DIST(ARM_{a}, g{a}) < {rng.uniform(0.12, 0.22):.3f} DO {_action(rng, a)}"
    )


def _past_frames(rng: np.random.Generator, a: int) -> str:
    """Return a MOVE past frames, with BLEND or without, that a guard looks at."""
    blend = f", WITH BLEND = {rng.uniform(0.01, 0.06):.3f}" if rng.random() < 0.5 else ""
    return (
        f"MOVE ARM_{a} TO f{a} WITH SPEED = 120 ;\n"
        f"MOVE ARM_{a} TO h{a} VIA (g{a}, k{a}), WITH SPEED = {rng.uniform(60, 120):.1f}{blend}, "
        f"ON DIST(ARM_{a}, g{a}) < {rng.uniform(0.06, 0.2):.3f} DO {_action(rng, a)}"
    )


def _down(rng: np.random.Generator, a: int) -> str:
    """Return a straight way into the plane of contact: the faster ones come too deep."""
    return (
        f"MOVE ARM_{a} TO h{a} ;\n"
        f"TRY MOVE ARM_{a} TO low{a} STRAIGHTLY, WITH SPEED = {rng.uniform(10, 60):.0f}, "
        f"ON FORCE(Z) > {rng.uniform(2, 40):.1f} DO HALT RECOVER n = 1 END ;\n"
        f"MOVE ARM_{a} TO h{a} WITH DEPARTURE = ARM_{a} * XYZ(0, 0, -0.04)"
    )


def _other(rng: np.random.Generator, a: int) -> str:
    return str(
        rng.choice(
            [
                f"OPEN ARM_{a}",
                "PAUSE 0.1",
                f"MOVE ARM_{a} TO k{a} STRAIGHTLY",
                f"MOVE ARM_{a} TO g{a} WITH DURATION = 3",
                f"LOCK (n) DO MOVE ARM_{a} TO h{a}",
            ]
        )
    )


def _failing(rng: np.random.Generator, a: int) -> str:
    """Return what fails at any rate: out of reach, or in the middle of a fast way."""
    fast = f"MOVE ARM_{a} TO f{a} ;\nMOVE ARM_{a} TO g{a} WITH SPEED = 120, ON DIST(ARM_{a}, g{a}) < 0.2 DO n = 1 / m"
    return str(rng.choice([f"MOVE ARM_{a} TO f{a} * XYZ(9, 0, 0)", fast, fast]))
