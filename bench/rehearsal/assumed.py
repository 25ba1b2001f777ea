"""A plausible motor where the file holds no virtual one: type values first, then the plate, then rules of thumb."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace

from bench.motor.motor_file import MotorFile
from drivers.interfaces.text import Text, text
from procedures.core.nameplate import Nameplate, WindingConnection
from procedures.core.parameters import PARAMETERS
from sim_instruments.physics.motor.hall import SimulatedHallSensors
from sim_instruments.physics.motor.motor import Connection as Winding
from sim_instruments.physics.motor.motor import VirtualMotor
from sim_instruments.six_step.drive import SixStepDrive

_RPM = math.pi / 30.0
#: Rules of thumb for a servo motor: EMF at rated speed over what the voltage allows, copper drop at rated current over the
#: phase voltage, time constant (s) and saliency of the winding, time (s) in which rated torque brings the rotor to rated
#: speed, friction over rated torque, warming (K) by rated current.
_EMF_SHARE, _DROP_SHARE, _TIME_CONSTANT, _SALIENCY, _RUN_UP, _FRICTION, _WARMING = 0.8, 0.06, 1e-3, 1.2, 0.1, 0.01, 80.0
#: What is taken where not even the plate helps.
_POLE_PAIRS, _SPEED_RPM, _VOLTAGE = 4, 3000.0, 48.0
#: Mutual over self-inductance of two phases, and source and bridge resistance over the winding's.
_MUTUAL, _SOURCE_SHARE, _SWITCH_SHARE, _DIODE_DROP = -0.3, 0.2, 0.1, 0.7


@dataclass(frozen=True)
class Assumption:
    """One figure that the twin was given: what it is, its value and unit, and where it was taken from."""

    name: str
    value: float
    unit: str
    why: Text


@dataclass
class _Figures:
    """Collects what is assumed; an expected type value goes before any rule."""

    plate: Nameplate
    assumed: list[Assumption] = field(default_factory=list)

    def take(self, name: str, rule: Callable[[], float], why: Text) -> float:
        """Return a type value where the file expects one, else what the rule gives."""
        expected = self.plate.expected.get(name)
        value = rule() if expected is None else expected
        self.assumed.append(Assumption(name, value, PARAMETERS[name].unit, why if expected is None else _EXPECTED))
        return value

    def plated(self, name: str, unit: str, *plates: tuple[float | None, str], otherwise: float) -> float:
        """Return the first figure that the plate holds, else a usual one."""
        for value, _ in plates:
            if value is not None:
                return value
        missing = " / ".join(key for _, key in plates)
        self.assumed.append(
            Assumption(name, otherwise, unit, text("a typical value: the file gives no {keys}", keys=missing))
        )
        return otherwise


_EXPECTED = text("type value, [expected] of the motor file")


def completed(motor: MotorFile) -> tuple[MotorFile, tuple[str, ...]]:
    """Return a motor file with a motor to simulate, and the names of the figures that were assumed of it, in order."""
    if motor.virtual is not None:
        return motor, ()
    truth, assumed = assumed_motor(motor.nameplate)
    return replace(motor, virtual=truth), tuple(sorted(one.name for one in assumed))


def assumed_motor(plate: Nameplate) -> tuple[VirtualMotor, tuple[Assumption, ...]]:
    """Return a motor that fits what is known of this one, and every figure that was assumed, per phase of the Y-equivalent."""
    figures = _Figures(plate)
    given = plate.expected.get("pole_pairs", plate.pole_pairs)
    pairs = round(figures.plated("pole_pairs", "1", (given, "pole_pairs"), otherwise=_POLE_PAIRS))
    speed = _RPM * figures.plated(
        "rated_speed", "rpm", (plate.rated_speed_rpm, "rated_speed_rpm"), otherwise=_SPEED_RPM
    )
    voltage = figures.plated(
        "rated_voltage",
        "V",
        (plate.rated_voltage, "rated_voltage"),
        (plate.maximum_voltage, "maximum_voltage"),
        otherwise=_VOLTAGE,
    )
    phase = voltage / math.sqrt(3.0)
    flux = figures.take(
        "flux_linkage",
        lambda: _flux_of_constants(plate, pairs) or _EMF_SHARE * phase / (speed * pairs),
        text("an EMF of {share:.0%} of the rated voltage at rated speed", share=_EMF_SHARE),
    )
    resistance = figures.take(
        "stator_resistance",
        lambda: _DROP_SHARE * phase / plate.rated_current,
        text("a copper drop of {share:.0%} of the rated voltage at rated current", share=_DROP_SHARE),
    )
    time_constant = text("a winding's time constant of {tau:g} ms", tau=1e3 * _TIME_CONSTANT)
    d_axis = figures.take("d_axis_inductance", lambda: _TIME_CONSTANT * resistance, time_constant)
    q_axis = figures.take(
        "q_axis_inductance",
        lambda: _SALIENCY * d_axis,
        text("{ratio:g} times the d axis'", ratio=_SALIENCY),
    )
    torque = 1.5 * pairs * flux * plate.rated_current
    inertia = figures.take(
        "inertia",
        lambda: _RUN_UP * torque / speed,
        text("rated speed within {time:g} s by rated torque", time=_RUN_UP),
    )
    share = text("{share:.0%} of rated torque", share=_FRICTION)
    coulomb = figures.take("coulomb_friction", lambda: _FRICTION * torque, share)
    viscous = figures.take("viscous_friction", lambda: _FRICTION * torque / speed, share)
    delta = plate.connection is WindingConnection.DELTA
    winding: Winding = "delta" if delta else "wye"
    # A delta's windings have three times the impedance of the wye that they look like, and √3 of its flux linkage.
    impedance, linked = (3.0, math.sqrt(3.0)) if delta else (1.0, 1.0)
    motor = VirtualMotor(
        connection=winding,
        phase_resistances=(impedance * resistance,) * 3,
        d_axis_inductance=impedance * d_axis,
        q_axis_inductance=impedance * q_axis,
        flux_linkage=linked * flux,
        pole_pairs=pairs,
        inertia=inertia,
        coulomb_friction=coulomb,
        viscous_friction=viscous,
        thermal_resistance=_WARMING / (1.5 * plate.rated_current**2 * resistance),
        halls=None if plate.hall_sensors is False else SimulatedHallSensors(),
    )
    return motor, tuple(figures.assumed)


def assumed_drive(motor: VirtualMotor, plate: Nameplate) -> tuple[SixStepDrive, tuple[Assumption, ...]]:
    """Return a six-step drive for a motor whose file has none, and what was assumed of it."""
    figures = _Figures(plate)
    voltage = figures.plated(
        "source_voltage",
        "V",
        (plate.rated_voltage, "rated_voltage"),
        (plate.maximum_voltage, "maximum_voltage"),
        otherwise=_VOLTAGE,
    )
    resistance = sum(motor.phase_resistances) / 3.0
    inductance = 0.5 * (motor.d_axis_inductance + motor.q_axis_inductance)
    own = inductance / (1.0 - _MUTUAL)
    drive = SixStepDrive(
        connection=motor.connection,
        resistance=resistance,
        self_inductance=own,
        mutual_inductance=_MUTUAL * own,
        emf_constant=motor.flux_linkage * motor.pole_pairs,
        pole_pairs=motor.pole_pairs,
        source_voltage=voltage,
        source_resistance=_SOURCE_SHARE * resistance,
        switch_resistance=_SWITCH_SHARE * resistance,
        diode_drop=_DIODE_DROP,
        inertia=motor.inertia,
        coulomb_friction=motor.coulomb_friction,
        viscous_friction=motor.viscous_friction,
    )
    no_drive = text("the motor file has no [virtual.drive]")
    return drive, (
        *figures.assumed,
        Assumption("source_resistance", drive.source_resistance, "Ω", no_drive),
        Assumption("switch_resistance", drive.switch_resistance, PARAMETERS["switch_resistance"].unit, no_drive),
        Assumption("diode_drop", drive.diode_drop, "V", no_drive),
    )


def _flux_of_constants(plate: Nameplate, pairs: int) -> float | None:
    """Return the flux linkage (V·s/rad) of a constant that the file expects, None without one."""
    emf = plate.expected.get("back_emf_constant_mechanical")
    if emf is not None:
        return emf / pairs
    torque = plate.expected.get("torque_constant")
    return None if torque is None else torque / (1.5 * pairs)
