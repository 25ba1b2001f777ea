"""A map's torque against the shaft's."""

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from drivers.interfaces.text import Text, text
from procedures.core.curves import curve
from procedures.estimation.fitting.fit import FloatArray
from procedures.estimation.flux.estimator import FluxMapEstimate
from procedures.estimation.flux.flux_map import GainLimits, MeasuredFluxMap, of_gains
from procedures.estimation.flux.gain_ratio import GainRatio
from procedures.techniques.maps.estimates import gains_of
from procedures.techniques.maps.readings import MapReadings

#: The warning of torques that differ.
TORQUE_DIFFERS = "torque-differs"
#: Below this share of the largest torque a reading says nothing of a ratio.
_SMALL = 0.1
_LEAST = 4


@dataclass(frozen=True)
class ShaftTorque:
    """The shaft's torque over the map's: `ratio` with its standard uncertainty, `scatter` the part of that which no gain explains;
    torques (n,) in N·m behind it, and the stated limits of the map's gains.
    """

    ratio: float
    scatter: float
    standard_uncertainty: float
    of_map: FloatArray
    of_shaft: FloatArray
    gains: GainLimits

    def as_dict(self) -> dict[str, Any]:
        """Return it for the findings."""
        return {
            "ratio": self.ratio,
            "scatter": self.scatter,
            "readings": curve(map_torque=self.of_map, shaft_torque=self.of_shaft),
            "standard_uncertainty": self.standard_uncertainty,
        }

    @property
    def contradiction(self) -> Text | None:
        """The message if the two torques differ by more than both uncertainties; None if they do not."""
        if not GainRatio(self.ratio, self.standard_uncertainty).contradicted:
            return None
        return text(
            "the shaft torque is {ratio:.4f} times the torque by the map, known to ±{expanded:.2g}: check "
            "the gains of currents, voltages and torque, a filter of the torque that is not stated, the pole pairs, and peak against rms",
            ratio=self.ratio,
            expanded=2.0 * self.standard_uncertainty,
        )

    def held_by(self, flux_map: MeasuredFluxMap) -> MeasuredFluxMap:
        """Return the map with gains of voltage and current whose limits hold the difference, for either may be what is wrong; the map as
        it is where chance explains it.
        """
        excess = GainRatio(self.ratio, self.standard_uncertainty).excess
        if excess == 0.0:
            return flux_map
        slopes = flux_map.surface.slopes(flux_map.points)
        voltage, current = (math.hypot(stated, excess) for stated in (self.gains.voltage, self.gains.current))
        wider = of_gains(flux_map.points, flux_map.flux, slopes, voltage=voltage, current=current)
        return replace(flux_map, shared={**flux_map.shared, **wider})


def shaft_torque(found: FluxMapEstimate, taken: MapReadings, pole_pairs: float) -> ShaftTorque | None:
    """Return the shaft's torque against that of the map with the magnets as they were at each reading; None where too few have one.

    What the shaft takes at no current, friction and iron, is that of each direction by itself.
    """
    flux_map, planned, torque = found.map, taken.planned, taken.torques
    directions = np.array([point.planned.direction for point in taken.points])
    idle = ~np.any(planned, axis=1)
    places = np.array([_place(flux_map, *each) for each in planned])
    sides = np.where(planned[:, 1] < 0.0, -1.0, 1.0) if flux_map.symmetric else np.ones(len(planned))
    at = flux_map.points[places]
    magnets = _of_magnets(found, at)
    of_map = (flux_map.torque(pole_pairs)[places] + 1.5 * pole_pairs * _across(magnets, at)) * sides
    of_shaft = np.full_like(of_map, np.nan)
    for direction in (1, -1):
        same = directions == direction
        if np.any(same & idle):
            of_shaft[same] = torque[same] - float(np.mean(torque[same & idle]))
    used = np.isfinite(of_shaft) & (np.abs(of_map) > _SMALL * float(np.max(np.abs(of_map))))
    if np.count_nonzero(used) < _LEAST:
        return None
    # Iron takes a current across the flux, with the speed's sign: what that is in torque, beyond what it is without a current.
    psi = flux_map.flux[places] + magnets
    lost = np.column_stack((psi[:, 1], -psi[:, 0]))
    less = np.einsum("nab,nb->na", flux_map.surface.slopes(at), lost)
    by_iron = 1.5 * pole_pairs * (_across(psi, lost) + _across(less, at))
    braking = directions * (by_iron - float(np.mean(by_iron[idle])))
    design = np.column_stack((of_map, braking))[used]
    (ratio, brake), *_ = np.linalg.lstsq(design, of_shaft[used], rcond=None)
    left = of_shaft[used] - design @ (ratio, brake)
    ratio, freedom = float(ratio), np.count_nonzero(used) - 2
    scatter = math.sqrt(float(left @ left) / freedom * float(np.linalg.pinv(design.T @ design)[0, 0]))
    accuracy = taken.points[-1].shaft.torque_accuracy
    # Both gains go into the map's torque whole, the current's by the points' places too, whatever saturates.
    gains = gains_of(taken)
    limits = (accuracy.gain or accuracy.offset / float(np.max(np.abs(torque))), gains.voltage, gains.current)
    spread = math.hypot(scatter, *(limit / math.sqrt(3.0) for limit in limits))
    return ShaftTorque(ratio, scatter, spread, of_map[used], of_shaft[used], gains)


def _of_magnets(found: FluxMapEstimate, at: FloatArray) -> FloatArray:
    """Return by how much flux linkages (n, 2) at the readings' currents (n, 2) are other than the map's: its magnets have warmed up."""
    surface = found.map.surface
    shift = found.fit.magnet_change / float(surface.slopes(np.zeros((1, 2)))[0, 0, 0])
    return surface(at + np.column_stack((shift, np.zeros_like(shift)))) - surface(at)


def _across(first: FloatArray, second: FloatArray) -> FloatArray:
    return np.asarray(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0])


def _place(flux_map: MeasuredFluxMap, i_d: float, i_q: float) -> int:
    at = (i_d, abs(i_q) if flux_map.symmetric else i_q)
    return int(np.argmin(np.hypot(*(flux_map.points - at).T)))
