"""Everything on the bench that never changes, and what follows from it for a shaft or a circuit."""

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from sim_instruments.disturbances.bench import Contacts
from sim_instruments.physics.circuits.eddy import EddyNetwork
from sim_instruments.physics.circuits.network import Network
from sim_instruments.physics.circuits.shorted import ShortedNetwork
from sim_instruments.physics.circuits.windings import FloatArray, Windings
from sim_instruments.physics.mapped.network import MappedNetwork
from sim_instruments.physics.mapped.windings import MappedWindings, windings_of
from sim_instruments.physics.motion.coasting import CoggingWaves
from sim_instruments.physics.motor.motor import VirtualMotor
from sim_instruments.physics.swing import Shaft
from sim_instruments.world.machine_data import DynamometerMachine, InverterStage, Leads, SupplyStage
from sim_instruments.world.settings import WorldSettings
from sim_instruments.world.sources.six_step_stage import SixStepStage

SUPPLY_POLES = ("supply+", "supply-")
BRIDGE_POLES = ("lcr_high", "lcr_low")
INVERTER_POLES = ("inverter_u", "inverter_v", "inverter_w")


@dataclass(frozen=True)
class Constants:
    """The motor and the machines round it; a dynamometer that holds a speed feels the motor's cogging."""

    motor: VirtualMotor
    supply: SupplyStage
    dynamometer: DynamometerMachine
    inverter: InverterStage
    leads: Leads
    six_step: SixStepStage | None = None
    contacts: Contacts = field(default_factory=Contacts)

    def shaft(self, settings: WorldSettings, torque: float = 0.0) -> Shaft:
        """Return what turns together: the motor, and the dynamometer's machine where it is coupled; rubbing is its mean.

        So is the braking of shorted turns while an inverter or a six-step drive impresses the currents outside.
        """
        motor, machine = self.motor, self.dynamometer
        coupled = 1.0 if settings.shaft.coupled else 0.0
        shaft = Shaft(
            motor.inertia + coupled * machine.inertia,
            motor.coulomb_friction + 0.5 * motor.rubbing_torque + coupled * machine.coulomb_friction,
            motor.viscous_friction + coupled * machine.viscous_friction,
            torque,
            motor.bearing,
        )
        return self._braked(shaft) if settings.inverter.enabled or settings.six_step.enabled else shaft

    def coasting_shaft(self, settings: WorldSettings) -> Shaft:
        """Return the same with the mean braking of a winding's shorted turns, which no current from outside hides."""
        return self._braked(self.shaft(settings))

    def swinging_shaft(self, settings: WorldSettings, torque: float) -> Shaft:
        """Return the same under a torque (N·m) with what shorted turns brake a rotor that swings under the supply.

        It swings far below the speed at which their inductance counts, so that this is viscous.
        """
        shaft = self.shaft(settings, torque)
        brake = self._braked(shaft).bearing.brake
        return replace(shaft, viscous_friction=shaft.viscous_friction + brake) if brake else shaft

    def _braked(self, shaft: Shaft) -> Shaft:
        motor = self.motor
        short = motor.shorted_turns
        if short is None:
            return shaft
        turns = motor.turn_shares[short.winding]
        inductance = (motor.d_axis_inductance + motor.q_axis_inductance) / 3.0
        inductance = turns**2 * (inductance + motor.winding_zero_sequence_inductance / 3.0)
        flux = motor.pole_pairs * motor.flux_linkage * turns * motor.emf_shares[short.winding]
        slope, speed = short.brake(motor.phase_resistances[short.winding], inductance, flux)
        return replace(shaft, bearing=replace(shaft.bearing, brake=slope, brake_speed=speed / motor.pole_pairs))

    def windings(
        self, settings: WorldSettings, temperature: float, magnet_temperature: float | None, *, supplied: bool
    ) -> Windings:
        """Return the windings at a temperature (°C) as a circuit of `network` takes them, the magnets as warm or at their own.

        The current in shorted turns is known of a rotor that is held or turned from outside; a free one under current, or one that an
        inverter feeds, has turns missing in their place; `shaft` has what they brake under the inverter.
        """
        short_seen = settings.rotor_held or not (supplied or settings.inverter.enabled or settings.six_step.enabled)
        return windings_of(self.motor if short_seen else self.motor.without_short, temperature, magnet_temperature)

    def cogging(self, shaft: Shaft) -> CoggingWaves | None:
        """Return the cogging that a coasting shaft feels, None where it is left out."""
        motor, felt = self.motor, self.motor.bearing.cogging_while_turning
        if felt is None:
            felt = motor.cogging_torque > motor.coulomb_friction
        if not felt or not motor.cogging_torque:
            return None
        return CoggingWaves(motor.cogging_torque, motor.cogging_order, motor.cogging_phase, shaft.inertia)

    def network(
        self,
        windings: Windings,
        settings: WorldSettings,
        *,
        supplied: bool,
        eddy_currents: FloatArray | None = None,
        contact_warmth: FloatArray | None = None,
    ) -> Network:
        """Return the circuit of the present wiring, with the supply's output connected or open.

        That of a held rotor begins with the `eddy_currents` (A) in its iron, where it has any. `contact_warmth` is by what share the
        contacts' resistances have risen.
        """
        wired = windings, settings.sockets(), SUPPLY_POLES if supplied else None
        given: dict[str, Any] = {
            "source_resistance": self.supply.output_resistance,
            "lead_resistance": self.leads.resistance,
            "contacts": np.multiply(settings.clamps, 1.0 if contact_warmth is None else 1.0 + contact_warmth),
        }
        if isinstance(windings, MappedWindings):
            return MappedNetwork(*wired, **given)
        if windings.motor.shorted_turns is not None:
            return ShortedNetwork(*wired, **given)
        if settings.rotor_held and self.motor.iron.has_eddy_currents:
            return EddyNetwork(*wired, **given, held=True, eddy_currents=eddy_currents)
        return Network(*wired, **given, held=settings.rotor_held)

    def bridge_network(self, windings: Windings, settings: WorldSettings) -> Network:
        """Return the circuit as the bridge's leads see it, with the contacts between motor and clamps unless each lead has its own.

        Its fixture's residual is apart.
        """
        kind = EddyNetwork if self.motor.iron.has_eddy_currents else Network
        if windings.motor.shorted_turns is not None:
            kind = ShortedNetwork
        contacts = None if self.contacts.kelvin else np.array(settings.clamps)
        return kind(windings, settings.sockets(), BRIDGE_POLES, contacts=contacts)

    def inverter_direction(self, settings: WorldSettings) -> int:
        """Return +1 or -1 for a positive or negative phase sequence at the motor, 0 where a phase is missing."""
        sockets = settings.sockets()
        if sorted(sockets) != sorted(INVERTER_POLES):
            return 0
        first, second, _ = (INVERTER_POLES.index(socket) for socket in sockets)
        return 1 if (second - first) % 3 == 1 else -1
