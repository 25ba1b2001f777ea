"""The virtual motor, with its windings, magnets and mechanics."""

import math
from dataclasses import dataclass, replace
from typing import Literal

from sim_instruments.physics.motor.bearing import PLAIN, Bearing
from sim_instruments.physics.motor.flux_law import MappedFlux
from sim_instruments.physics.motor.flux_map import FluxMap
from sim_instruments.physics.motor.hall import SimulatedHallSensors
from sim_instruments.physics.motor.iron import IDEAL, Iron
from sim_instruments.physics.motor.magnets import AS_WARM, Magnets
from sim_instruments.physics.motor.saturation import Saturation
from sim_instruments.physics.motor.shorted_turns import ShortedTurns

Connection = Literal["wye", "delta"]


@dataclass(frozen=True)
class VirtualMotor:
    """The truth of a permanent-magnet motor, in SI units and per winding.

    `connection`: "wye" or "delta". `phase_resistances` (Ω) hold at `resistance_temperature` (°C): phases A, B, C of a
    wye, windings AB, BC, CA of a delta. Inductances (H) and `flux_linkage` (V·s per electrical rad, peak) are those
    of a winding; `zero_sequence_inductance` defaults to a tenth of the mean of Ld and Lq. `flux_harmonics` are
    (order, amplitude of the EMF relative to the fundamental, phase in rad). Winding k has its magnetic axis at
    k·120° electrical, and the electrical angle p·θ_mech is that of the d axis from winding 0's.
    `inertia` kg·m², `coulomb_friction` N·m, `viscous_friction` N·m·s/rad, `cogging_torque` N·m amplitude with
    `cogging_order` periods a turn. `temperature_coefficient` (1/K) is copper's at 20 °C, `flux_temperature_coefficient`
    (1/K) the magnets' from `resistance_temperature`. `thermal_resistance` K/W and `thermal_time_constant` s are those
    of the winding against ambient. `d_axis_saturation_current` and `q_axis_saturation_current` (A, peak, of the
    Y-equivalent) say how soon an axis saturates, after `Saturation`; infinite, the default, is never. Only a held rotor
    on the supply saturates: everything else, the torque too, takes the inductances at no current.
    `cogging_phase` (rad) is that of the cogging at angle zero. `insulation_resistance` (Ω) and `frame_capacitance` (F) are
    those of the winding against the frame; `halls` are its Hall sensors, None where it has none.
    What can be wrong inside: `emf_shares` are each winding's EMF relative to the others', `turn_shares` each winding's turns,
    which inductances and EMF follow (resistances are given apart); `shorted_turns` are a winding's; `exchanged` are two terminals whose
    wires are exchanged inside. A rotor that touches the stator once a turn drags by `rubbing_torque`·(1 + cos θ)/2 (N·m).
    `bearing` and `iron` are what bearings, air and iron do beyond these figures; by default nothing. `magnets` say how warm those become.
    With a `flux_map` (of the Y-equivalent) everything follows that in place of the inductances, which are then the map's at no current;
    `flux_linkage` stays what the magnets alone make at `resistance_temperature`.
    Raises ValueError for values that no motor has.
    """

    connection: Connection
    phase_resistances: tuple[float, float, float]
    d_axis_inductance: float
    q_axis_inductance: float
    flux_linkage: float
    pole_pairs: int
    inertia: float
    resistance_temperature: float = 25.0
    zero_sequence_inductance: float | None = None
    flux_harmonics: tuple[tuple[int, float, float], ...] = ()
    coulomb_friction: float = 0.0
    viscous_friction: float = 0.0
    cogging_torque: float = 0.0
    cogging_order: int = 12
    temperature_coefficient: float = 0.00393
    flux_temperature_coefficient: float = -0.001
    thermal_resistance: float = 0.5
    thermal_time_constant: float = 600.0
    d_axis_saturation_current: float = math.inf
    q_axis_saturation_current: float = math.inf
    cogging_phase: float = 0.0
    insulation_resistance: float = 2.0e9
    frame_capacitance: float = 1.0e-9
    halls: SimulatedHallSensors | None = None
    emf_shares: tuple[float, float, float] = (1.0, 1.0, 1.0)
    turn_shares: tuple[float, float, float] = (1.0, 1.0, 1.0)
    shorted_turns: ShortedTurns | None = None
    rubbing_torque: float = 0.0
    exchanged: tuple[Literal["A", "B", "C"], Literal["A", "B", "C"]] | None = None
    bearing: Bearing = PLAIN
    iron: Iron = IDEAL
    magnets: Magnets = AS_WARM
    flux_map: FluxMap | None = None

    def __post_init__(self) -> None:
        if self.flux_map is not None:
            self._take_inductances(self.flux_map)
        if self.connection not in ("wye", "delta"):
            raise ValueError(f"connection is {self.connection!r}; allowed are 'wye' and 'delta'")
        if len(self.phase_resistances) != 3:
            raise ValueError(f"phase_resistances has {len(self.phase_resistances)} values; a motor has three windings")
        positive = {
            "phase_resistances": min(self.phase_resistances),
            "d_axis_inductance": self.d_axis_inductance,
            "q_axis_inductance": self.q_axis_inductance,
            "flux_linkage": self.flux_linkage,
            "pole_pairs": self.pole_pairs,
            "inertia": self.inertia,
            "zero_sequence_inductance": self.winding_zero_sequence_inductance,
            "thermal_time_constant": self.thermal_time_constant,
            "insulation_resistance": self.insulation_resistance,
        }
        for name, value in positive.items():
            if not 0.0 < value < math.inf:
                raise ValueError(f"{name} is {value}; it must be positive and finite")
        for name in (
            "coulomb_friction",
            "viscous_friction",
            "cogging_torque",
            "thermal_resistance",
            "frame_capacitance",
            "rubbing_torque",
        ):
            value = getattr(self, name)
            if not 0.0 <= value < math.inf:
                raise ValueError(f"{name} is {value}; it must be finite and not negative")
        for name in ("d_axis_saturation_current", "q_axis_saturation_current"):
            value = getattr(self, name)
            if not value > 0.0:
                raise ValueError(f"{name} is {value}; it must be positive, infinite for an axis that does not saturate")
        if len(self.emf_shares) != 3 or not all(0.0 <= share <= 2.0 for share in self.emf_shares):
            raise ValueError(f"emf_shares are {self.emf_shares}; they are three numbers of 0 … 2, a winding each")
        if len(self.turn_shares) != 3 or not all(0.0 < share <= 2.0 for share in self.turn_shares):
            raise ValueError(
                f"turn_shares are {self.turn_shares}; they are three numbers above 0 and up to 2, a winding each"
            )
        if self.shorted_turns is not None and (self.iron.has_eddy_currents or self.winding_saturation is not None):
            raise ValueError(
                "shorted turns beside eddy currents or saturation are not simulated; leave one of them out"
            )
        if self.flux_map is not None and self.winding_saturation is not None:
            raise ValueError("a flux map holds its saturation; leave the saturation currents out")
        if self.follows_flux and (
            self.shorted_turns is not None or self.iron.has_eddy_currents or self.iron.lowers_emf
        ):
            raise ValueError(
                "shorted turns, eddy currents beside the windings and an EMF that is not in proportion to the speed are not "
                "simulated with a flux map or with the iron's loss; leave one of them out"
            )
        if self.exchanged is not None and self.exchanged[0] == self.exchanged[1]:
            raise ValueError(f"exchanged terminals must be two different ones, not {self.exchanged[0]} twice")
        if self.iron.has_eddy_currents and self.winding_saturation is not None:
            raise ValueError("eddy currents and saturation together are not simulated; leave one of them out")
        for order, amplitude, _ in self.flux_harmonics:
            if order < 2 or not math.isfinite(amplitude):
                raise ValueError(
                    f"flux_harmonics has order {order}, amplitude {amplitude}; orders are 2 or more, amplitudes finite"
                )

    def _take_inductances(self, flux_map: FluxMap) -> None:
        law = MappedFlux(flux_map, self.flux_linkage, delta=self.connection == "delta")
        _, _, direct, _, _, quadrature = law.at(0.0, 0.0)
        # The constants of a motor on a map are what it has at no current.
        object.__setattr__(self, "d_axis_inductance", direct)
        object.__setattr__(self, "q_axis_inductance", quadrature)

    @property
    def follows_flux(self) -> bool:
        """True if its circuits are solved by fluxes: on a flux map, or with a loss in the iron."""
        return self.flux_map is not None or self.iron.loses

    @property
    def winding_zero_sequence_inductance(self) -> float:
        """Zero-sequence inductance of a winding (H), as given or by default."""
        if self.zero_sequence_inductance is not None:
            return self.zero_sequence_inductance
        return 0.05 * (self.d_axis_inductance + self.q_axis_inductance)

    @property
    def _impedance_share(self) -> float:
        return 1.0 / 3.0 if self.connection == "delta" else 1.0

    @property
    def stator_resistance_y(self) -> float:
        """Mean resistance (Ω) of a phase of the Y-equivalent at `resistance_temperature`.

        It is half the mean of the three line-to-line values, for a delta of unequal windings too.
        """
        a, b, c = self.phase_resistances
        if self.connection == "wye":
            return (a + b + c) / 3.0
        return (a * b + b * c + c * a) / (3.0 * (a + b + c))

    @property
    def d_axis_inductance_y(self) -> float:
        """d-axis inductance (H) of a phase of the Y-equivalent."""
        return self.d_axis_inductance * self._impedance_share

    @property
    def q_axis_inductance_y(self) -> float:
        """q-axis inductance (H) of a phase of the Y-equivalent."""
        return self.q_axis_inductance * self._impedance_share

    @property
    def flux_linkage_y(self) -> float:
        """Peak phase flux linkage (V·s per electrical rad) of the Y-equivalent at `resistance_temperature`."""
        return self.flux_linkage * math.sqrt(self._impedance_share)

    @property
    def winding_saturation(self) -> Saturation | None:
        """Saturation of the axes in a winding's own inductances and currents, None where neither saturates."""
        d, q = self.d_axis_saturation_current, self.q_axis_saturation_current
        if math.isinf(d) and math.isinf(q):
            return None
        # A delta's windings carry 1/√3 of the Y-equivalent's current.
        current = math.sqrt(self._impedance_share)
        return Saturation(self.d_axis_inductance, self.q_axis_inductance, d * current, q * current)

    @property
    def without_short(self) -> "VirtualMotor":
        """The same with turns missing in place of shorted ones, as a direct current that passes them by finds it."""
        short = self.shorted_turns
        if short is None:
            return self
        at = short.winding
        left = 1.0 - short.share * short.passed_by(self.phase_resistances[at])
        a, b, c = (left if winding == at else 1.0 for winding in range(3))
        (ra, rb, rc), (ta, tb, tc) = self.phase_resistances, self.turn_shares
        return replace(
            self,
            shorted_turns=None,
            phase_resistances=(a * ra, b * rb, c * rc),
            turn_shares=(a * ta, b * tb, c * tc),
        )

    @property
    def torque_constant(self) -> float:
        """Torque per peak phase ampere (N·m/A), 1.5·p·λ."""
        return 1.5 * self.pole_pairs * self.flux_linkage_y

    @property
    def back_emf_constant_mechanical(self) -> float:
        """Peak phase voltage over mechanical speed (V·s/rad), p·λ."""
        return self.pole_pairs * self.flux_linkage_y

    @property
    def open_coulomb_friction(self) -> float:
        """Torque (N·m) that brakes the shaft at any speed while the terminals are open: friction, the mean of what rubs, and hysteresis."""
        friction = self.coulomb_friction + 0.5 * self.rubbing_torque
        return friction + 1.5 * self.pole_pairs * self.iron.hysteresis_loss * self.flux_linkage_y**2

    @property
    def open_viscous_friction(self) -> float:
        """Torque over speed (N·m·s/rad) that brakes the shaft while the terminals are open: friction, and the iron's eddy currents."""
        return self.viscous_friction + 1.5 * self.pole_pairs**2 * self.iron.eddy_loss * self.flux_linkage_y**2

    def resistances_at(self, temperature: float) -> tuple[float, float, float]:
        """Return the three winding resistances (Ω) at a winding temperature (°C), by the law of copper."""
        alpha = self.temperature_coefficient
        ratio = (1.0 + alpha * (temperature - 20.0)) / (1.0 + alpha * (self.resistance_temperature - 20.0))
        a, b, c = self.phase_resistances
        return a * ratio, b * ratio, c * ratio

    def flux_linkage_at(self, temperature: float) -> float:
        """Return the winding's flux linkage (V·s per electrical rad) at a temperature (°C)."""
        return self.flux_linkage * (
            1.0 + self.flux_temperature_coefficient * (temperature - self.resistance_temperature)
        )
