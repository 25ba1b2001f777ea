"""The reading of an auto-balancing bridge with the motor between its leads."""

import cmath
import math

import numpy as np

from sim_instruments.physics.circuits.network import Network
from sim_instruments.physics.circuits.windings import FloatArray, Windings
from sim_instruments.world.timeline import Timeline

#: Source resistance (Ω) of the bridge.
SOURCE_RESISTANCE = 100.0
#: The largest current (A, peak) that a voltage of the device itself may drive through the bridge's converter.
_SATURATION = 0.05


def reading(timeline: Timeline, frequency: float, level_rms: float, aperture: float) -> complex:
    """Return the impedance (Ω) as the bridge sees it over the last whole test periods in `aperture` (s).

    Voltage and current are detected through a rectangular window: the mean of the impedance over the rotor's way,
    the rate of change of its inductance, and whatever of the EMF falls into the detector's band. Not a number where the EMF
    alone is more than the bridge takes.
    """
    angular = 2.0 * math.pi * frequency
    leads = timeline.constants.leads
    residual = complex(leads.lcr_resistance, angular * leads.lcr_inductance)
    if timeline.settings.leads_shorted:
        return residual
    windings = timeline.windings()
    network = timeline.constants.bridge_network(windings, timeline.settings)
    if not network.drives_current:
        return complex(math.inf, 0.0)
    window = max(1, math.floor(frequency * aperture * (1.0 + 1e-9))) / frequency
    begin, end = timeline.angles(np.array([timeline.now - window, timeline.now])) * windings.pole_pairs
    count = int(min(max(64.0, 16.0 * abs(end - begin) / math.pi), 4096.0))
    if begin == end:
        mean = complex(network.driving_point_impedance(np.array([end]), angular)[0])
    else:
        times = timeline.now - window * (1.0 - (np.arange(count) + 0.5) / count)
        angles = timeline.angles(times) * windings.pole_pairs
        first, last = network.driving_point_impedance(np.array([begin, end]), angular)
        change = (last - first).imag / angular / window
        mean = complex(network.driving_point_impedance(angles, angular).mean()) + change
    total = mean + residual
    if _emf_bound(windings, network, begin, end, window) > _SATURATION * SOURCE_RESISTANCE:
        return complex(math.nan, math.nan)
    source = level_rms * math.sqrt(2.0)
    leak = _leakage(windings, network, begin, end, window, angular)
    current = (source - leak) / (SOURCE_RESISTANCE + total)
    return (total * current + leak) / current


def _emf_bound(windings: Windings, network: Network, begin: float, end: float, window: float) -> float:
    """Return what the EMF between the leads (V, peak) is at most, the rotor turning at its mean speed."""
    if begin == end:
        return 0.0
    phasors = open_circuit_weights(network) @ windings.emf_phasors
    return abs(end - begin) / window * float(np.abs(phasors).sum())


def _leakage(windings: Windings, network: Network, begin: float, end: float, window: float, angular: float) -> complex:
    """Return the EMF between the leads (V, peak phasor) that a rectangular window lets through at the test frequency.

    The rotor's mean speed over the window stands for its speed.
    """
    speed = (end - begin) / window
    if speed == 0.0:
        return 0j
    middle = 0.5 * (begin + end)
    total = 0j
    phasors = (open_circuit_weights(network) @ windings.emf_phasors).tolist()
    for order, phasor in zip(windings.emf_orders, phasors, strict=True):
        phasor *= speed * cmath.exp(1j * order * middle)
        total += phasor * _sinc(0.5 * (order * speed - angular) * window)
        total += phasor.conjugate() * _sinc(0.5 * (order * speed + angular) * window)
    return total


def open_circuit_weights(network: Network) -> FloatArray:
    """Return the share (3,) of each winding's EMF in the voltage between the source's poles, currents by resistance."""
    share = np.linalg.solve(network.damping, network.drive)
    return network.flux_basis @ share / float(network.drive @ share)


def _sinc(x: float) -> float:
    return math.sin(x) / x if x else 1.0
