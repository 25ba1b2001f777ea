"""English messages of the simulation, here and over its sockets, matched by their words so that a catalogue can translate them."""

import re
from functools import cache

from drivers.interfaces.text import Text, text

#: In the simulation's own words, its values named.
_SENTENCES = (
    text("a six-step drive"),
    text("an inverter"),
    text(
        "the diodes of {drive} that is off: the motor's EMF reaches {emf} V between its terminals and the bus has {bus} V, "
        "so that they conduct and brake the shaft; turn it more slowly, or take the wires off"
    ),
    text(
        "a six-step drive that commutates by faulty or turned Hall sensors; leave the motor's Hall faults out, or measure "
        "without it"
    ),
    text("a six-step drive on a motor whose iron takes currents; leave [virtual.iron] and [virtual.flux_map] out"),
    text("the shaft turns at {speed} rad/s; stop it before touching the coupling"),
    text("the rotor is locked; release it before turning or holding the shaft by hand"),
    text("the dynamometer drives the shaft; disable it before touching the shaft"),
    text("the shaft does not move: the rotor is stuck"),
    text("this motor has no Hall sensors"),
    text("node 'N': this motor's star point is not accessible; use the artificial 'star'"),
    text("star_point_accessible is set for a delta motor; only a wye has a star point"),
    text("phase_resistances has {count} values; a motor has three windings"),
    text("{name} is {value}; it must be positive and finite"),
    text("{name} is {value}; it must be finite and not negative"),
    text("{name} is {value}; it must be positive, infinite for an axis that does not saturate"),
    text("emf_shares are {shares}; they are three numbers of 0 … 2, a winding each"),
    text("turn_shares are {shares}; they are three numbers above 0 and up to 2, a winding each"),
    text("shorted turns beside eddy currents or saturation are not simulated; leave one of them out"),
    text("a flux map holds its saturation; leave the saturation currents out"),
    text(
        "shorted turns, eddy currents beside the windings and an EMF that is not in proportion to the speed are not "
        "simulated with a flux map or with the iron's loss; leave one of them out"
    ),
    text("eddy currents and saturation together are not simulated; leave one of them out"),
    text("exchanged terminals must be two different ones, not {terminal} twice"),
    text("flux_harmonics has order {order}, amplitude {amplitude}; orders are 2 or more, amplitudes finite"),
    text(
        "the flux map's differential inductances are not positive definite near id = {along} A, iq = {across} A: there "
        "more current would give less flux; look for a wrong value beside it, or give more points there"
    ),
)

#: What a six-step drive's solver refuses, told alike.
_SIX_STEP = (
    text("{name} is {value}: a finite number is needed"),
    text("{name} is {value}: it must be greater than 0"),
    text("{name} is {value}: it must be 0 or greater"),
    text("{name} is {value}: it must be 1 or more"),
    text('connection is "{connection}": "delta" or "wye" is allowed'),
    text(
        "mutual_inductance is {mutual} H with a self_inductance of {own} H: the inductance matrix is positive definite only for "
        "{low} H < mutual_inductance < {high} H"
    ),
    text("advance_angle is {angle}° electrical: it must lie within ±90°"),
    text("emf_harmonics holds order {order}: odd orders from 3 are allowed"),
    text("emf_harmonics holds order {order} twice: give each order once"),
    text("emf_harmonics, order {order}: amplitude and phase must be finite numbers"),
    text("load is {load} N·m: a finite torque is needed"),
    text(
        "the drive cannot start: it gives {torque} N·m at standstill against {friction} N·m of Coulomb friction; check source "
        "voltage, resistances, EMF constant and advance angle"
    ),
    text(
        "load {load} N·m is above the stall torque: less than {strongest} N·m at the shaft is allowed ({friction} N·m of friction "
        "taken off)"
    ),
    text(
        "load {load} N·m drives the machine harder than it can brake: no balance found below {speed} rpm; give a load nearer to 0"
    ),
    text(
        "run-up of {duration} s from {speed} rad/s at {angle} rad, {steps} steps a state: duration > 0, initial_speed ≥ 0, "
        "0 ≤ initial_angle < π/3 and steps_per_state ≥ 1 are allowed"
    ),
    text(
        "the diodes change more than {most} times in one state at {speed} rad/s: check inductances, resistances and EMF harmonics "
        "of the motor"
    ),
    text("speed is {speed} rad/s: a finite speed above 0 is needed (a drive at rest has no period)"),
    text(
        "speed is {speed} rpm: {lowest} to {highest} rpm can be solved for this drive, whose EMF equals its source at {no_load} rpm"
    ),
    text(
        "the resistances are too small to be distinguished from zero at {speed} rpm: an electrical time constant "
        "of {constant} s is {states} states, up to {most} are allowed"
    ),
    text("no periodic steady state found at {speed} rad/s after {count} iterations (residual {residual})"),
)


def simulation_error(error: Exception) -> Text:
    """Return the message of an error that came out of the simulation, or of who works in it."""
    return error.args[0] if error.args and isinstance(error.args[0], Text) else simulated(str(error))


def simulated(sentence: str) -> Text:
    """Return a sentence of the simulation with its values told apart; one that is not known stands as it is."""
    for pattern, template in _patterns():
        if match := pattern.fullmatch(sentence):
            return Text(template, {name: simulated(value) for name, value in match.groupdict().items()})
    return Text("{message}", {"message": sentence})


@cache
def _patterns() -> tuple[tuple[re.Pattern[str], str], ...]:
    return tuple((_pattern(each.template), each.template) for each in (*_SENTENCES, *_SIX_STEP))


def _pattern(template: str) -> re.Pattern[str]:
    pieces = re.split(r"\{(\w+)\}", template)
    return re.compile("".join(f"(?P<{each}>.+?)" if n % 2 else re.escape(each) for n, each in enumerate(pieces)))
