"""A second reading of the bridge: the whole six-state cycle stepped by scipy's solve_ivp, leg by leg.

It shares no formulation with the model: physical legs instead of one folded state, leg voltages evaluated in the right
hand side (with the switches' kink left in it), an explicit voltage for an open leg, waiting instead of shooting.
"""

import math

import numpy as np
from scipy.integrate import solve_ivp

from sim_instruments.six_step.drive import SixStepDrive

# (leg on the positive rail, leg on the negative rail) of T1T2, T2T3, … T6T1
SEQUENCE = ((0, 2), (1, 2), (1, 0), (2, 0), (2, 1), (0, 1))
OPEN, UPPER, LOWER = 0, 1, -1
# The phase that comes before each one, and the one after it.
BEFORE, AFTER = np.array([2, 0, 1]), np.array([1, 2, 0])
PHASES = np.array([0.0, 2 * math.pi / 3, 4 * math.pi / 3])


class Reference:
    """The drive at constant speed (rad/s), or with its shaft free when `speed` is None."""

    def __init__(self, drive: SixStepDrive, speed: float | None, load_torque: float = 0.0) -> None:
        self.drive, self.speed, self.load_torque = drive, speed, load_torque
        self.delta = drive.connection == "delta"
        self.start_angle = (math.pi / 6 if self.delta else 0.0) - drive.advance_angle
        a, b = drive.self_inductance, drive.mutual_inductance
        self.inverse = np.linalg.inv(np.array([[a, b, b], [b, a, b], [b, b, a]]))
        self.star = self.inverse.sum(axis=1) / self.inverse.sum()
        harmonics = [(1, 1.0, 0.0)] + [(h.order, h.amplitude, h.phase) for h in drive.emf_harmonics]
        self.orders, self.amplitudes, self.shifts = np.array(harmonics).T

    def emf_per_speed(self, angle: float) -> np.ndarray:
        phi = angle + self.start_angle - PHASES
        return self.drive.emf_constant * (
            self.amplitudes @ np.cos(np.outer(self.orders, phi) + self.shifts[:, np.newaxis])
        )

    def lines(self, i: np.ndarray) -> np.ndarray:
        return i - i[BEFORE] if self.delta else i

    def leg_voltages(self, i: np.ndarray, state: int, mode: int, emf: np.ndarray) -> tuple[np.ndarray, float, int]:
        d = self.drive
        up, low = SEQUENCE[state]
        off = 3 - up - low
        j = self.lines(i)
        bus = d.source_voltage - d.source_resistance * (j[up] + (j[off] if mode == UPPER else 0.0))
        v = np.empty(3)
        v[up] = bus - max(d.switch_resistance * j[up], -d.diode_drop)
        v[low] = max(-d.switch_resistance * j[low], -d.diode_drop)
        v[off] = 0.0 if mode == OPEN else (bus + d.diode_drop if mode == UPPER else -d.diode_drop)
        if mode == OPEN:
            base = self.lines(self.slopes(i, v, emf))[off]
            v[off] = 1.0
            v[off] = -base / (self.lines(self.slopes(i, v, emf))[off] - base)
        return v, bus, off

    def slopes(self, i: np.ndarray, v: np.ndarray, emf: np.ndarray) -> np.ndarray:
        across = v - v[AFTER] if self.delta else v
        free = self.inverse @ (across - self.drive.resistance * i - emf)
        if self.delta:
            return free
        return free - self.star * free.sum()

    def rhs(self, t: float, y: np.ndarray, state: int, mode: int) -> np.ndarray:
        i, angle = y[:3], y[3]
        speed = y[4] if self.speed is None else self.speed
        shape = self.emf_per_speed(angle)
        v, _, _ = self.leg_voltages(i, state, mode, speed * shape)
        out = np.empty_like(y)
        out[:3] = self.slopes(i, v, speed * shape)
        out[3] = self.drive.pole_pairs * speed
        if self.speed is None:
            out[4] = (shape @ i - self.drive.friction_torque(speed) - self.load_torque) / self.drive.inertia
            if speed <= 1e-6:
                # At rest, friction and brake only hold.
                out[4] = max(0.0, out[4])
        return out

    def run_state(self, y: np.ndarray, number: int, t_end: float = math.inf, rtol: float = 1e-9) -> tuple:
        """From anywhere in the state `number` to its end (or to t_end); y = currents, angle[, speed]; returns y, time."""
        state = number % 6
        end_angle = (number + 1) * math.pi / 3
        time = 0.0
        mode = self.mode_now(y, state)
        while True:
            up, low = SEQUENCE[state]
            off = 3 - up - low

            def reached(t: float, y: np.ndarray) -> float:
                return y[3] - end_angle

            def current(t: float, y: np.ndarray, off: int = off, mode: int = mode) -> float:
                # Past zero by a hair: else a diode that has just begun is found to end at once.
                return self.lines(y[:3])[off] - 1e-10 * mode

            def above(t: float, y: np.ndarray) -> float:
                v, bus, leg = self.leg_voltages(y[:3], state, OPEN, self.emf_at(y))
                return v[leg] - bus - self.drive.diode_drop

            def below(t: float, y: np.ndarray) -> float:
                v, _, leg = self.leg_voltages(y[:3], state, OPEN, self.emf_at(y))
                return v[leg] + self.drive.diode_drop

            reached.terminal = above.terminal = below.terminal = current.terminal = True
            reached.direction, above.direction, below.direction = 1, 1, -1
            current.direction = 1 if mode == UPPER else -1
            events = [reached, above, below] if mode == OPEN else [reached, current]
            if self.speed is None:
                longest, span = 5e-5, t_end - time
            else:
                span = (end_angle - y[3]) / (self.drive.pole_pairs * self.speed)
                longest, events = span / 8 + 1e-12, events[1:]
            result = solve_ivp(
                lambda t, y, m=mode: self.rhs(t, y, state, m),
                (0.0, span),
                y,
                method="DOP853",
                rtol=rtol,
                atol=1e-11,
                max_step=longest,
                events=events,
            )
            y, time = result.y[:, -1], time + result.t[-1]
            if result.status == 0 or (self.speed is None and len(result.t_events[0])):
                return y, time
            mode = self.mode_now(y, state, after=mode)

    def emf_at(self, y: np.ndarray) -> np.ndarray:
        return (y[4] if self.speed is None else self.speed) * self.emf_per_speed(y[3])

    def mode_now(self, y: np.ndarray, state: int, after: int | None = None) -> int:
        up, low = SEQUENCE[state]
        j = self.lines(y[:3])[3 - up - low]
        if after is None and abs(j) > 1e-8:
            return UPPER if j < 0 else LOWER
        v, bus, off = self.leg_voltages(y[:3], state, OPEN, self.emf_at(y))
        if v[off] > bus + self.drive.diode_drop - 1e-9:
            return UPPER
        if v[off] < -self.drive.diode_drop + 1e-9:
            return LOWER
        return OPEN

    def periodic(
        self, start: np.ndarray | None = None, tolerance: float = 1e-8, most: int = 3000
    ) -> tuple[np.ndarray, int]:
        """Winding currents at the start of a T1T2 once they repeat after six states, and the states it took.

        They begin at zero, or at `start`.
        """
        y = np.zeros(4)
        y[:3] = 0.0 if start is None else start
        starts: list[np.ndarray] = []
        for number in range(most):
            if number % 6 == 0:
                starts.append(y[:3])
                if len(starts) > 1 and np.abs(starts[-1] - starts[-2]).max() < tolerance:
                    return y[:3], number
            y, _ = self.run_state(y, number)
            y[3] = (number + 1) * math.pi / 3
        raise AssertionError("the reference did not become periodic")
