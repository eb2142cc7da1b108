"""Which closed form an arm has: found from its joint axes, by what is parallel and what meets."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from itertools import product

import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.errors import UnsupportedArmError
from armwright.kinematics.forward_kinematics import forward
from armwright.kinematics.inverse_kinematics.axes import SAME, Axes, are_parallel, joint_axes, meeting
from armwright.kinematics.inverse_kinematics.branches import ClosedForm
from armwright.kinematics.inverse_kinematics.builds import OfBuild
from armwright.kinematics.inverse_kinematics.decompositions import Backwards, Scara, ThreeParallel, Wristed
from armwright.kinematics.inverse_kinematics.geometry import Sign
from armwright.kinematics.inverse_kinematics.recognise import geometry_of
from armwright.kinematics.inverse_kinematics.redundant import Locked, Swivelling

# A closed form is believed when it finds so many configurations of its arm again, to this [rad], [m]; there may be arms
# whose axes are paired so that the equations say nothing.
_TRIED, _FOUND = 4, 1e-6


@lru_cache(maxsize=64)  # asked for at every solve, and an arm does not change
def find_closed_form(arm: Arm) -> ClosedForm | None:
    """Return the closed form of an arm, or None.

    Looked for, in this order:

    - a build of ``find_geometry``: with an elbow or a slide and a spherical wrist, or with three parallel axes;
    - three revolute joints of which two neighbours are parallel or meet, and as many more, up to three, whose axes meet
      in one point; of six joints, or of four, the first three may be those that meet instead;
    - a revolute joint, three parallel ones, and up to two more, whose axes meet;
    - three revolute joints and a slide, all parallel (SCARA);
    - seven joints: three whose axes meet, one, and three whose axes meet; or six with a closed form, before or after
      one more.

    Args:
        arm: any arm.
    """
    for form in _forms(joint_axes(arm)):
        if isinstance(form, OfBuild) or _finds_again(arm, form):
            return form
    return None


def closed_form_of(arm: Arm) -> ClosedForm:
    """Return the closed form of an arm, as ``find_closed_form`` does.

    Raises:
        UnsupportedArmError: it has none.
    """
    form = find_closed_form(arm)
    if form is None:
        raise UnsupportedArmError(
            f"arm '{arm.name}': no closed-form inverse kinematics; expected an arm built like puma560, stanford or "
            "ur5, a SCARA, or one whose axes meet or are parallel so that its equations come apart"
        )
    return form


def _forms(axes: Axes) -> Iterator[ClosedForm]:
    """Go through the closed forms that fit axes."""
    n = len(axes.kinds)
    if n == 6 and (geometry := geometry_of(axes)) is not None:
        yield OfBuild(geometry=geometry)
    if axes.kinds == "R" * n and 3 <= n <= 6:
        yield from _wristed(axes)
        if n in (4, 6):
            other = _turned_over(axes)
            for forwards in _wristed(other):
                choosers = tuple(n + 1 - joint for joint in reversed(forwards.choosers))
                yield Backwards(axes=axes, signs=forwards.signs, choosers=choosers, forwards=forwards)
        if n >= 4:
            yield from _three_parallel(axes)
    if sorted(axes.kinds) == list("PRRR") and all(are_parallel(axes.directions[0], w) for w in axes.directions):
        first = axes.kinds.index("R") + 1
        yield Scara(axes=axes, signs=((1,), (-1,)), choosers=(first,))
    if n == 7:
        yield from _redundant(axes)


def _wristed(axes: Axes) -> Iterator[Wristed]:
    """Give the closed forms of three joints of which two are a pair, and of joints that meet."""
    o, w = axes.points, axes.directions
    n = len(w)
    centre = _common_point(o[3:], w[3:], axes.X_BT[:3, 3])
    if centre is None:
        return
    signs = _signs(3 if n == 6 else 2)
    choosers = tuple(range(1, min(n, 4) + 1))
    for first, name in ((1, "last"), (0, "first")):
        if are_parallel(w[first], w[first + 1]):
            pair, point = f"{name} parallel", None
        else:
            pair, point = f"{name} meet", meeting(o[first], w[first], o[first + 1], w[first + 1])
            if point is None:
                continue
        yield Wristed(axes=axes, signs=signs, choosers=choosers, pair=pair, centre=centre, meets=point)  # type: ignore[arg-type]


def _three_parallel(axes: Axes) -> Iterator[ThreeParallel]:
    """Give the closed form of a joint, three parallel ones, and up to two that meet."""
    o, w = axes.points, axes.directions
    if not (are_parallel(w[1], w[2]) and are_parallel(w[1], w[3])) or are_parallel(w[0], w[1]):
        return
    centre = _common_point(o[4:], w[4:], o[3])
    if centre is None:
        return
    n = len(w)
    choosers = (1, 2, 4, 5) if n == 6 else (1, 2)
    yield ThreeParallel(axes=axes, signs=_signs(3 if n == 6 else 2), choosers=choosers, centre=centre)


def _redundant(axes: Axes) -> Iterator[ClosedForm]:
    """Give the closed forms of seven joints."""
    o, w = axes.points, axes.directions
    if axes.kinds == "RRRRRRR":
        shoulder, wrist = _common_point(o[:3], w[:3], o[0]), _common_point(o[4:], w[4:], o[4])
        if shoulder is not None and wrist is not None:
            elbow = o[3] + w[3] * float((shoulder - o[3]) @ w[3])
            choosers = (1, 5)
            points = {"shoulder": shoulder, "wrist": wrist, "elbow": elbow}
            yield Swivelling(axes=axes, signs=_signs(3), choosers=choosers, **points)
    for joint in (7, 1):
        held, rest = joint - 1, [i for i in range(7) if i != joint - 1]
        others = Axes(kinds="".join(axes.kinds[i] for i in rest), points=o[rest], directions=w[rest], X_BT=axes.X_BT)
        R, p = axes.X_BT[:3, :3], axes.X_BT[:3, 3]
        point, direction = (o[held], w[held]) if joint == 1 else (R.T @ (o[held] - p), R.T @ w[held])
        for form in _forms(others):
            yield Locked(
                signs=form.signs,
                choosers=tuple(number + (number >= joint) for number in form.choosers),
                joint=joint,
                rest=form,
                kind=axes.kinds[held],
                point=point,
                direction=direction,
            )


def _common_point(points: Array, directions: Array, otherwise: Array) -> Array | None:
    """Return the point (3,) where up to three lines meet; None where they do not.

    Of one line it is the point nearest to ``otherwise``, of none that is it.
    """
    if len(points) == 0:
        return otherwise
    if len(points) == 1:
        return np.asarray(points[0] + directions[0] * float((otherwise - points[0]) @ directions[0]))
    point = meeting(points[0], directions[0], points[1], directions[1])
    if point is None:
        return None
    for o, w in zip(points[2:], directions[2:], strict=True):
        if float(np.linalg.norm(np.cross(o - point, w))) > SAME:
            return None
    if len(points) == 3 and are_parallel(directions[1], directions[2]):
        return None
    return point


def _turned_over(axes: Axes) -> Axes:
    """Return the axes of the arm that is held by its tool: its base is the tool, its displacements the inverse."""
    return Axes(kinds=axes.kinds[::-1], points=axes.points[::-1], directions=axes.directions[::-1], X_BT=axes.X_BT)


def _signs(count: int) -> tuple[tuple[Sign, ...], ...]:
    choices: tuple[Sign, Sign] = (1, -1)
    return tuple(product(choices, repeat=count))


def _finds_again(arm: Arm, form: ClosedForm) -> bool:
    """Whether a closed form finds configurations of its arm again, and leaves no joint open there."""
    rng = np.random.default_rng(0)
    for q in rng.uniform(-1.0, 1.0, size=(_TRIED, arm.n)):
        X = forward(arm, q)
        near = q.tolist()
        found = form.branches(arm, X[:3, :3].tolist(), X[:3, 3].tolist(), near)
        # A joint that every pose leaves open would have its value from q, and be found by that alone.
        again = np.abs(np.array(found.q, dtype=float) - q).max(axis=1) < _FOUND
        if not (again & ~np.array(found.free, dtype=bool).any(axis=1)).any():
            return False
    return True
