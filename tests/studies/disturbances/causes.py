"""Causes that the study draws, each from negligible to gross; listed ones, and those that no list of a real bench would hold."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

from tests.studies.disturbances.dirt import CURRENT, VOLTAGES, Dirt
from tests.studies.disturbances.drive_causes import BY_DRIVE, SOILS

STEP = ("dq-inductance-time-constant",)
EMF = ("back-emf-constant",)
SHAPE = ("back-emf-shape",)
RAMPS = ("inertia",)
LEVELS = ("torque-constant",)
SWEEP = ("dq-inductance-extremes",)
ALIGNED = ("dq-inductance-aligned",)
BRIDGES = ("dq-inductance-extremes", *ALIGNED)
BRIDGE_AND_WIRES = ("stator-resistance", "stator-resistance-dc")
WIRES = ("stator-resistance-dc",)
STROKES = ("flux-map-standstill",)
WIRES_AND_BRIDGES = (*WIRES, *BRIDGES)
_SLOW = {"at_frequency": False}
_TURN = 2.0 * math.pi


@dataclass(frozen=True)
class Cause:
    """One row of the study: what is disturbed, which procedures see it, and what makes a bench dirty with it.

    With `drive` the bench has the inverter that regulates d and q currents; `choices` are settings of the procedures. Of the procedures
    carried out `before`, no figure counts.
    """

    name: str
    procedures: tuple[str, ...]
    soil: Callable[[Dirt], None]
    listed: bool = True
    drive: bool = False
    choices: Mapping[str, object] = field(default_factory=dict)
    before: tuple[str, ...] = ()

    @property
    def row(self) -> str:
        """What its row is called."""
        chosen = "".join(f", {name}={str(value).lower()}" for name, value in self.choices.items())
        return " after ".join((self.drawn_by + chosen, *self.before))

    @property
    def drawn_by(self) -> str:
        """What its sizes are drawn by: rows that differ in choices alone are disturbed alike."""
        return " after ".join((f"{self.name} · {self.procedures[0]}", *self.before))


def _probe(dirt: Dirt, of_step: bool) -> int:
    return int(dirt.either(VOLTAGES[0], CURRENT)) if of_step else int(dirt.either(*VOLTAGES))


# Of the oscilloscope


def _clipped(of_step: bool) -> Callable[[Dirt], None]:
    def soil(dirt: Dirt) -> None:
        depth = dirt.log(0.002, 0.3)
        if not of_step:
            channels = VOLTAGES if dirt.either(True, False) else (_probe(dirt, False),)
            dirt.channel(*channels, limit=(1.0 - depth) * dirt.emf)
        elif dirt.either(True, False):
            dirt.channel(CURRENT, limit=(1.0 - depth) * dirt.step_current)
        else:
            # The probe is far from its zero: the top runs into the end of the converter's range, of 1.5 times the step.
            dirt.channel(CURRENT, offset=dirt.either(-1.0, 1.0) * (0.5 + depth) * dirt.step_current)

    return soil


def _hum(of_step: bool, *frequencies: float) -> Callable[[Dirt], None]:
    def soil(dirt: Dirt) -> None:
        number = _probe(dirt, of_step)
        size = dirt.log(0.0005, 0.1) * dirt.signal(number, of_step)
        dirt.channel(number, hum=size, hum_frequency=dirt.either(*frequencies), hum_phase=dirt.phase())

    return soil


def _coupled(of_step: bool) -> Callable[[Dirt], None]:
    def soil(dirt: Dirt) -> None:
        if of_step:
            corner = dirt.log(1e-4, 1.0) / (_TURN * dirt.time_constant)
            dirt.channel(dirt.either(CURRENT, VOLTAGES[0]), coupling_corner=corner)
        else:
            channels = VOLTAGES if dirt.either(True, False) else (_probe(dirt, False),)
            dirt.channel(*channels, coupling_corner=dirt.log(1e-3, 1.0) * dirt.emf_frequency)

    return soil


def _bandwidth(of_step: bool) -> Callable[[Dirt], None]:
    def soil(dirt: Dirt) -> None:
        if of_step:
            dirt.channel(_probe(dirt, True), pole=1.0 / (_TURN * dirt.log(1e-3, 0.3) * dirt.time_constant))
        else:
            dirt.channel(*VOLTAGES, pole=dirt.log(1.0, 300.0) * dirt.emf_frequency)

    return soil


def _skew(dirt: Dirt) -> None:
    dirt.channel(CURRENT, skew=dirt.either(-1.0, 1.0) * dirt.log(1e-4, 0.1) * dirt.time_constant)


def _ringing(dirt: Dirt) -> None:
    # From a slow current probe's to what the record has a few samples a period of.
    turning = dirt.log(8.0, 300.0) / dirt.time_constant
    dirt.channel(_probe(dirt, True), resonance=turning / _TURN, damping=dirt.log(0.03, 0.7))


def _factor(of_step: bool) -> Callable[[Dirt], None]:
    def soil(dirt: Dirt) -> None:
        share = dirt.either(0.1, 10.0, 1.0 + dirt.either(-1.0, 1.0) * dirt.log(0.003, 0.3), 0.5, 2.0)
        # What another attenuation shows the range must hold.
        dirt.channel(_probe(dirt, of_step), factor=share)

    return soil


def _wander(of_step: bool) -> Callable[[Dirt], None]:
    def soil(dirt: Dirt) -> None:
        number, record = _probe(dirt, of_step), 12.0 * dirt.time_constant if of_step else 0.1
        size = dirt.log(0.001, 0.1) * dirt.signal(number, of_step)
        dirt.channel(number, wander=size, wander_period=dirt.log(1.0, 100.0) * record, wander_phase=dirt.phase())

    return soil


def _alike_slow(dirt: Dirt) -> None:
    dirt.channel(*VOLTAGES, pole=dirt.log(10.0, 1000.0) * dirt.emf_frequency)


def _alike_ringing(dirt: Dirt) -> None:
    resonance = dirt.log(10.0, 300.0) * dirt.emf_frequency
    dirt.channel(*VOLTAGES, resonance=resonance, damping=dirt.log(0.03, 0.7))


def _alike_averaged(dirt: Dirt) -> None:
    dirt.channel(*VOLTAGES, average=dirt.log(1e-3, 0.1) / dirt.emf_frequency)


# Of the motor


def _saturation(dirt: Dirt) -> None:
    axes = ("d_axis_saturation_current", "q_axis_saturation_current")
    knee = dirt.log(1.5, 100.0) * dirt.step_current
    dirt.motor = replace(dirt.motor, **dict.fromkeys(axes, knee))


def _eddy(dirt: Dirt) -> None:
    resistance = dirt.log(0.3, 30.0) * sum(dirt.motor.phase_resistances) / 3.0
    dirt.iron(eddy_coupling=dirt.log(0.05, 0.6), eddy_resistance=resistance)


def _turns(dirt: Dirt) -> None:
    shares = 1.0 + dirt.log(1e-3, 0.03) * dirt.random.uniform(-1.0, 1.0, 3)
    a, b, c = (shares / shares.mean()).tolist()
    dirt.motor = replace(dirt.motor, turn_shares=(a, b, c))


def _emf_of_speed(dirt: Dirt) -> None:
    if dirt.either(True, False):
        dirt.iron(emf_corner=dirt.log(0.5, 100.0) * dirt.emf_frequency)
    else:
        dirt.iron(magnet_rise=dirt.log(0.5, 80.0), magnet_rise_speed=dirt.top_speed)


def _windage(dirt: Dirt) -> None:
    motor, top = dirt.motor, dirt.top_speed
    friction = motor.coulomb_friction + motor.viscous_friction * top
    dirt.bearing(windage=dirt.log(0.003, 1.0) * friction / top**2)


def _stribeck(dirt: Dirt) -> None:
    dirt.bearing(
        stribeck_torque=dirt.log(0.03, 3.0) * dirt.motor.coulomb_friction,
        stribeck_speed=dirt.log(0.03, 0.5) * dirt.top_speed,
        stribeck_exponent=dirt.either(1.0, 2.0),
    )


def _cogging(dirt: Dirt) -> None:
    # Few slots a pole pair make few and long waves.
    order = dirt.either(2, 6, 12) * dirt.motor.pole_pairs
    torque = dirt.log(0.1, 10.0) * dirt.motor.coulomb_friction
    dirt.motor = replace(dirt.motor, cogging_torque=torque, cogging_order=order)
    dirt.bearing(cogging_while_turning=True)


# Of the shaft's sensors


def _speed_filter(dirt: Dirt) -> None:
    dirt.sensors(speed_filter=dirt.log(0.002, 0.2))


def _torque_filter(longest: float) -> Callable[[Dirt], None]:
    return lambda dirt: dirt.sensors(torque_filter=dirt.log(0.002, longest))


def _dropouts(dirt: Dirt) -> None:
    dirt.sensors(dropouts=dirt.log(1e-4, 0.03))


def _runout(dirt: Dirt) -> None:
    dirt.sensors(speed_runout=dirt.log(1e-5, 0.01), torque_runout=dirt.log(0.01, 1.0) * dirt.motor.coulomb_friction)


# Of hands and contacts


def _regrips(dirt: Dirt) -> None:
    # A shaft that is turned very slowly, between fingers, goes on by a few degrees to a quarter turn at a time.
    dirt.hands(unevenness=dirt.log(0.05, 0.6), regrips=dirt.log(4.0, 100.0), regrip_time=dirt.log(0.2, 5.0))


def _thermal_emf(dirt: Dirt) -> None:
    dirt.contacts(thermal_emf=dirt.log(3e-7, 3e-4), thermal_time=dirt.log(10.0, 300.0))


def _contact(dirt: Dirt) -> None:
    dirt.contacts(
        resistance=dirt.log(1e-4, 0.1) * dirt.motor.stator_resistance_y,
        doubling_current=dirt.log(0.2, 3.0) * dirt.plate.rated_current,
        heating_time=dirt.log(0.5, 20.0),
    )


def _warm(dirt: Dirt) -> None:
    dirt.warmth = dirt.log(0.5, 80.0)
    dirt.hands(thermometer_share=float(dirt.random.uniform(0.0, 0.9)))


def _slips(dirt: Dirt) -> None:
    dirt.hands(slips=0.5)


# Not in anybody's list


def _jitter(of_step: bool) -> Callable[[Dirt], None]:
    def soil(dirt: Dirt) -> None:
        span = dirt.time_constant if of_step else 1.0 / (_TURN * dirt.emf_frequency)
        dirt.channel(*VOLTAGES, CURRENT, jitter=dirt.log(1e-3, 0.3) * span)

    return soil


def _warm_up(of_step: bool) -> Callable[[Dirt], None]:
    def soil(dirt: Dirt) -> None:
        rise = dirt.either(-1.0, 1.0) * dirt.log(1e-3, 0.1)
        dirt.channel(_probe(dirt, of_step), warm_up=rise, warm_up_time=dirt.log(1.0, 300.0))

    return soil


def _compensation(of_step: bool) -> Callable[[Dirt], None]:
    def soil(dirt: Dirt) -> None:
        span = dirt.time_constant if of_step else 1.0 / (_TURN * dirt.emf_frequency)
        more = dirt.either(-1.0, 1.0) * dirt.log(0.003, 0.2)
        dirt.channel(VOLTAGES[0], compensation=more, compensation_time=dirt.log(0.03, 3.0) * span)

    return soil


def _bow(of_step: bool) -> Callable[[Dirt], None]:
    def soil(dirt: Dirt) -> None:
        number = _probe(dirt, of_step)
        dirt.channel(number, bow=dirt.either(-1.0, 1.0) * dirt.log(1e-3, 0.1) / dirt.signal(number, of_step))

    return soil


def _pulses(dirt: Dirt) -> None:
    dirt.sensors(pulses=round(dirt.log(20.0, 5000.0)))


def _torque_drift(dirt: Dirt) -> None:
    dirt.sensors(torque_drift=dirt.log(1e-4, 0.1) * dirt.motor.coulomb_friction)


def _vibration(dirt: Dirt) -> None:
    friction = dirt.motor.coulomb_friction
    dirt.sensors(vibration=dirt.log(0.01, 3.0) * friction, vibration_frequency=dirt.log(0.3, 30.0))


def _supply_ripple(dirt: Dirt) -> None:
    dirt.supply(ripple=dirt.log(1e-3, 0.2) * dirt.step_voltage, frequency=dirt.either(100.0, 120.0))


def _nothing(_: Dirt) -> None:
    pass


#: What every row is to be held against: the same procedures on benches that nothing disturbs.
CLEAN = (
    *(
        Cause("none", names, _nothing)
        for names in (STEP, EMF, SHAPE, RAMPS, SWEEP, ALIGNED, BRIDGE_AND_WIRES, WIRES_AND_BRIDGES)
    ),
    *(Cause("none", names, _nothing, choices=_SLOW) for names in (BRIDGES, WIRES_AND_BRIDGES)),
    *(Cause("none", names, _nothing, drive=True) for names in BY_DRIVE),
    Cause("none", STROKES, _nothing, drive=True, before=WIRES),
)

LISTED = (
    Cause("clipped", STEP, _clipped(True)),
    Cause("clipped", EMF, _clipped(False)),
    Cause("hum", STEP, _hum(True, 50.0, 60.0)),
    Cause("hum", EMF, _hum(False, 50.0, 60.0)),
    Cause("ac-coupled", STEP, _coupled(True)),
    Cause("ac-coupled", EMF, _coupled(False)),
    Cause("bandwidth", STEP, _bandwidth(True)),
    Cause("bandwidth", EMF, _bandwidth(False)),
    Cause("bandwidth", SHAPE, _alike_slow),
    Cause("ringing", SHAPE, _alike_ringing),
    Cause("skew", STEP, _skew),
    Cause("ringing", STEP, _ringing),
    Cause("probe-factor", STEP, _factor(True)),
    Cause("probe-factor", EMF, _factor(False)),
    Cause("slope", STEP, _wander(True)),
    Cause("saturation", STEP, _saturation),
    Cause("second-time-constant", STEP, _eddy),
    Cause("unlike-turns", ALIGNED, _turns),
    Cause("second-time-constant", ALIGNED, _eddy, choices=_SLOW),
    Cause("second-time-constant", BRIDGES, _eddy),
    Cause("second-time-constant", BRIDGES, _eddy, choices=_SLOW),
    Cause("second-time-constant", WIRES_AND_BRIDGES, _eddy, choices=_SLOW),
    Cause("second-time-constant", BRIDGE_AND_WIRES, _eddy),
    Cause("speed-trend", EMF, _emf_of_speed),
    Cause("windage", RAMPS, _windage),
    Cause("stribeck", RAMPS, _stribeck),
    Cause("cogging", RAMPS, _cogging),
    Cause("speed-filter", RAMPS, _speed_filter),
    Cause("torque-filter", RAMPS, _torque_filter(0.2)),
    Cause("torque-filter", LEVELS, _torque_filter(2.0)),
    Cause("dropouts", RAMPS, _dropouts),
    Cause("eccentricity", RAMPS, _runout),
    Cause("regrip", SWEEP, _regrips),
    Cause("thermal-emf", WIRES, _thermal_emf),
    Cause("contact", BRIDGE_AND_WIRES, _contact),
    Cause("warm-winding", (*BRIDGE_AND_WIRES, *EMF), _warm),
    Cause("slipped-point", BRIDGE_AND_WIRES, _slips),
)

UNLISTED = (
    Cause("ground-loop", STEP, _hum(True, 16.7), listed=False),
    Cause("supply-ripple", STEP, _supply_ripple, listed=False),
    Cause("supply-ripple", WIRES, _supply_ripple, listed=False),
    Cause("ground-loop", EMF, _hum(False, 16.7), listed=False),
    Cause("clock-jitter", STEP, _jitter(True), listed=False),
    Cause("clock-jitter", EMF, _jitter(False), listed=False),
    Cause("gain-warming-up", STEP, _warm_up(True), listed=False),
    Cause("gain-warming-up", EMF, _warm_up(False), listed=False),
    Cause("probe-compensation", STEP, _compensation(True), listed=False),
    Cause("probe-compensation", EMF, _compensation(False), listed=False),
    Cause("distortion", STEP, _bow(True), listed=False),
    Cause("distortion", EMF, _bow(False), listed=False),
    Cause("moving-average", SHAPE, _alike_averaged, listed=False),
    Cause("pulse-counting", RAMPS, _pulses, listed=False),
    Cause("torque-zero-drift", RAMPS, _torque_drift, listed=False),
    Cause("vibration", RAMPS, _vibration, listed=False),
)

#: Of the drive that regulates currents.
DRIVE = (
    *(Cause(name, names, soil, drive=True) for name, soil in SOILS.items() for names in BY_DRIVE),
    Cause("drive-current-gain", STROKES, SOILS["drive-current-gain"], drive=True, before=WIRES),
)

#: All of them by their rows.
BY_ROW = {cause.row: cause for cause in (*CLEAN, *LISTED, *UNLISTED, *DRIVE)}

#: Two laws of the iron that the virtual motor cannot have at once.
_APART = ({"saturation", "second-time-constant"},)


def named(names: tuple[str, ...]) -> tuple[Cause, ...]:
    """Return the causes of these names, all of them where none is given. Raises SystemExit naming those there are."""
    known = (*CLEAN, *LISTED, *UNLISTED, *DRIVE)
    groups = {"listed": LISTED, "unlisted": UNLISTED, "drive": DRIVE}
    unknown = set(names) - {cause.name for cause in known} - set(groups)
    if unknown:
        raise SystemExit(
            f"--disturbed: {', '.join(sorted(unknown))} is no cause; there are "
            f"{', '.join(dict.fromkeys(cause.name for cause in known))}, and for groups {', '.join(groups)}"
        )
    if not names:
        return known
    wanted = {cause.row for name in names for cause in groups.get(name, ())}
    return tuple(cause for cause in known if cause.name in names or cause.row in wanted)


def partners(cause: Cause) -> tuple[Cause, ...]:
    """Return the listed causes that one procedure can meet together with this one."""
    return tuple(
        other
        for other in LISTED
        if other.name != cause.name
        and set(other.procedures) & set(cause.procedures)
        and {cause.name, other.name} not in _APART
    )
