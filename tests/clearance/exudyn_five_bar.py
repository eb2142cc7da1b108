"""The five-bar of the thesis for Exudyn: explicit Runge-Kutta of order 4, its own contact of a sphere in a hollow one.

The cranks are masses with one angle, so that nothing but contacts joins bodies. Our torques are its loads.
"""

from collections.abc import Callable
from typing import Any

import exudyn
import numpy as np
from exudyn import itemInterface

from armwright.clearance.linkage import Linkage

G = 9.81


def simulated(
    linkage: Linkage,
    q: np.ndarray,
    torques: Callable[[float], np.ndarray],
    stiffness: float,
    *,
    duration: float,
    step: float,
    every: float,
) -> np.ndarray:
    """(s, 2) where the tip is at multiples of ``every``, from coordinates (8) at rest."""
    system = exudyn.SystemContainer()
    mbs = system.AddSystem()
    bodies = {body.name: _body(mbs, body, linkage, q) for body in linkage.bodies}
    material = linkage.material
    for pin in linkage.pins:
        # The hollow one is the second.
        markers = [
            mbs.AddMarker(
                itemInterface.MarkerBodyRigid(bodyNumber=bodies[point.body], localPosition=_local(linkage, point))
            )
            for point in (pin.journal, pin.bearing)
        ]
        data = mbs.AddNode(itemInterface.NodeGenericData(initialCoordinates=[0.1, 0, 0, 0], numberOfDataCoordinates=4))
        mbs.AddObject(
            itemInterface.ObjectContactSphereSphere(
                markerNumbers=markers,
                nodeNumber=data,
                spheresRadii=[pin.journal_radius, pin.journal_radius + pin.clearance],
                isHollowSphere1=True,
                dynamicFriction=material.friction,
                frictionProportionalZone=1e-3,
                contactStiffness=stiffness,
                contactStiffnessExponent=1.5,
                restitutionCoefficient=material.restitution,
                minimumImpactVelocity=1e-3,
                # Carvalho and Martins.
                impactModel=2,
            )
        )
    for i, drive in enumerate(linkage.drives):
        node = mbs.GetObject(bodies[drive.body])["nodeNumber"]
        marker = mbs.AddMarker(itemInterface.MarkerNodeCoordinate(nodeNumber=node, coordinate=0))
        turn = _torque(torques, i)
        mbs.AddLoad(itemInterface.LoadCoordinate(markerNumber=marker, load=0.0, loadUserFunction=turn))
    tip = mbs.AddSensor(
        itemInterface.SensorBody(
            bodyNumber=bodies[linkage.tip.body],
            localPosition=_local(linkage, linkage.tip),
            outputVariableType=exudyn.OutputVariableType.Position,
            storeInternal=True,
            writeToFile=False,
        )
    )
    mbs.Assemble()
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
    mbs.SolveDynamic(settings, solverType=exudyn.DynamicSolverType.RK44)
    return np.asarray(mbs.GetSensorStoredData(tip)[:, 1:3])


def _torque(torques: Callable[[float], np.ndarray], number: int) -> Any:
    return lambda _mbs, t, _load: float(torques(t)[number])


def _local(linkage: Linkage, body_point: Any) -> list[float]:
    """A point from the centre of a free body, or from the pin of a crank."""
    origin = linkage.body(body_point.body).centre if linkage.joint(body_point.body) is None else 0.0
    return [*(linkage.point(body_point) - origin), 0.0]


def _body(mbs: Any, body: Any, linkage: Linkage, q: np.ndarray) -> int:
    numbers = {coordinate.kind: i for i, coordinate in enumerate(linkage.coordinates) if coordinate.body == body.name}
    joint = linkage.joint(body.name)
    angle = float(q[numbers["angle"]]) + linkage.zero
    weights = [np.array((0.0, -body.mass * G, 0.0))]
    positions = [list(body.centre)]
    if joint is None:
        node = mbs.AddNode(
            itemInterface.NodeRigidBody2D(referenceCoordinates=[*map(float, q[[numbers["x"], numbers["y"]]]), angle])
        )
        item = mbs.AddObject(itemInterface.ObjectRigidBody2D(mass=body.mass, inertia=body.inertia, nodeNumber=node))
        positions = [[0.0, 0.0]]
    else:
        # Of a crank the inertia about its pin counts.
        node = mbs.AddNode(itemInterface.Node1D(referenceCoordinates=[0.0], initialCoordinates=[angle]))
        item = mbs.AddObject(
            itemInterface.ObjectRotationalMass1D(
                inertia=body.inertia + body.mass * float(body.centre @ body.centre),
                nodeNumber=node,
                referencePosition=[*linkage.point(joint.on), 0.0],
            )
        )
    for load in linkage.loads:
        if load.point.body == body.name:
            positions.append(_local(linkage, load.point)[:2])
            weights.append(np.array((*load.force, 0.0)))
    for position, weight in zip(positions, weights, strict=True):
        marker = mbs.AddMarker(
            itemInterface.MarkerBodyPosition(bodyNumber=item, localPosition=[*map(float, position), 0.0])
        )
        mbs.AddLoad(itemInterface.Force(markerNumber=marker, loadVector=list(map(float, weight))))
    return int(item)
