"""A load on the tool, as part of the last link."""

from __future__ import annotations

import attrs
import numpy as np

from armwright.arm.model import Arm, Link
from armwright.arrays import ArrayLike
from armwright.dynamics.arguments import weighed
from armwright.dynamics.bodies import as_link, body_of, combined, in_previous_frame

_NO_TENSOR = np.zeros((3, 3))


def payload(arm: Arm, mass: float, com: ArrayLike = (0.0, 0.0, 0.0), inertia: ArrayLike = _NO_TENSOR) -> Arm:
    """Return the arm with a load fixed at its tool.

    Args:
        arm: the arm, with n joints.
        mass: of the load [kg].
        com: (3,) centre of mass of the load in the tool frame [m].
        inertia: (3, 3) tensor of the load about its centre of mass, along the axes of the tool [kg m²].

    Returns:
        The same arm whose last link is one body with the load.

    Raises:
        KindError: ``arm`` is no arm, or an argument something else than real numbers.
        InvalidValueError: the mass is negative, a number is not finite, or no body has the tensor.
        ShapeError: ``com`` or ``inertia`` have another shape.

    Source:
        TR-83-008, appendix II (4).
    """
    load = Link(mass=mass, com=com, inertia=inertia)
    R, p = weighed(arm).tool[:3, :3].tolist(), arm.tool[:3, 3].tolist()
    last = combined(body_of(arm.links[-1]), in_previous_frame(body_of(load), R, p))
    carried = attrs.evolve(as_link(last), name=arm.links[-1].name)
    return attrs.evolve(arm, links=(*arm.links[:-1], carried))
