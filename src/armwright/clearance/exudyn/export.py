"""The export of a linkage with clearance and its path to Exudyn: a script that runs as it is, and its data."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from importlib import resources
from typing import Any

import numpy as np

from armwright.arrays import floats
from armwright.clearance.contact import ImpactLaw
from armwright.clearance.drive_tables import csv_text, drive_table
from armwright.clearance.elastic_rod import refuse_rods
from armwright.clearance.linkage import GROUND, Body, BodyPoint, Guide, Linkage
from armwright.clearance.placement import Placement
from armwright.clearance.scenario import Scenario
from armwright.clearance.settings import contact_stiffness
from armwright.clearance.simulation import Simulation, simulate
from armwright.errors import InvalidValueError

# The only impact law that both programs have.
IMPACT_LAW: ImpactLaw = "carvalho-martins"


def exudyn_files(scenario: Scenario) -> dict[str, str]:
    """Return the files of a linkage on its path for Exudyn, by name: script, model, drives, and our run to compare.

    Args:
        scenario: with the impact law ``IMPACT_LAW``, friction that is linear in the velocity of the surface, drives
            without a controller, and no body that is driven along a guide.

    Raises:
        InvalidValueError: Exudyn has no counterpart for something, or a body is elastic.
    """
    refuse_rods("export to Exudyn", scenario.linkage.rods)
    _check(scenario)
    linkage = scenario.linkage
    run = simulate(scenario, linkage.clearance_array(None))
    heads = [f"{drive.body}_{'rad' if drive.kind == 'motion' else 'Nm'}" for drive in linkage.drives]
    angles = scenario.ideal.q[:, list(linkage.driven)]
    return {
        "run_linkage.py": resources.files("armwright.clearance.exudyn").joinpath("run_linkage.py").read_text("utf-8"),
        "linkage.json": json.dumps(_model(scenario, run), indent=2) + "\n",
        "drives.csv": csv_text(["time_s", *heads], drive_table(scenario, angles)),
        "reference.csv": csv_text(["time_s", "tip_x_m", "tip_y_m"], np.column_stack([run.time, run.tip])),
    }


def _check(scenario: Scenario) -> None:
    """Refuse what Exudyn has no counterpart for."""
    settings, linkage = scenario.settings, scenario.linkage
    wrong = [
        text
        for text, bad in (
            (f"impact law {settings.impact}; expected {IMPACT_LAW}", settings.impact != IMPACT_LAW),
            (f"law of friction {settings.friction.law}; expected linear", settings.friction.law != "linear"),
            ("sliding velocity of the centre; expected surface", settings.friction.velocity != "surface"),
            ("a controller; expected control by effort", settings.control != "effort"),
        )
        if bad
    ]
    for drive in linkage.drives:
        joint = linkage.joint(drive.body)
        if isinstance(joint, Guide):
            wrong.append(f"a drive of {drive.body}, which slides on a guide; expected drives of pins")
        elif drive.kind == "motion" and joint is not None and joint.on.body != GROUND:
            wrong.append(f"a prescribed motion of {drive.body}, which is not on the ground")
    if wrong:
        raise InvalidValueError(f"Exudyn has no counterpart for {wrong[0]}")


def _model(scenario: Scenario, run: Simulation) -> dict[str, Any]:
    """Return the linkage as the script reads it: all bodies free, with points from their centres."""
    linkage, settings = scenario.linkage, scenario.settings
    q, qd = (list(floats(x[0], "start")) for x in (run.q, run.qd))
    K = contact_stiffness(linkage, linkage.clearance_array(None))
    return {
        "bodies": {body.name: _body(Placement(linkage, q, qd), body) for body in linkage.bodies},
        "joints": list(_joints(linkage)),
        "pins": [
            {
                "bearing": _end(linkage, pin.bearing),
                "journal": _end(linkage, pin.journal),
                "radius": pin.journal_radius,
                "clearance": pin.clearance,
                "stiffness": float(k),
            }
            for pin, k in zip(linkage.pins, K, strict=True)
        ],
        "loads": [
            *(
                {"body": b.name, "point": [0.0, 0.0], "force": (b.mass * linkage.gravity).tolist()}
                for b in linkage.bodies
            ),
            *({**_end(linkage, load.point), "force": load.force.tolist()} for load in linkage.loads),
        ],
        "drives": [
            {"body": drive.body, "kind": drive.kind, "carrier": linkage.rotation_carrier(drive.body) or GROUND}
            for drive in linkage.drives
        ],
        "tip": _end(linkage, linkage.tip),
        "friction": linkage.material.friction,
        "restitution": linkage.material.restitution,
        "threshold": settings.threshold,
        "duration": scenario.path.duration,
        "step": scenario.h,
        "sample": scenario.stride * scenario.h,
    }


def _body(placement: Placement, body: Body) -> dict[str, Any]:
    """Return a body with the position of its centre and its angle at the start, and their rates."""
    centre, frame = placement.centre(body), placement.frames[body.name]
    return {
        "mass": body.mass,
        # A body that only slides needs none, and Exudyn one above 0.
        "inertia": body.inertia or 1e-6,
        "start": [float(centre.position.x), float(centre.position.y), math.atan2(frame.axis.y, frame.axis.x)],
        "speed": [float(centre.velocity.x), float(centre.velocity.y), float(frame.spin)],
    }


def _joints(linkage: Linkage) -> Iterator[dict[str, Any]]:
    """Give the ideal joints: pins, and guides with their axis, and their normal as the sliding body has it."""
    for joint in linkage.joints:
        ends = {"on": _end(linkage, joint.on), "end": _end(linkage, BodyPoint(joint.body, joint.point))}
        if isinstance(joint, Guide):
            across = joint.direction - joint.angle + math.pi / 2
            axis, normal = ([math.cos(a), math.sin(a)] for a in (joint.direction, across))
            yield {"kind": "guide", **ends, "axis": axis, "normal": normal}
        else:
            yield {"kind": "pin", **ends}


def _end(linkage: Linkage, point: BodyPoint) -> dict[str, Any]:
    """Return a point of a body from its centre; on the ground from the origin."""
    centre = np.zeros(2) if point.body == GROUND else linkage.body(point.body).centre
    return {"body": point.body, "point": (linkage.point(point) - centre).tolist()}
