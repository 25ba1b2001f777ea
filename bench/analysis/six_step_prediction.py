"""Speed and current of a six-step drive at loads and voltages that were not measured, from what a run found."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.i18n.errors import InputError
from bench.i18n.simulated import simulation_error
from drivers.interfaces.text import text
from sim_instruments.six_step.drive import SixStepDrive, SixStepError
from sim_instruments.six_step.load import balance_load
from sim_instruments.six_step.state import Bridge
from sim_instruments.six_step.steady_state import SteadyState, steady_state

PROCEDURE = "equivalent-resistance"
_RPM = math.pi / 30.0
_NAMES = ("line_emf_constant", "switch_resistance", "winding_resistance", "winding_inductance")
#: The peak of the EMF behind its mean over a state, between the terminals.
_PEAK = math.pi / 3.0
#: A voltage within so much of that of the run counts as the run's own.
_SAME_VOLTAGE = 0.02
#: Standard deviation of a rectangular distribution of half-width one.
_RECTANGULAR = 1.0 / math.sqrt(3.0)
#: Relative steps of the derivatives.
_STEP = 1e-3

Array = NDArray[np.float64]


@dataclass(frozen=True)
class PredictedFigure:
    """A predicted figure and its standard uncertainty."""

    value: float
    standard_uncertainty: float

    def as_dict(self) -> dict[str, float]:
        """Return it as `--json` prints it: with the half-width of the 95 % interval."""
        return {
            "value": self.value,
            "standard_uncertainty": self.standard_uncertainty,
            "U": 2.0 * self.standard_uncertainty,
        }


@dataclass(frozen=True)
class Prediction:
    """The prediction at one source voltage (V) and shaft load (N·m): speed (rad/s) and current from the source (A).

    `line_speed` and `line_current` are what the straight line R_c(ω) gives alone. `measured` tells whether the run went there.
    """

    voltage: float
    load: float
    speed: PredictedFigure
    current: PredictedFigure
    line_speed: float
    line_current: float
    measured: bool


@dataclass(frozen=True)
class Friction:
    """The motor's own friction: Coulomb (N·m) and viscous (N·m·s/rad), with their standard uncertainties."""

    coulomb: float
    viscous: float
    coulomb_uncertainty: float = 0.0
    viscous_uncertainty: float = 0.0

    def at(self, speed: float) -> float:
        """Return the torque (N·m) at a speed (rad/s)."""
        return self.coulomb + self.viscous * speed

    def uncertainty_at(self, speed: float) -> float:
        """Return the standard uncertainty (N·m) at a speed (rad/s), the two taken as independent."""
        return math.hypot(self.coulomb_uncertainty, self.viscous_uncertainty * speed)


class MeasuredDrive:
    """The six-step drive as a run of `equivalent-resistance` found it.

    The source is the straight line of the bus voltages over the currents. With the motor's own `friction` a load is one at its shaft;
    without, it is one that the same dynamometer shows: what the bearings of both take is seen in the run, and taken as the same at
    all speeds.
    """

    def __init__(
        self, findings: Mapping[str, Any], connection: str, diode_drop: float, friction: Friction | None = None
    ) -> None:
        """Take a run's findings. Raises InputError where it went to too few loads."""
        self._friction = friction
        parts = findings["parts"]
        self._values = np.array([parts["values"][name] for name in _NAMES])
        self._covariance = np.array(parts["covariance"])
        self._connection, self._diode_drop = connection, diode_drop
        rows = [row for row in findings["points"] if row["copper_resistance"] is not None]
        if len(rows) < 3:
            raise InputError(text("the run separated the currents at {n} loads; three are needed", n=len(rows)))

        def column(key: str) -> Array:
            return np.array([row[key] for row in rows], dtype=float)

        self._speed = column("speed_rpm") * _RPM
        self._current, self._torque = column("bus_current"), column("shaft_torque")
        self._copper = np.polyfit(self._current, column("copper_resistance"), 1)
        self._pole_pairs = round(float(np.median(2.0 * math.pi * column("electrical_frequency") / self._speed)))
        fall, self.source_voltage = (float(c) for c in np.polyfit(self._current, column("bus_voltage"), 1))
        self.source_resistance = max(-fall, 0.0)
        self._bus = column("bus_voltage")
        self._line = findings["commutation_over_speed"]
        self._torque_u = float(column("shaft_torque_limit").max()) * _RECTANGULAR
        #: Torque (N·m) that the currents make and the dynamometer does not show, at the run's loads.
        self.lost_torque = self._lost(self._values)

    def predict(self, voltage: float, load: float) -> Prediction:
        """Return what is expected at a source voltage (V) and a shaft load (N·m). Raises InputError where there is no balance."""
        steps = _STEP * np.abs(self._values)
        best = self._solve(self._values, voltage, load)
        slopes = np.array(
            [
                (self._solve(self._values + step * unit, voltage, load) - best) / step
                for step, unit in zip(steps, np.eye(len(_NAMES)), strict=True)
            ]
        )
        by_torque = (self._solve(self._values, voltage, load + (d := 1e-3 * max(abs(load), 0.01))) - best) / d
        torque_u = self._torque_u if self._friction is None else self._friction.uncertainty_at(float(best[0]))
        variance = np.einsum("ik,ij,jk->k", slopes, self._covariance, slopes) + (by_torque * torque_u) ** 2
        line = self._by_line(voltage, load, best)
        return Prediction(
            voltage,
            load,
            PredictedFigure(float(best[0]), math.sqrt(float(variance[0]))),
            PredictedFigure(float(best[1]), math.sqrt(float(variance[1]))),
            line_speed=line[0],
            line_current=line[1],
            measured=abs(voltage / self.source_voltage - 1.0) <= _SAME_VOLTAGE
            and float(self._torque.min()) * 0.98 <= load <= 1.02 * float(self._torque.max()),
        )

    def _drive(self, values: Array, voltage: float) -> SixStepDrive:
        k_e, switch, resistance, inductance = (float(v) for v in values)
        # Seen from the terminals only L11 − L12 counts: all of it stands in L11.
        return SixStepDrive(
            connection="delta" if self._connection == "delta" else "wye",
            resistance=resistance,
            self_inductance=inductance,
            mutual_inductance=0.0,
            emf_constant=k_e * _PEAK / (1.0 if self._connection == "delta" else math.sqrt(3.0)),
            pole_pairs=self._pole_pairs,
            source_voltage=voltage,
            source_resistance=self.source_resistance,
            switch_resistance=max(switch, 0.0),
            diode_drop=self._diode_drop,
            inertia=1.0,
        )

    def _lost(self, values: Array) -> float:
        """Return the torque (N·m) that the currents make and the dynamometer does not see, mean of the loads."""
        found = []
        for speed, bus, current, torque in zip(self._speed, self._bus, self._current, self._torque, strict=True):
            drive = self._drive(values, float(bus + self.source_resistance * current))
            found.append(_solved(partial(steady_state, Bridge(drive), float(speed))).load_torque - float(torque))
        return float(np.mean(found))

    def _solve(self, values: Array, voltage: float, load: float) -> Array:
        """Return speed (rad/s) and current (A)."""
        drive, lost = self._drive(values, voltage), 0.0
        if self._friction is not None:
            own = self._friction
            drive = replace(drive, coulomb_friction=own.coulomb, viscous_friction=own.viscous)
        else:
            lost = self.lost_torque if values is self._values else self._lost(values)
        point = _solved(partial(balance_load, Bridge(drive), load + lost))
        return np.array([point.speed, point.average_supply_current])

    def _by_line(self, voltage: float, load: float, start: Array) -> tuple[float, float]:
        """Return speed (rad/s) and current (A) by R_eq = 2·R_t + copper + R_c(ω), and torque = k_e·I + c·I² − c_0 of the run's loads."""
        k_e, switch = float(self._values[0]), float(self._values[1])
        design = np.column_stack((np.ones_like(self._current), self._current**2))
        less, gain = np.linalg.lstsq(design, self._torque - k_e * self._current, rcond=None)[0]
        # The dynamometer's bearings are in what the run's loads lose, and not in a load at the shaft.
        tare = 0.0 if self._friction is None else self.lost_torque - self._friction.at(float(self._speed.mean()))

        currents = np.roots([gain, k_e, less + tare - load])
        real = currents.real[np.isreal(currents)]
        if not real.size:
            raise InputError(
                text(
                    "no current makes {load:g} N·m by the torque of the run's loads: that is too far from what the run measured; "
                    "give loads nearer to it",
                    load=load,
                )
            )
        current = float(real[np.argmin(np.abs(real - start[1]))])
        resistance = (
            self.source_resistance + 2.0 * switch + float(np.polyval(self._copper, current)) + self._line["offset"]
        )
        return (voltage - resistance * current) / (k_e + self._line["slope"] * current), current


def exact(drive: SixStepDrive, voltage: float, load: float) -> tuple[float, float]:
    """Return speed (rad/s) and current (A) of a known drive at another source voltage (V). Raises InputError without a balance."""
    point = _solved(partial(balance_load, Bridge(replace(drive, source_voltage=voltage)), load))
    return point.speed, point.average_supply_current


def _solved(solve: Callable[[], SteadyState]) -> SteadyState:
    try:
        return solve()
    except SixStepError as error:
        raise InputError(simulation_error(error)) from None


def findings_of(results: Mapping[str, Any], run: str) -> Mapping[str, Any]:
    """Return the findings of `equivalent-resistance` of a run. Raises InputError where it has none, or of an older program, or withheld."""
    result = results.get(PROCEDURE)
    if result is not None and result.withheld:
        why = result.withheld[0].sentence
        raise InputError(
            text("{run}: the loads gave no figures, so nothing can be predicted from them; {why}", run=run, why=why)
        )
    findings: Mapping[str, Any] = {} if result is None else result.findings
    if "parts" not in findings:
        raise InputError(
            text(
                "{run}: no {procedure} with the winding's figures in it; run it first: motorbench run {procedure}",
                run=run,
                procedure=PROCEDURE,
            )
        )
    return findings


def predictions(drive: MeasuredDrive, voltages: Sequence[float], loads: Sequence[float]) -> list[Prediction]:
    """Return the predictions of every load at every voltage."""
    return [drive.predict(voltage, load) for voltage in voltages for load in loads]
