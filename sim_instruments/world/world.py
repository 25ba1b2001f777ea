"""The virtual bench's world: one motor, its wiring, its shaft, its surroundings, and time."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import asdict
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike

from sim_instruments.clock.virtual_clock import BenchClock
from sim_instruments.disturbances.bench import Disturbances
from sim_instruments.faults.damage import Damage, Switched
from sim_instruments.physics.motor.motor import VirtualMotor
from sim_instruments.six_step.drive import SixStepDrive
from sim_instruments.world import impedance
from sim_instruments.world.clamps import Clamps
from sim_instruments.world.held_probes import HeldProbes, places
from sim_instruments.world.machine_data import DynamometerMachine, InverterStage, Leads, SupplyStage
from sim_instruments.world.miswiring import Miswirings
from sim_instruments.world.probes import (
    HALL_NODES,
    NODES,
    SUPPLY_NODES,
    Node,
    PlacedCurrentProbe,
    PlacedVoltageProbe,
    Probe,
)
from sim_instruments.world.settings import SOCKETS, TERMINALS, Contact, FloatArray, Socket, Terminal
from sim_instruments.world.shaft import hand
from sim_instruments.world.shaft.dynamometer_shaft import DynamometerShaft
from sim_instruments.world.sources.insulation_output import InsulationOutput
from sim_instruments.world.sources.inverter_output import InverterOutput
from sim_instruments.world.sources.six_step_output import SixStepOutput
from sim_instruments.world.sources.six_step_stage import SixStepStage
from sim_instruments.world.sources.supply_output import SupplyOutput
from sim_instruments.world.timeline import Timeline
from sim_instruments.world.voltmeter_leads import VoltmeterLeads


class World:
    """Everything that is physically there; instruments' faces read and drive it, hands wire and hold it.

    Nothing runs in the background: every access first brings the world to `clock.now()`. Every public method takes
    `lock` itself; a face takes it round several accesses that belong together.
    Signs: positive speed and torque turn the electrical angle forwards (A → B → C), currents flow into the motor.
    """

    def __init__(
        self,
        motor: VirtualMotor,
        clock: BenchClock,
        *,
        seed: int = 0,
        dynamometer: DynamometerMachine | None = None,
        inverter: InverterStage | None = None,
        supply: SupplyStage | None = None,
        leads: Leads | None = None,
        ambient_temperature: float = 25.0,
        star_point_accessible: bool = False,
        initial_angle: float = 0.0,
        six_step: SixStepDrive | None = None,
        fixture: bool = False,
        disturbances: Disturbances | None = None,
    ) -> None:
        if star_point_accessible and motor.connection == "delta":
            raise ValueError("star_point_accessible is set for a delta motor; only a wye has a star point")
        self.motor = motor
        self.clock = clock
        self.star_point_accessible = star_point_accessible
        #: What disturbs the bench beyond its instruments' limits of error.
        self.disturbances = disturbances or Disturbances()
        self._random = np.random.default_rng(seed)
        contacts = self.disturbances.contacts
        self._clamps, sensing = (Clamps(contacts, (seed, k)) for k in (0xC1A, 0xC1B))
        stage = None if six_step is None else SixStepStage(six_step, motor)
        self._timeline = Timeline(
            motor,
            clock,
            supply=supply or SupplyStage(),
            dynamometer=dynamometer or DynamometerMachine(),
            inverter=inverter or InverterStage(),
            leads=leads or Leads(),
            ambient_temperature=ambient_temperature,
            initial_angle=initial_angle,
            six_step=stage,
            contacts=contacts,
            clamps=self._clamps.put_on(len(TERMINALS)),
        )
        self._sockets = tuple(
            name
            for name in (*SOCKETS, *(("insulation_high",) if fixture else ()))
            if stage is not None or not name.startswith("drive_")
        )
        self.lock = self._timeline.lock
        self.supply = SupplyOutput(self._timeline, self._timeline.constants.supply)
        self.dynamometer = DynamometerShaft(self._timeline, self._timeline.constants.dynamometer, clock)
        self.inverter = InverterOutput(self._timeline, self._timeline.constants.inverter)
        #: None on a bench without such a drive.
        self.six_step = None if stage is None else SixStepOutput(self._timeline, stage)
        outputs = {
            "supply": Switched(self.supply.stuck_output, self.supply.switch),
            "inverter": Switched(self.inverter.stuck_output, self.inverter.enable),
            "dynamometer": Switched(self.dynamometer.stuck_output, self.dynamometer.enable),
        }
        if self.six_step is not None:
            outputs["drive"] = Switched(self.six_step.stuck_output, self.six_step.enable)
        #: What breaks besides the wires.
        self.damage = Damage((self._timeline, self.dynamometer.alone), outputs)
        #: The insulation tester's output; None on a bench without a fixture.
        self.insulation = InsulationOutput(self._timeline, self.damage) if fixture else None
        self._probes: dict[int, Probe] = {}
        self._leads = VoltmeterLeads(self._timeline, contacts, sensing)
        #: Miswirings that hands will make.
        self.miswirings = Miswirings()

    # What hands do

    def connect(self, wiring: Mapping[str, str]) -> None:
        """Wire the motor's terminals anew: terminal to socket, those left out stay open.

        Raises ValueError for an unknown terminal or socket, or the six-step drive's on a bench without one.
        """
        complete: dict[Terminal, Socket] = {}
        for name in wiring:
            if name not in TERMINALS:
                raise ValueError(f"terminal {name!r} is unknown; the motor has {', '.join(TERMINALS)}")
        for terminal in TERMINALS:
            socket = wiring.get(terminal, "open")
            if socket not in self._sockets:
                raise ValueError(
                    f"socket {socket!r} for terminal {terminal} is unknown; allowed are {', '.join(self._sockets)}"
                )
            complete[terminal] = cast("Socket", socket)
        with self._timeline.changing() as settings:
            settings.wiring = {**self.miswirings.connected(complete)}
            settings.clamps = self._clamps.put_on(len(TERMINALS))

    def take_off(self, terminals: Iterable[Terminal]) -> None:
        """Take the wires of these terminals off whatever they are on; the others stay. Raises ValueError for an unknown one."""
        gone = list(terminals)
        for terminal in gone:
            self._check_terminal(terminal)
        with self._timeline.changing() as settings:
            settings.wiring = {**settings.wiring, **dict.fromkeys(gone, "open")}

    def switch(self, wiring: Mapping[Terminal, Contact]) -> None:
        """Wire the motor's three terminals by relays, without the errors of a person and without a check."""
        with self._timeline.changing() as settings:
            settings.wiring = dict(wiring)

    def attach_voltage_probe(self, channel: int, positive: Node, negative: Node) -> None:
        """Put a channel's differential probe on two nodes: A, B, C, N, star (of equal resistors), S+ and S- of the supply, or loose.

        The Hall sensors' leads H1, H2, H3 and H0 are nodes, too; H0 counts as at the potential of the supply's minus. A motor without
        sensors has them dead, as where its connector is off.
        Raises ValueError for an unknown node, or N where the star point is not accessible.
        """
        nodes = (*NODES, *HALL_NODES)
        for node in (positive, negative):
            if node not in nodes:
                raise ValueError(f"node {node!r} is unknown; allowed are {', '.join(nodes)}")
            if node == "N" and not self.star_point_accessible:
                raise ValueError("node 'N': this motor's star point is not accessible; use the artificial 'star'")
        with self.lock:
            self._probes[channel] = self.miswirings.voltage(channel, PlacedVoltageProbe(positive, negative))

    def attach_current_probe(self, channel: int, terminal: Terminal) -> None:
        """Clip a channel's current probe round the wire into a terminal. Raises ValueError for an unknown one."""
        self._check_terminal(terminal)
        with self.lock:
            self._probes[channel] = self.miswirings.current(channel, PlacedCurrentProbe(terminal))

    def detach_probe(self, channel: int) -> None:
        """Take a channel's probe off; it then senses nothing."""
        with self.lock:
            self._probes.pop(channel, None)

    def attach_voltmeter(self, positive: Node, negative: Node) -> None:
        """Put the voltmeter's leads on two of the motor's own terminals, inside the clamps of whatever feeds it, or on the supply's output.

        Raises ValueError for an unknown terminal, or one given twice.
        """
        for node in (positive, negative):
            if node not in SUPPLY_NODES:
                self._check_terminal(node)
        if positive == negative:
            raise ValueError(f"the voltmeter's leads must be on two different terminals, not {positive} twice")
        with self.lock:
            self._leads.put_on(self.miswirings.voltage(None, PlacedVoltageProbe(positive, negative)), self.clock.now())

    def detach_voltmeter(self) -> None:
        """Take the voltmeter's leads off; it then senses nothing."""
        with self.lock:
            self._leads.take_off()

    def lock_rotor(self) -> None:
        """Lock the shaft where it is; a turning shaft stops at once."""
        with self._timeline.changing() as settings:
            settings.shaft.holder = "locked"

    def release_rotor(self) -> None:
        """Open the lock; the shaft is free."""
        with self._timeline.changing() as settings:
            if settings.shaft.holder == "locked":
                settings.shaft.holder = "free"

    def couple_dynamometer(self) -> None:
        """Couple the dynamometer to the shaft. Raises RuntimeError while the shaft turns."""
        self._couple(True)

    def uncouple_dynamometer(self) -> None:
        """Take the dynamometer off the shaft. Raises RuntimeError while the shaft turns."""
        self._couple(False)

    def turn_shaft(self, speed: float, wobble: float = 0.0) -> None:
        """Turn the shaft by hand (rad/s, mechanical) until held or let go; `wobble` is the speed's relative variation.

        Raises RuntimeError where the rotor is locked or stuck or the dynamometer drives it, ValueError for a wobble outside 0…1.
        """
        if not 0.0 <= wobble < 1.0:
            raise ValueError(f"wobble {wobble} is outside 0 … 1; a hand does not turn back")
        with self._timeline.changing() as settings:
            self._check_movable()
            shaft = settings.shaft
            shaft.holder, shaft.turning_speed, shaft.wobble = "turning", float(speed), wobble
            shaft.wobble_phase = float(self._random.uniform(0.0, 2.0 * math.pi))
            shaft.wobble, shaft.pauses = hand.uneven(
                self.disturbances.hands, self._random, float(speed), wobble, self._timeline.now
            )

    def move_shaft(self, speed: float, duration: float) -> None:
        """Turn the shaft at a speed (rad/s) for a time (s) and hold it there. Raises RuntimeError as `turn_shaft` does."""
        with self._timeline.changing() as settings:
            self._check_movable()
            shaft = settings.shaft
            shaft.holder, shaft.pull_speed, shaft.pull_until = "pulling", float(speed), self._timeline.now + duration
            shaft.pull_then = "hand"

    def hold_shaft(self) -> None:
        """Hold the shaft still by hand. Raises RuntimeError where the rotor is locked or driven by the dynamometer."""
        with self._timeline.changing() as settings:
            self._check_hand()
            settings.shaft.holder = "hand"

    def let_go(self) -> None:
        """Take the hand off the shaft; it moves as it likes from there."""
        with self._timeline.changing() as settings:
            if settings.shaft.holder != "locked":
                settings.shaft.holder = "free"

    def nudge_to_next_rest(self, direction: int = 1) -> float:
        """Turn the shaft by hand until the next stable position attracts it, then release it; return the duration (s).

        The pull takes bench time, slowly where joined terminals brake the rotor, and the shaft settles after it: wait until
        it stands. Where nothing draws the shaft it is turned on by a random twentieth to tenth of a turn and stays there.
        Raises RuntimeError where the rotor is locked, stuck or driven by the dynamometer, ValueError for a direction other than ±1.
        """
        if direction not in (1, -1):
            raise ValueError(f"direction {direction} is not allowed; use 1 (forwards) or -1")
        with self._timeline.changing() as settings:
            self._check_movable()
            state = self._timeline.state
            pull = hand.pull_to_next(self._timeline.constants, settings, state, direction)
            if pull is None:
                pull = hand.Pull(float(self._random.uniform(0.05, 0.1)) * 2.0 * math.pi, hand.BRISK)
            settings.shaft.holder, settings.shaft.pull_then = "pulling", "free"
            settings.shaft.pull_speed = direction * pull.speed
            settings.shaft.pull_until = self._timeline.now + pull.duration
            return pull.duration

    def dial_angle(self) -> float:
        """Return the shaft's true mechanical angle (rad, unbounded)."""
        with self._timeline.observing():
            return self._timeline.angle

    def shaft_velocity(self) -> float:
        """Return the shaft's present speed (rad/s, signed)."""
        with self._timeline.observing():
            return self._timeline.speed

    def short_leads(self, shorted: bool) -> None:
        """Clip the bridge's leads together, for its short correction, or put them back on the motor."""
        with self._timeline.changing() as settings:
            settings.leads_shorted = shorted

    # What instruments sense

    def impedance(self, frequency: float, level_rms: float, aperture: float) -> complex:
        """Return the impedance (Ω) between lcr_high and lcr_low over the last `aperture` s at a test frequency (Hz).

        `level_rms` is the open-circuit level (V) behind 100 Ω. The rotor may have moved meanwhile: the reading is the
        mean over the aperture, and the EMF leaks into the detector as its rectangular window lets it. Infinite where
        there is no path, not a number where the EMF alone overloads the bridge.
        Raises ValueError for a frequency, level or aperture that is not positive.
        """
        for name, value in (("frequency", frequency), ("level_rms", level_rms), ("aperture", aperture)):
            if not 0.0 < value < math.inf:
                raise ValueError(f"impedance(): {name} is {value}; it must be positive and finite")
        with self._timeline.observing():
            return impedance.reading(self._timeline, frequency, level_rms, aperture)

    def probe_signal(self, channel: int, times: ArrayLike) -> FloatArray:
        """Return the true signal (V or A, shape of `times`) of a channel's probe at past bench times (s).

        A channel without a probe senses zero. Raises ValueError for times to come or older than the history kept.
        """
        wanted = np.asarray(times, dtype=np.float64)
        flat = wanted.ravel()
        if not len(flat):
            return np.zeros_like(wanted)
        with self._timeline.observing():
            return self.hold_probes(float(flat.min()), float(flat.max())).signal(channel, flat).reshape(wanted.shape)

    def hold_probes(self, first: float, last: float) -> HeldProbes:
        """Return what the probes have sensed from one past bench time (s) to another, to be kept like a record.

        Raises ValueError for times to come or older than the history kept.
        """
        with self._timeline.observing():
            return HeldProbes(self._timeline.hold(first, last), places(self._probes, self._timeline.settings))

    def voltmeter_voltage(self, aperture: float, until: float | None = None) -> float:
        """Return the mean true voltage (V) between the voltmeter's leads over the `aperture` s before `until` (s).

        `until` defaults to now; an aperture of 0 is the value at that time. Without leads on the motor it is zero.
        Raises ValueError for times to come or older than the history kept.
        """
        with self._timeline.observing():
            return self._leads.voltage(aperture, until)

    def voltmeter_signal(self, times: FloatArray) -> FloatArray:
        """Return the true voltage (V, shape (n,)) between the voltmeter's leads at past times (s); raises as `voltmeter_voltage`."""
        with self._timeline.observing():
            return self._leads.signal(times)

    def voltmeter_resistance(self, aperture: float, until: float | None = None) -> tuple[float, float]:
        """Return the resistance (Ω) between what the voltmeter's leads are on, over a time as above, and that of their clamps.

        The first is infinite where nothing connects them. Raises ValueError as `voltmeter_voltage` does.
        """
        with self._timeline.observing():
            return self._leads.resistance(aperture, until), self._leads.contact_resistance()

    def shaft_speed(self, gate: float, until: float | None = None) -> float:
        """Return the mean of |speed| (rad/s, mechanical) over the `gate` s before `until` (s; now); a gate of 0 is the present value."""
        with self._timeline.observing():
            if gate <= 0.0:
                return abs(self._timeline.speed)
            return self._timeline.travelled(gate, until) / gate

    @property
    def unmodelled(self) -> dict[str, float]:
        """The events that the bench does not model, with the time (s) at which each last began."""
        with self._timeline.observing():
            return dict(self._timeline.unmodelled)

    def truth(self) -> dict[str, Any]:
        """Return the actual state now, for tests and the control endpoint: plain values that JSON can carry."""
        with self._timeline.observing():
            timeline, settings = self._timeline, self._timeline.settings
            now = np.array([timeline.now])
            currents = timeline.present.terminal_currents(now)[:, 0]
            return {
                "time": timeline.now,
                "output_on": settings.supply.on,
                "supply_mode": self.supply.mode(),
                "supply_voltage": float(timeline.present.output_voltage(now)[0]),
                "supply_current": float(timeline.present.output_current(now)[0]),
                "supply_tripped": settings.supply.tripped,
                "energised": settings.supply.on
                or settings.inverter.enabled
                or settings.six_step.enabled
                or self.dynamometer.enabled
                or (self.insulation is not None and self.insulation.on),
                "shaft_angle": timeline.state.angle,
                "shaft_speed": timeline.state.speed,
                "shaft_holder": settings.shaft.holder,
                "rotor_locked": settings.shaft.holder == "locked",
                "motor_torque": float(timeline.present.motor_torque(now)[0]),
                "terminal_currents": {
                    label: float(currents[TERMINALS.index(settings.motor_terminal(label))]) for label in TERMINALS
                },
                "wiring": dict(settings.wiring),
                "leads_shorted": settings.leads_shorted,
                "dynamometer_coupled": settings.shaft.coupled,
                "dynamometer_enabled": self.dynamometer.enabled,
                "dynamometer_mode": settings.dynamometer.mode,
                "dynamometer_command": settings.dynamometer.command,
                "dynamometer_speed": self.dynamometer.own_speed,
                "inverter_enabled": settings.inverter.enabled,
                "inverter_fault": settings.inverter.fault,
                "inverter_in_step": timeline.present.in_step,
                "six_step_enabled": settings.six_step.enabled,
                "six_step_fault": settings.six_step.fault,
                "winding_temperature": timeline.winding_temperature(),
                "magnet_temperature": timeline.windings().magnet_temperature,
                "hands": asdict(self.disturbances.hands),
                "ambient_temperature": settings.ambient_temperature,
                "unmodelled": dict(timeline.unmodelled),
                "faults": {
                    **asdict(settings.faults),
                    "stuck_output": self.damage.stuck_outputs,
                    "miswirings": self.miswirings.listed(),
                    **({} if self.insulation is None else {"harm": dict(self.damage.harm)}),
                },
                **({} if self.insulation is None else {"insulation_voltage": self.insulation.voltage()}),
            }

    # Surroundings and faults

    @property
    def ambient_temperature(self) -> float:
        """The ambient temperature (°C)."""
        with self.lock:
            return self._timeline.settings.ambient_temperature

    def winding_temperature(self) -> float:
        """Return the winding's true temperature (°C) now."""
        with self._timeline.observing():
            return self._timeline.winding_temperature()

    def set_ambient_temperature(self, temperature: float) -> None:
        """Set the ambient temperature (°C); the winding follows with its own time constant."""
        with self._timeline.changing() as settings:
            settings.ambient_temperature = temperature

    def set_winding_temperature(self, temperature: float) -> None:
        """Put the winding at a temperature (°C) at once, as after soaking or a run under load."""
        with self._timeline.changing():
            self._timeline.set_winding_temperature(temperature)

    def set_open_phase(self, terminal: Terminal | None) -> None:
        """Break the wire at a motor terminal, or mend it with None. Raises ValueError for an unknown terminal."""
        if terminal is not None:
            self._check_terminal(terminal)
        with self._timeline.changing() as settings:
            settings.faults.open_phase = terminal

    def set_swapped(self, pair: tuple[Terminal, Terminal] | None) -> None:
        """Exchange the labels of two of the motor's wires, or put them right. Raises ValueError for an impossible pair."""
        if pair is not None:
            for terminal in pair:
                self._check_terminal(terminal)
            if pair[0] == pair[1]:
                raise ValueError(f"swapped wires must be two different ones, not {pair[0]} twice")
        with self._timeline.changing() as settings:
            settings.faults.swapped = pair

    def set_stuck_rotor(self, stuck: bool) -> None:
        """Jam the rotor in its bearings against any torque, or free it again."""
        with self._timeline.changing() as settings:
            settings.faults.stuck_rotor = stuck

    # Helpers

    def _couple(self, coupled: bool) -> None:
        with self.lock:
            for speed in (self.shaft_speed(0.0), self.dynamometer.own_speed):
                if abs(speed) > 0.0:
                    raise RuntimeError(f"the shaft turns at {speed:.3g} rad/s; stop it before touching the coupling")
            self.dynamometer.follow_coupling(coupled)

    def _check_hand(self) -> None:
        settings = self._timeline.settings
        if settings.shaft.holder == "locked":
            raise RuntimeError("the rotor is locked; release it before turning or holding the shaft by hand")
        if settings.shaft.coupled and settings.dynamometer.enabled:
            raise RuntimeError("the dynamometer drives the shaft; disable it before touching the shaft")

    def _check_movable(self) -> None:
        self._check_hand()
        if self._timeline.settings.faults.stuck_rotor:
            raise RuntimeError("the shaft does not move: the rotor is stuck")

    @staticmethod
    def _check_terminal(terminal: str) -> None:
        if terminal not in TERMINALS:
            raise ValueError(f"terminal {terminal!r} is unknown; the motor has {', '.join(TERMINALS)}")
