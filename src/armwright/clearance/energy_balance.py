"""The energy balance of a linkage with clearance: work of the drives, stored energy, losses."""

from __future__ import annotations

import attrs
import numpy as np

from armwright.arrays import Array
from armwright.clearance.equations import kinetic_energy, potential_energy, strain_energy
from armwright.clearance.placement import Placement
from armwright.clearance.simulation import Simulation

# The fields of a balance that are 0 without elastic bodies.
ENERGY_OF_RODS = ("strain", "damping_loss")


@attrs.frozen(kw_only=True, eq=False)
class EnergyBalance:
    """The energy of a run at each sample; the leading axes are those of the runs.

    Attributes:
        driven: (..., s) work of the drives [J].
        kinetic: (..., s) of all bodies [J].
        potential: (..., s) of gravity and loads, from the start [J].
        stored: (..., s) in the walls of the bearings [J].
        impact_loss: (..., s) lost in impacts [J].
        friction_loss: (..., s) lost in friction [J].
        strain: (..., s) with which elastic rods are bent and stretched [J].
        damping_loss: (..., s) lost in their damping [J].
    """

    driven: Array
    kinetic: Array
    potential: Array
    stored: Array
    impact_loss: Array
    friction_loss: Array
    strain: Array
    damping_loss: Array

    @property
    def imbalance(self) -> Array:
        """(..., s) the residual of the balance: the error of the integration [J]."""
        energy = self.kinetic + self.potential + self.stored + self.strain
        losses = self.impact_loss + self.friction_loss + self.damping_loss
        return np.asarray(energy - energy[..., :1] - self.driven + losses)


def energy_balance(simulation: Simulation) -> EnergyBalance:
    """Return the energy balance of a simulation."""
    linkage = simulation.scenario.linkage
    q, qd = ([x[..., i] for i in range(x.shape[-1])] for x in (simulation.q, simulation.qd))
    placement = Placement(linkage, q, qd)
    depths = np.maximum(simulation.depths, 0.0)
    payload = None if simulation.payloads is None else simulation.payloads[..., None]
    potential = np.asarray(potential_energy(placement, payload))
    return EnergyBalance(
        driven=simulation.works["driven"],
        kinetic=np.asarray(kinetic_energy(placement, payload)),
        potential=potential - potential[..., :1],
        stored=np.asarray((0.4 * simulation.stiffness[..., None, :] * depths**2.5).sum(axis=-1)),
        impact_loss=simulation.works["impact loss"],
        friction_loss=simulation.works["friction loss"],
        strain=np.broadcast_to(strain_energy(placement), potential.shape),
        damping_loss=simulation.works.get("damping loss", np.zeros_like(potential)),
    )
