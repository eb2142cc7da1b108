"""The five-bar of the thesis for Exudyn: explicit Runge-Kutta of order 4, its own contact of a sphere in a hollow one.

The cranks are masses with one angle, so that nothing but contacts joins bodies. Our torques are its loads.
"""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple, TypeAlias

import exudyn
import numpy as np
from exudyn import itemInterface

from armwright.clearance.linkage import Body, Linkage
from armwright.clearance.scenario import Scenario

G = 9.81

Torques: TypeAlias = Callable[[float], np.ndarray]
# By its name each point of a body: an item of Exudyn, and the position on it.
Points: TypeAlias = dict[str, tuple[int, list[float]]]
# Adds a body at coordinates, with its weight.
Builder: TypeAlias = Callable[[Any, Body, Linkage, np.ndarray], Points]


class Model(NamedTuple):
    """A system of Exudyn, what keeps it alive, and the number of its sensor at the tip."""

    system: Any
    container: Any
    tip: int


def simulated(
    linkage: Linkage,
    q: np.ndarray,
    torques: Torques,
    stiffness: np.ndarray,
    *,
    duration: float,
    step: float,
    every: float,
) -> np.ndarray:
    """(s, 2) where the tip is at multiples of ``every``, from coordinates (8) at rest."""
    return followed(assembled(linkage, q, stiffness, torques=torques), duration=duration, step=step, every=every)


def efforts_of(scenario: Scenario) -> Torques:
    """Our torques of the cranks at a time, linear between steps."""
    efforts, h = scenario.ideal.efforts, scenario.h

    def torques(t: float) -> np.ndarray:
        i = min(int(t / h), len(efforts) - 2)
        return np.asarray(efforts[i] + (t / h - i) * (efforts[i + 1] - efforts[i]))

    return torques


def assembled(
    linkage: Linkage,
    q: np.ndarray,
    stiffness: np.ndarray,
    *,
    torques: Torques | None,
    builders: Mapping[str, Builder] | None = None,
) -> Model:
    """The arm at coordinates, with contacts of a stiffness (p); without torques its cranks are locked.

    Args:
        linkage: the arm.
        q: (8) coordinates.
        stiffness: (p) of the contacts.
        torques: of the cranks at a time.
        builders: of bodies that are not rigid, by name.
    """
    container = exudyn.SystemContainer()
    mbs = container.AddSystem()
    builders = builders or {}
    points = {body.name: builders.get(body.name, _rigid)(mbs, body, linkage, q) for body in linkage.bodies}
    material = linkage.material
    for pin, K in zip(linkage.pins, stiffness, strict=True):
        # The hollow one is the second.
        markers = [_marker(mbs, points[end.body][end.point], rigid=True) for end in (pin.journal, pin.bearing)]
        data = mbs.AddNode(itemInterface.NodeGenericData(initialCoordinates=[0.1, 0, 0, 0], numberOfDataCoordinates=4))
        mbs.AddObject(
            itemInterface.ObjectContactSphereSphere(
                markerNumbers=markers,
                nodeNumber=data,
                spheresRadii=[pin.journal_radius, pin.journal_radius + pin.clearance],
                isHollowSphere1=True,
                dynamicFriction=material.friction,
                frictionProportionalZone=1e-3,
                contactStiffness=float(K),
                contactStiffnessExponent=1.5,
                restitutionCoefficient=material.restitution,
                minimumImpactVelocity=1e-3,
                # Carvalho and Martins.
                impactModel=2,
            )
        )
    for load in linkage.loads:
        _push(mbs, points[load.point.body][load.point.point], load.force)
    still = mbs.AddNode(itemInterface.NodePointGround())
    for i, drive in enumerate(linkage.drives):
        node = mbs.GetObject(next(iter(points[drive.body].values()))[0])["nodeNumber"]
        angle = mbs.AddMarker(itemInterface.MarkerNodeCoordinate(nodeNumber=node, coordinate=0))
        if torques is None:
            markers = [mbs.AddMarker(itemInterface.MarkerNodeCoordinate(nodeNumber=still, coordinate=0)), angle]
            at = _angle(linkage, drive.body, q)
            mbs.AddObject(itemInterface.ObjectConnectorCoordinate(markerNumbers=markers, offset=at))
        else:
            turn = _torque(torques, i)
            mbs.AddLoad(itemInterface.LoadCoordinate(markerNumber=angle, load=0.0, loadUserFunction=turn))
    item, position = points[linkage.tip.body][linkage.tip.point]
    tip = mbs.AddSensor(
        itemInterface.SensorBody(
            bodyNumber=item,
            localPosition=position,
            outputVariableType=exudyn.OutputVariableType.Position,
            storeInternal=True,
            writeToFile=False,
        )
    )
    mbs.Assemble()
    return Model(mbs, container, int(tip))


def followed(model: Model, *, duration: float, step: float, every: float) -> np.ndarray:
    """(s, 2) where the tip is at multiples of ``every``."""
    settings = exudyn.SimulationSettings()
    settings.timeIntegration.endTime = duration
    settings.timeIntegration.numberOfSteps = round(duration / step)
    settings.timeIntegration.adaptiveStep = False
    settings.timeIntegration.discontinuous.maxIterations = 1
    settings.timeIntegration.discontinuous.ignoreMaxIterations = True
    settings.timeIntegration.verboseMode = 0
    settings.solution.file.write = False
    settings.solution.sensors.writePeriod = every
    settings.show.statistics = False
    model.system.SolveDynamic(settings, solverType=exudyn.DynamicSolverType.RK44)
    return np.asarray(model.system.GetSensorStoredData(model.tip)[:, 1:3])


def start_of(linkage: Linkage, body: str, q: np.ndarray) -> list[float]:
    """Where a free body is: x and y of its centre, and its angle from the axis x."""
    numbers = {coordinate.kind: i for i, coordinate in enumerate(linkage.coordinates) if coordinate.body == body}
    return [float(q[numbers["x"]]), float(q[numbers["y"]]), _angle(linkage, body, q)]


def _angle(linkage: Linkage, body: str, q: np.ndarray) -> float:
    return next(float(q[i]) for i, c in enumerate(linkage.coordinates) if c == (body, "angle")) + linkage.zero


def _torque(torques: Torques, number: int) -> Any:
    return lambda _mbs, t, _load: float(torques(t)[number])


def _marker(mbs: Any, place: tuple[int, list[float]], *, rigid: bool) -> Any:
    kind = itemInterface.MarkerBodyRigid if rigid else itemInterface.MarkerBodyPosition
    return mbs.AddMarker(kind(bodyNumber=place[0], localPosition=place[1]))


def _push(mbs: Any, place: tuple[int, list[float]], force: np.ndarray) -> None:
    vector = [*map(float, force), 0.0]
    mbs.AddLoad(itemInterface.Force(markerNumber=_marker(mbs, place, rigid=False), loadVector=vector))


def _rigid(mbs: Any, body: Body, linkage: Linkage, q: np.ndarray) -> Points:
    joint = linkage.joint(body.name)
    origin = body.centre
    if joint is None:
        node = mbs.AddNode(itemInterface.NodeRigidBody2D(referenceCoordinates=start_of(linkage, body.name, q)))
        item = mbs.AddObject(itemInterface.ObjectRigidBody2D(mass=body.mass, inertia=body.inertia, nodeNumber=node))
    else:
        # Of a crank the inertia about its pin counts, and its points are measured from there.
        origin = np.zeros(2)
        angle = _angle(linkage, body.name, q)
        node = mbs.AddNode(itemInterface.Node1D(referenceCoordinates=[0.0], initialCoordinates=[angle]))
        item = mbs.AddObject(
            itemInterface.ObjectRotationalMass1D(
                inertia=body.inertia + body.mass * float(body.centre @ body.centre),
                nodeNumber=node,
                referencePosition=[*linkage.point(joint.on), 0.0],
            )
        )

    def place(point: np.ndarray) -> tuple[int, list[float]]:
        return int(item), [*map(float, point - origin), 0.0]

    _push(mbs, place(body.centre), np.array((0.0, -body.mass * G)))
    return {name: place(point) for name, point in body.points.items()}
