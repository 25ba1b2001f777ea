"""The multimeter's leads: where they are, and what is between them."""

import math

import numpy as np

from sim_instruments.disturbances.bench import Contacts
from sim_instruments.world.clamps import Clamps
from sim_instruments.world.direct_resistance import direct_resistance
from sim_instruments.world.held_probes import FIRST_SUPPLY, node_row
from sim_instruments.world.probes import PlacedVoltageProbe
from sim_instruments.world.segment import Segment
from sim_instruments.world.settings import TERMINALS, FloatArray
from sim_instruments.world.timeline import Timeline


class VoltmeterLeads:
    """Two leads with a source and a sense wire each; to be used with the timeline's lock held."""

    def __init__(self, timeline: Timeline, contacts: Contacts, clamps: Clamps) -> None:
        self._timeline = timeline
        self._contacts = contacts
        self._clamps = clamps
        self._own = clamps.put_on(2)
        self._placed: PlacedVoltageProbe | None = None
        self._since = 0.0

    def put_on(self, placed: PlacedVoltageProbe, now: float) -> None:
        """Put the leads on two nodes at a bench time (s)."""
        self._placed, self._since = placed, now
        self._own = self._clamps.put_on(2)

    def take_off(self) -> None:
        """Take the leads off; nothing is between them then."""
        self._placed = None

    def voltage(self, aperture: float, until: float | None = None) -> float:
        """Return the mean voltage (V) over the `aperture` s before `until` (s; now), zero where a lead is on nothing.

        Raises ValueError for times to come or older than the history kept.
        """
        rows = self._rows()
        if rows is None:
            return 0.0
        plus, minus = rows
        if self._on_supply(rows):
            output = self._timeline.mean(lambda segment, at: segment.output_voltage(at), aperture, until)
            return output * ((plus == FIRST_SUPPLY) - (minus == FIRST_SUPPLY))
        voltage = self._timeline.mean(lambda segment, at: self._difference(segment, at, rows), aperture, until)
        attached = max((self._timeline.now if until is None else until) - self._since, 0.0)
        return voltage + self._contacts.thermal_emf * math.exp(-attached / self._contacts.thermal_time)

    def signal(self, times: FloatArray) -> FloatArray:
        """Return the voltage (V, shape of `times`) at past times (s), without thermal EMF. Raises ValueError as `voltage` does."""
        rows = self._rows()
        if rows is None:
            return np.zeros_like(times)
        if self._on_supply(rows):
            sign = (rows[0] == FIRST_SUPPLY) - (rows[1] == FIRST_SUPPLY)
            return sign * self._timeline.sample(lambda segment, at: segment.output_voltage(at), times)
        return self._timeline.sample(lambda segment, at: self._difference(segment, at, rows), times)

    def resistance(self, aperture: float, until: float | None = None) -> float:
        """Return the mean resistance (Ω) between the nodes as `voltage` does, infinite where a lead is on nothing."""
        rows = self._rows()
        if rows is None:
            return np.inf
        first, second = (TERMINALS[row] if row < FIRST_SUPPLY else f"supply{'+-'[row - FIRST_SUPPLY]}" for row in rows)
        bridge = not self._timeline.settings.leads_shorted

        def found(segment: Segment) -> float:
            network, stiff = segment.circuit.network, segment.supply_mode == "cv"
            return direct_resistance(network, first, second, stiff=stiff, bridge=bridge)

        return self._timeline.mean(
            lambda segment, at: np.full(len(at), found(segment)), max(aperture, 0.0), until, steady=found
        )

    def contact_resistance(self) -> float:
        """Return the resistance (Ω) of both clamps, which source and sense wires have in common with two-wire measurements."""
        return sum(self._own)

    def _rows(self) -> tuple[int, int] | None:
        if self._placed is None or self._placed.loose:
            return None
        settings = self._timeline.settings
        return node_row(self._placed.positive, settings), node_row(self._placed.negative, settings)

    @staticmethod
    def _on_supply(rows: tuple[int, int]) -> bool:
        return max(rows) >= FIRST_SUPPLY

    def _difference(self, segment: Segment, at: FloatArray, rows: tuple[int, int]) -> FloatArray:
        nodes = segment.node_potentials(at)
        contacts = segment.circuit.network.contacts
        if not self._contacts.kelvin and contacts.any():
            # The sensing leads are on the clamps of whatever feeds the motor, and see their contacts.
            nodes[: len(TERMINALS)] += contacts[:, np.newaxis] * segment.terminal_currents(at)
        result: FloatArray = nodes[rows[0]] - nodes[rows[1]]
        return result
