"""The state T1T2 from its start to its end: which devices conduct, and when that changes."""

import math
from dataclasses import dataclass, field

import numpy as np

from sim_instruments.six_step.circuit import (
    Conduction,
    ConductionCircuit,
    Idle,
    LinearForm,
    Real,
    build_circuit,
    inductance_matrix,
    line_matrix,
    loop_current,
)
from sim_instruments.six_step.drive import SixStepDrive, SixStepError
from sim_instruments.six_step.emf import emf_phasors
from sim_instruments.six_step.events import first_below_zero
from sim_instruments.six_step.segment import ConductionSegment, make_segment

_MOST_SEGMENTS = 200


@dataclass(frozen=True)
class StateInterval:
    """A stretch of the state T1T2: its segments, the winding currents at its end and their sensitivity to the start."""

    segments: tuple[ConductionSegment, ...]
    end_currents: Real
    transition: Real


@dataclass
class Bridge:
    """The bridge with its machine in the state T1T2; the other states are this one with the legs renamed.

    Circuits depend on neither speed nor time and are kept once built.
    """

    drive: SixStepDrive
    orders: Real = field(init=False)
    _circuits: dict[Conduction, ConductionCircuit] = field(init=False, default_factory=dict)

    def __post_init__(self) -> None:
        drive = self.drive
        self.orders, self._emf = emf_phasors(drive)
        self._lines = line_matrix(drive)
        self.inductance = inductance_matrix(drive)
        self.current_scale = loop_current(drive)
        #: Mechanical speed in rad/s at which the average EMF between the conducting legs equals the source voltage.
        windings = 1.0 if drive.connection == "delta" else math.sqrt(3.0)
        self.no_load_speed = drive.source_voltage / (3 / math.pi * drive.emf_constant * windings)
        self._tolerance = 1e-12 * self.current_scale
        self._clamp = drive.diode_drop / drive.switch_resistance if drive.switch_resistance > 0 else math.inf
        # Direction in which a jump of the idle leg's voltage bends the winding currents.
        freedom = np.eye(3) if drive.connection == "delta" else np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, -1.0]])
        self._kick = freedom @ np.linalg.solve(freedom.T @ self.inductance @ freedom, freedom.T @ self._lines[1])

    def circuit(self, conduction: Conduction) -> ConductionCircuit:
        """Look up, or build, the circuit of a conduction."""
        circuit = self._circuits.get(conduction)
        if circuit is None:
            circuit = self._circuits[conduction] = build_circuit(self.drive, conduction)
        return circuit

    def emf_per_speed(self, angle: float) -> Real:
        """EMF of the windings a, b, c at `angle` rad electrical since T1T2 began, in V/(rad/s), shape (3,)."""
        return np.asarray((self._emf @ np.exp(1j * self.orders * angle)).real)

    def run(self, currents: Real, *, speed: float, angle: float, duration: float) -> StateInterval:
        """Follow T1T2 for `duration` s from winding `currents` in A at `angle` rad electrical since the state began.

        Speed in mechanical rad/s, constant. Raises SixStepError when the conduction changes more often than any
        circuit of this kind can.
        """
        electrical_speed = self.drive.pole_pairs * speed
        segments: list[ConductionSegment] = []
        transition = np.eye(3)
        conduction = self._initial(currents, speed, angle)
        elapsed = 0.0
        while True:
            circuit = self.circuit(conduction)
            segment = self._segment(circuit, speed, angle + electrical_speed * elapsed, elapsed, currents)
            watched = segment.coefficients(circuit.watches)
            event = first_below_zero(watched, segment.exponents, len(circuit.rates), duration - elapsed)
            length = duration - elapsed if event is None else event[0]
            currents = segment.end_currents(length)
            transition = segment.transition(length) @ transition
            segments.append(self._with_duration(segment, length))
            if event is None:
                return StateInterval(tuple(segments), currents, transition)
            if len(segments) >= _MOST_SEGMENTS:
                raise SixStepError(
                    f"the diodes change more than {_MOST_SEGMENTS} times in one state at {speed:g} rad/s: "
                    "check inductances, resistances and EMF harmonics of the motor"
                )
            elapsed += length
            before = conduction
            conduction = self._after(conduction, circuit.successors[event[1]], currents, speed, angle, elapsed)
            if Idle.OPEN not in (before.idle, conduction.idle) and before.idle is not conduction.idle:
                transition = self._reversal(segment, length, conduction, speed, angle, elapsed, currents) @ transition

    def _segment(
        self, circuit: ConductionCircuit, speed: float, angle: float, start: float, currents: Real
    ) -> ConductionSegment:
        return make_segment(circuit, self.orders, self.drive.pole_pairs, speed, angle, start, currents)

    @staticmethod
    def _with_duration(segment: ConductionSegment, duration: float) -> ConductionSegment:
        return ConductionSegment(
            segment.circuit,
            segment.start,
            duration,
            segment.speed,
            segment.exponents,
            segment.emf_phase,
            segment.modes,
        )

    def _initial(self, currents: Real, speed: float, angle: float) -> Conduction:
        """Conduction that follows from the currents alone; an idle leg without current is asked for its voltage."""
        line = self._lines @ currents
        upper, lower = bool(line[0] < -self._clamp), bool(line[2] > self._clamp)
        if line[1] < -self._tolerance:
            return Conduction(Idle.UPPER_DIODE, upper, lower)
        if line[1] > self._tolerance:
            return Conduction(Idle.LOWER_DIODE, upper, lower)
        return self._without_idle_current(upper, lower, currents, speed, angle)

    def _without_idle_current(self, upper: bool, lower: bool, currents: Real, speed: float, angle: float) -> Conduction:
        floating = Conduction(Idle.OPEN, upper, lower)
        circuit = self.circuit(floating)
        margins = _evaluate(circuit.watches, circuit.weights @ currents, speed, np.exp(1j * self.orders * angle))
        if margins[0] < 0:
            return Conduction(Idle.UPPER_DIODE, upper, lower)
        if margins[1] < 0:
            return Conduction(Idle.LOWER_DIODE, upper, lower)
        return floating

    def _after(
        self, old: Conduction, what: str, currents: Real, speed: float, angle: float, elapsed: float
    ) -> Conduction:
        if what == "upper clamp":
            return Conduction(old.idle, not old.upper_clamped, old.lower_clamped)
        if what == "lower clamp":
            return Conduction(old.idle, old.upper_clamped, not old.lower_clamped)
        if what == "idle current zero":
            here = angle + self.drive.pole_pairs * speed * elapsed
            return self._without_idle_current(old.upper_clamped, old.lower_clamped, currents, speed, here)
        return Conduction(Idle(what), old.upper_clamped, old.lower_clamped)

    def _reversal(
        self,
        old: ConductionSegment,
        length: float,
        conduction: Conduction,
        speed: float,
        angle: float,
        elapsed: float,
        currents: Real,
    ) -> Real:
        """Saltation matrix where the idle current passes straight from one diode to the other."""
        here = angle + self.drive.pole_pairs * speed * elapsed
        new = self._segment(self.circuit(conduction), speed, here, elapsed, currents)
        row = self._lines[1]
        slope_before = row @ _slopes(old, length)
        slope_after = row @ _slopes(new, 0.0)
        if slope_before == 0.0:
            return np.eye(3)
        jump = np.outer(self._kick, row) / (row @ self._kick) * (1.0 - slope_after / slope_before)
        return np.asarray(np.eye(3) - jump)


def _slopes(segment: ConductionSegment, time: float) -> Real:
    rates = (segment.modes @ (segment.exponents * np.exp(segment.exponents * time))).real
    return np.asarray(segment.circuit.shapes @ rates)


def _evaluate(
    form: LinearForm, modal: Real, speed: float, phase: np.ndarray[tuple[int], np.dtype[np.complex128]]
) -> Real:
    return np.asarray(form.modal @ modal + form.constant + speed * (form.emf @ phase).real)
