"""What touches what in a world, and how hard."""

from __future__ import annotations

from collections import Counter
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from armwright.arrays import Array
from armwright.cell.hardware import PeakContact
from armwright.physics.gripper import LIP_TOUCHES
from armwright.physics.world_model import PIECE, PLATE, WorldModel

# Parts, fixtures and arms that overlap by more at the start stand inside one another [m].
OVERLAP = 1e-3
_UNOWNED = ""


class Touch(NamedTuple):
    """Two things that press on each other.

    Attributes:
        arm: whose link, gripper or part in the hand it is.
        what: its name.
        other: what it touches.
        force: between them [N].
    """

    arm: str
    what: str
    other: str
    force: float


class Overlap(NamedTuple):
    """Two things that stand inside each other, and by how much [m]."""

    one: str
    other: str
    depth: float


class Contacts:
    """The geoms of a world by what they belong to."""

    def __init__(self, world: WorldModel) -> None:
        """Take a world."""
        self._model = world.model
        self.names: list[str] = []
        self._owners: list[str] = []
        # What grips, and parts.
        self._grips: npt.NDArray[np.bool_] = np.zeros(world.model.ngeom, dtype=bool)
        self._parts: npt.NDArray[np.bool_] = np.zeros(world.model.ngeom, dtype=bool)
        self._pads: dict[str, list[int]] = {name: [] for name in world.cell.arms}
        self._part_geoms: dict[str, list[int]] = {name: [] for name in world.parts}
        self._tools = {name: world.model.body(f"{name}/tool").id for name in world.cell.arms}
        for number in range(world.model.ngeom):
            self._add_geom(world, number)
        # What parts press with by their weight [N].
        self._weights = np.zeros(world.model.ngeom)
        for name, part in world.parts.items():
            self._weights[self._part_geoms[name]] = part.mass * float(np.linalg.norm(world.cell.gravity))
        self._unwanted: npt.NDArray[np.bool_] = np.zeros((world.model.ngeom,) * 2, dtype=bool)
        self.hold({})

    def _add_geom(self, world: WorldModel, number: int) -> None:
        name = world.model.geom(number).name.partition(PIECE)[0]
        arm, slash, what = name.partition("/")
        if not slash or arm not in world.cell.arms:
            self.names.append(name)
            self._owners.append(_UNOWNED)
            if name in world.parts:
                self._parts[number] = True
                self._part_geoms[name].append(number)
            return
        self._owners.append(arm)
        self._grips[number] = what.endswith("finger") or what.startswith("lip")
        if self._grips[number]:
            self._pads[arm].append(number)
        label = what.partition("/")[0].replace("link", "link ")
        label = "finger" if what.endswith("finger") else "suction cup" if what.startswith("lip") else label
        self.names.append(f"{arm} {label}")

    def hold(self, held: dict[str, str]) -> None:
        """Take note of what arms hold: parts by arm. What they hold belongs to them."""
        owners = np.array(self._owners, dtype=object)
        for arm, part in held.items():
            owners[self._part_geoms[part]] = arm
        owned = owners != _UNOWNED
        # An arm may touch nothing but what is its; fingers that hold nothing may touch parts.
        apart = (owners[:, None] != owners[None, :]) & (owned[:, None] | owned[None, :])
        empty = self._grips & ~np.isin(self._owners, list(held))
        reach = empty[:, None] & self._parts[None, :]
        # What parts in hands press with by their weight [N].
        self._carried = np.zeros_like(self._weights)
        for part in held.values():
            self._carried[self._part_geoms[part]] = self._weights[self._part_geoms[part]]
        self._unwanted = apart & ~reach & ~reach.T
        self._holders, self._harmless = owners, b""

    def unwanted(self, data: Any, least: float) -> Touch | None:
        """Return the hardest contact of an arm with what it should not touch, of at least a force [N].

        A part in the hand may press with its own weight beside: it stood on something before it was lifted.
        """
        if not data.ncon:
            return None
        geoms = data.contact.geom
        # Mostly the same things touch as at the tick before.
        touching = geoms.tobytes()
        if touching == self._harmless:
            return None
        suspicious = self._unwanted[geoms[:, 0], geoms[:, 1]]
        if not np.count_nonzero(suspicious):
            self._harmless = touching
            return None
        worst = None
        for number in np.flatnonzero(suspicious).tolist():
            force = self.force(data, number)
            a, b = geoms[number].tolist()
            mine, other = (a, b) if self._holders[a] != _UNOWNED else (b, a)
            if force - self._carried[[a, b]].max() >= least and (worst is None or force > worst.force):
                worst = Touch(str(self._holders[mine]), self.names[mine], self.names[other], force)
        return worst

    def force(self, data: Any, number: int) -> float:
        """Return the normal force of a contact [N]."""
        import mujoco  # noqa: PLC0415 - only cells with several bodies need it

        force = np.zeros(6)
        mujoco.mj_contactForce(self._model, data, number, force)
        return float(abs(force[0]))

    def pressed(self, data: Any, arm: str) -> PeakContact:
        """Return what an arm, and what it holds, presses on: the depth of the deepest contact, the sum of all forces.

        Contacts are soft: their depth is that of the simulation.
        """
        if not data.ncon:
            return PeakContact(0.0, 0.0)
        import mujoco  # noqa: PLC0415 - only cells with several bodies need it

        mine = self._holders[data.contact.geom] == arm
        numbers = np.flatnonzero(mine[:, 0] != mine[:, 1]).tolist()
        total, wrench, worst = np.zeros(3), np.zeros(6), (0.0, "")
        for number in numbers:
            mujoco.mj_contactForce(self._model, data, number, wrench)
            force = wrench[:3] @ data.contact.frame[number].reshape(3, 3)
            # The force of a contact is that on its second geom.
            total += force if mine[number, 1] else -force
            other = int(data.contact.geom[number, 0 if mine[number, 1] else 1])
            worst = max(worst, (-float(data.contact.dist[number]), self.names[other]))
        return PeakContact(worst[0], float(np.linalg.norm(total)), worst[1])

    def gripped(self, data: Any, arm: str) -> str | None:
        """Return the part that both pads of an arm touch, or most of the lip of its cup; None without one."""
        if not data.ncon:
            return None
        geoms = data.contact.geom
        touches: Counter[str] = Counter()
        for pad in self._pads[arm]:
            first, second = geoms[:, 0] == pad, geoms[:, 1] == pad
            others = {*geoms[first, 1].tolist(), *geoms[second, 0].tolist()}
            touches.update({self.names[other] for other in others if self._parts[other]})
        needed = min(len(self._pads[arm]), LIP_TOUCHES)
        return min((part for part, count in touches.items() if count >= needed), default=None)

    def touching_arms(self, data: Any, part: str) -> tuple[str, ...]:
        """Return the arms whose links or grippers touch a part."""
        pairs = data.contact.geom
        mine = np.isin(pairs, self._part_geoms[part])
        others = {*pairs[mine[:, 0], 1].tolist(), *pairs[mine[:, 1], 0].tolist()}
        return tuple(sorted({self._owners[other] for other in others} - {_UNOWNED}))

    def overlaps(self, data: Any) -> list[Overlap]:
        """Return what stands inside other things."""
        found = []
        for number in range(data.ncon):
            a, b = data.contact.geom[number].tolist()
            depth = -float(data.contact.dist[number])
            if depth > OVERLAP:
                found.append(Overlap(self.names[a], self.names[b], depth))
        return found

    def tool_wrench(self, data: Any, arm: str) -> Array:
        """Return the wrench (6,) on the tool of an arm along the axes of the world, without the weight of the tool.

        Force [N] and moment about the tool point [N m], as a sensor between the arm and its tool reads them.
        """
        import mujoco  # noqa: PLC0415 - only cells with several bodies need it

        mujoco.mj_rnePostConstraint(self._model, data)
        tool = self._tools[arm]
        moment, force = -data.cfrc_int[tool, :3], -data.cfrc_int[tool, 3:]
        weight = self._model.body_subtreemass[tool] * self._model.opt.gravity
        # MuJoCo gives moments about the centre of mass of all that hangs together.
        centre = data.subtree_com[self._model.body_rootid[tool]] - data.xpos[tool]
        lever = data.subtree_com[tool] - data.xpos[tool]
        return np.concatenate([force - weight, moment + np.cross(centre, force) - np.cross(lever, weight)])

    def plate_depth(self, data: Any) -> float:
        """Return how deep the plane that yields is pressed [m]."""
        return float(-data.qpos[self._model.joint(PLATE).qposadr[0]])
