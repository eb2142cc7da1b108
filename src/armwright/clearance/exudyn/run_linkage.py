"""Simulate a linkage with joint clearance in Exudyn, as ``python run_linkage.py`` does.

Reads linkage.json and drives.csv beside it, writes tip.csv, and prints how far the tip is from that of reference.csv.
Needs exudyn and numpy.
"""

import json
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import exudyn
import numpy as np
from exudyn import itemInterface

FOLDER = Path(__file__).parent


def simulate(folder: Path = FOLDER) -> Any:
    """Simulate the linkage of a folder; return (s, 3) time and position of its tip, and write them to tip.csv."""
    model = json.loads((folder / "linkage.json").read_text())
    table = np.loadtxt(folder / "drives.csv", delimiter=",", skiprows=1, ndmin=2)
    container = exudyn.SystemContainer()
    system = container.AddSystem()
    ground = system.AddObject(itemInterface.ObjectGround())
    bodies, nodes = {"ground": ground}, {}
    for name, body in model["bodies"].items():
        nodes[name] = system.AddNode(
            itemInterface.NodeRigidBody2D(referenceCoordinates=body["start"], initialVelocities=body["speed"])
        )
        bodies[name] = system.AddObject(
            itemInterface.ObjectRigidBody2D(mass=body["mass"], inertia=body["inertia"], nodeNumber=nodes[name])
        )

    def marker(end: dict[str, Any], *, rigid: bool = True) -> Any:
        kind = itemInterface.MarkerBodyRigid if rigid else itemInterface.MarkerBodyPosition
        return system.AddMarker(kind(bodyNumber=bodies[end["body"]], localPosition=[*end["point"], 0.0]))

    for joint in model["joints"]:
        ends = [marker(joint["on"]), marker(joint["end"])]
        if joint["kind"] == "pin":
            system.AddObject(itemInterface.ObjectJointRevolute2D(markerNumbers=ends))
        else:
            system.AddObject(
                itemInterface.ObjectJointPrismatic2D(
                    markerNumbers=ends, axisMarker0=[*joint["axis"], 0.0], normalMarker1=[*joint["normal"], 0.0]
                )
            )
    for pin in model["pins"]:
        data = system.AddNode(
            itemInterface.NodeGenericData(initialCoordinates=[0.1, 0, 0, 0], numberOfDataCoordinates=4)
        )
        system.AddObject(
            itemInterface.ObjectContactSphereSphere(
                # The hollow one is the second.
                markerNumbers=[marker(pin["journal"]), marker(pin["bearing"])],
                nodeNumber=data,
                spheresRadii=[pin["radius"], pin["radius"] + pin["clearance"]],
                isHollowSphere1=True,
                contactStiffness=pin["stiffness"],
                contactStiffnessExponent=1.5,
                dynamicFriction=model["friction"],
                frictionProportionalZone=model["threshold"],
                restitutionCoefficient=model["restitution"],
                minimumImpactVelocity=1e-3,
                # Carvalho and Martins.
                impactModel=2,
            )
        )
    for push in model["loads"]:
        system.AddLoad(itemInterface.Force(markerNumber=marker(push, rigid=False), loadVector=[*push["force"], 0.0]))
    still = system.AddNode(itemInterface.NodePointGround())
    for column, drive in enumerate(model["drives"], 1):
        value = partial(np.interp, xp=table[:, 0], fp=table[:, column])
        if drive["kind"] == "effort":
            for body, sign in ((drive["body"], 1.0), (drive["carrier"], -1.0)):
                if body != "ground":
                    system.AddLoad(
                        itemInterface.Torque(
                            markerNumber=marker({"body": body, "point": [0.0, 0.0]}),
                            loadVectorUserFunction=turning(value, sign),
                        )
                    )
        else:
            coordinates = [
                system.AddMarker(itemInterface.MarkerNodeCoordinate(nodeNumber=node, coordinate=number))
                for node, number in ((still, 0), (nodes[drive["body"]], 2))
            ]
            system.AddObject(
                itemInterface.ObjectConnectorCoordinate(
                    markerNumbers=coordinates,
                    offsetUserFunction=turned(value),
                )
            )
    tip = system.AddSensor(
        itemInterface.SensorBody(
            bodyNumber=bodies[model["tip"]["body"]],
            localPosition=[*model["tip"]["point"], 0.0],
            outputVariableType=exudyn.OutputVariableType.Position,
            storeInternal=True,
            writeToFile=False,
        )
    )
    system.Assemble()
    settings = exudyn.SimulationSettings()
    settings.timeIntegration.endTime = model["duration"]
    settings.timeIntegration.numberOfSteps = round(model["duration"] / model["step"])
    settings.timeIntegration.adaptiveStep = True
    settings.timeIntegration.minimumStepSize = 1e-10
    settings.timeIntegration.discontinuous.maxIterations = 1
    settings.timeIntegration.discontinuous.ignoreMaxIterations = True
    settings.timeIntegration.verboseMode = 0
    settings.timeIntegration.generalizedAlpha.spectralRadius = 0.9
    settings.solution.file.write = False
    settings.solution.sensors.writePeriod = model["sample"]
    settings.show.statistics = False
    system.SolveDynamic(settings)
    rows = np.array(system.GetSensorStoredData(tip))[:, :3]
    np.savetxt(folder / "tip.csv", rows, delimiter=",", header="time_s,tip_x_m,tip_y_m", comments="")
    return rows


def turning(value: Callable[[float], Any], sign: float) -> Callable[..., list[float]]:
    """Return the torque of a drive as Exudyn asks for it."""
    return lambda _system, t, _load: [0.0, 0.0, sign * float(value(t))]


def turned(value: Callable[[float], Any]) -> Callable[..., float]:
    """Return the angle of a drive from its start as Exudyn asks for it."""
    return lambda _system, t, _item, _offset: float(value(t) - value(0.0))


if __name__ == "__main__":
    run = simulate()
    reference = np.loadtxt(FOLDER / "reference.csv", delimiter=",", skiprows=1)
    count = min(len(run), len(reference))
    apart = np.linalg.norm(run[:count, 1:] - reference[:count, 1:], axis=1)
    print(f"largest distance from the reference: {apart.max() * 1e6:.3f} um at {run[apart.argmax(), 0]:.4f} s")
