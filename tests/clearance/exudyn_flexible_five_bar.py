"""The five-bar of the thesis with elastic rods for Exudyn: cable elements of the absolute nodal coordinate formulation.

A rod is a uniform beam without inertia of its sections and without damping: stretch and bending, at any deflection. Its
ends are journals and bearings like those of a rigid one; what friction does at a radius turns the section there.
"""

from functools import partial
from typing import Any

import attrs
import exudyn
import numpy as np
from exudyn import itemInterface

from armwright.clearance.linkage import Body, Linkage
from clearance.exudyn_five_bar import G, Points, Torques, assembled, followed, start_of

RODS = ("link2", "link3")


@attrs.frozen(kw_only=True)
class Rod:
    """A uniform beam: a steel square of 12.521 mm that weighs 0.8 kg.

    Attributes:
        length: [m].
        mass: [kg].
        bending: EI [N m²].
        axial: EA [N].
        elements: into how many it is divided.
    """

    length: float = 0.65
    mass: float = 0.8
    bending: float = 424.04
    axial: float = 4.99e7 * 0.65
    elements: int = 8

    @property
    def inertia(self) -> float:
        """About its middle [kg m²]; 0.12 % below the 0.0282 kg m² of the catalogue, which are rounded."""
        return self.mass * self.length**2 / 12


def with_uniform_rods(linkage: Linkage, rod: Rod) -> Linkage:
    """The arm whose rigid rods have the inertia of the elastic ones."""
    bodies = [attrs.evolve(body, inertia=rod.inertia) if body.name in RODS else body for body in linkage.bodies]
    return attrs.evolve(linkage, bodies=bodies)


def simulated_elastic(
    linkage: Linkage,
    q: np.ndarray,
    torques: Torques,
    stiffness: np.ndarray,
    rod: Rod,
    *,
    duration: float,
    step: float,
    every: float,
    bent: bool = True,
) -> np.ndarray:
    """(s, 2) where the tip is at multiples of ``every``.

    Args:
        linkage: the arm; of its rods only the points count.
        q: (8) coordinates of the start with rigid rods, at rest.
        torques: of the cranks at a time.
        stiffness: (p) of the contacts.
        rod: each of the two.
        duration: [s].
        step: [s].
        every: [s].
        bent: whether it starts from the equilibrium of its elastic rods, with the cranks at the angles of ``q``;
            otherwise with the straight rods of ``q``, which begin to sag.
    """
    builders = dict.fromkeys(RODS, partial(_elastic, rod=rod))
    model = assembled(linkage, q, stiffness, torques=torques, builders=builders)
    if bent:
        model.system.systemData.SetODE2Coordinates(
            _equilibrium(linkage, q, stiffness, rod), configuration=exudyn.ConfigurationType.Initial
        )
    return followed(model, duration=duration, step=step, every=every)


def _equilibrium(linkage: Linkage, q: np.ndarray, stiffness: np.ndarray, rod: Rod) -> Any:
    """The coordinates of Exudyn at rest under gravity and loads, with locked cranks and no friction."""
    smooth = attrs.evolve(linkage, material=attrs.evolve(linkage.material, friction=0.0))
    builders = dict.fromkeys(RODS, partial(_elastic, rod=rod))
    model = assembled(smooth, q, stiffness, torques=None, builders=builders)
    data = np.array(model.system.systemData.GetDataCoordinates(configuration=exudyn.ConfigurationType.Initial))
    # Of each contact the first is its gap: journals that touch, or nothing would hold them.
    data[::4] = -1e-6
    model.system.systemData.SetDataCoordinates(data, configuration=exudyn.ConfigurationType.Initial)
    settings = exudyn.SimulationSettings()
    settings.staticSolver.verboseMode = 0
    # Forces of 1e-7 N are the rounding of stretched elements.
    settings.staticSolver.newton.relativeTolerance = 1e-7
    settings.staticSolver.newton.absoluteTolerance = 2e-6
    settings.staticSolver.newton.numericalDifferentiation.forODE2 = True
    settings.staticSolver.newton.numericalDifferentiation.relativeEpsilon = 1e-7
    settings.staticSolver.discontinuous.maxIterations = 1
    settings.staticSolver.discontinuous.ignoreMaxIterations = True
    settings.solution.file.write = False
    model.system.SolveStatic(settings)
    return model.system.systemData.GetODE2Coordinates()


def _elastic(mbs: Any, body: Body, linkage: Linkage, q: np.ndarray, rod: Rod) -> Points:
    x, y, angle = start_of(linkage, body.name, q)
    axis = np.array((np.cos(angle), np.sin(angle)))
    first = np.array((x, y)) - axis * rod.length / 2
    part = rod.length / rod.elements
    nodes = [
        mbs.AddNode(itemInterface.NodePoint2DSlope1(referenceCoordinates=[*(first + i * part * axis), *axis]))
        for i in range(rod.elements + 1)
    ]
    elements = [
        mbs.AddObject(
            itemInterface.ObjectANCFCable2D(
                length=part,
                massPerLength=rod.mass / rod.length,
                bendingStiffness=rod.bending,
                axialStiffness=rod.axial,
                nodeNumbers=nodes[i : i + 2],
            )
        )
        for i in range(rod.elements)
    ]
    for element in elements:
        marker = mbs.AddMarker(itemInterface.MarkerBodyMass(bodyNumber=element))
        mbs.AddLoad(itemInterface.LoadMassProportional(markerNumber=marker, loadVector=[0.0, -G, 0.0]))
    ends = {0.0: (int(elements[0]), [0.0, 0.0, 0.0]), rod.length: (int(elements[-1]), [part, 0.0, 0.0])}
    return {name: ends[float(point[0])] for name, point in body.points.items()}
