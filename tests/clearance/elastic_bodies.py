"""Linkages with elastic rods that closed forms describe."""

from collections.abc import Sequence

import attrs

from armwright.clearance.elastic_rod import Elasticity
from armwright.clearance.linkage import Body, BodyPoint, ClearancePin, Drive, Guide, Linkage, Load, Pin
from armwright.clearance.reader import load_linkage

# The rod of the thesis' arm as a bar of steel with a solid square section.
MASS, LENGTH, YOUNG, DENSITY = 0.8, 0.65, 207e9, 7850.0
AREA = MASS / (DENSITY * LENGTH)
SECOND_MOMENT = AREA**2 / 12
EI = YOUNG * SECOND_MOMENT
GROUND = Body(name="ground", points={"A": (0, 0), "B": (LENGTH, 0)})


def bar(*, modes: int = 3, hub: float = 0.0, stiffer: float = 1.0, damping: float = 0.01) -> Body:
    """The rod with the ends A and B and its middle M, and a hub of some mass at each end."""
    inertia = MASS * LENGTH**2 / 12 + 2 * hub * (LENGTH / 2) ** 2
    return Body(
        name="rod",
        mass=MASS + 2 * hub,
        inertia=inertia,
        centre=(LENGTH / 2, 0),
        points={"A": (0, 0), "M": (LENGTH / 2, 0), "B": (LENGTH, 0)},
        elastic=Elasticity(
            ends=("A", "B"),
            area=AREA * stiffer,
            second_moment=SECOND_MOMENT * stiffer,
            young=YOUNG,
            modes=modes,
            damping=damping,
        ),
    )


def on_rollers(rod: Body, *, gravity: float = 9.81, push: float = 0.0) -> Linkage:
    """A horizontal rod on a pin and on a roller, which some force pushes towards the pin; its tip is its middle."""
    return Linkage(
        name="bridge",
        ground=GROUND,
        bodies=[rod, Body(name="roller", mass=1e-9, points={"P": (0, 0)})],
        joints=[
            Pin(body="rod", point="A", on=BodyPoint("ground", "A")),
            Guide(body="roller", point="P", on=BodyPoint("ground", "B")),
        ],
        pins=[
            ClearancePin(
                name="P",
                bearing=BodyPoint("roller", "P"),
                journal=BodyPoint("rod", "B"),
                clearance=0.0,
                journal_radius=0.01,
            )
        ],
        drives=[],
        loads=[Load(point=BodyPoint("roller", "P"), force=(-push, 0))],
        tip=BodyPoint("rod", "M"),
        gravity=(0, -gravity),
    )


def cantilever(rod: Body, *, gravity: float = 0.0, force: Sequence[float] = (0.0, 0.0)) -> Linkage:
    """A horizontal rod held by a drive, with a force at its tip."""
    return Linkage(
        name="cantilever",
        ground=GROUND,
        bodies=[rod],
        joints=[Pin(body="rod", point="A", on=BodyPoint("ground", "A"))],
        pins=[],
        drives=[Drive(body="rod", kind="motion")],
        loads=[Load(point=BodyPoint("rod", "B"), force=force)],
        tip=BodyPoint("rod", "B"),
        gravity=(0, -gravity),
    )


def elastic_five_bar(*, stiffer: float = 1.0, modes: int = 3, bodies: Sequence[str] = ("link2", "link3")) -> Linkage:
    """The five-bar with rods of steel with a solid square section."""
    linkage = load_linkage("five-bar")

    def elastic(body: Body) -> Elasticity:
        return Elasticity(
            ends=tuple(body.points),
            area=AREA * stiffer,
            second_moment=SECOND_MOMENT * stiffer,
            young=YOUNG,
            modes=modes,
        )

    return attrs.evolve(
        linkage,
        bodies=[attrs.evolve(b, elastic=elastic(b)) if b.name in bodies else b for b in linkage.bodies],
    )
