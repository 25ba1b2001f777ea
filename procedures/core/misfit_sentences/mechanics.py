"""Sentences of misfits in records of the shaft: ramps, coast-downs, cogging, torque constants."""

from drivers.interfaces.text import text
from procedures.estimation.fitting.misfit import Cause

_SEEN_IN_COAST = {
    Cause.UNEXPLAINED: text(
        "the fit gives a negative friction, which is impossible: the friction of this shaft follows none of the laws that are fitted, or "
        "something drove or braked it"
    ),
}
#: Of ramps and coast-downs.
_SEEN_IN_RAMP = {
    Cause.TOO_COARSE: text(
        "the speed reading stays the same for {readings:.0f} readings ({time:.2g} s) on average and then jumps by "
        "about {step:.3g} rad/s, as that of a tachometer with few pulses per turn or of a counter with a long "
        "gate does. The speed between the jumps is not seen: use an encoder with more pulses per turn, or a "
        "shorter gate"
    ),
}
_SEEN_IN_RAMP_COUNTED = {
    Cause.TOO_COARSE: text(
        "the speed is read in steps of {step:.3g} rad/s up to {top:.3g} rad/s, as few pulses counted over a short time give it: use a "
        "sensor of more pulses a turn, count for longer, or ramp to a higher speed"
    ),
}
#: Of something that comes again more often than the readings follow.
_SEEN_IN_RAMP_SELDOM = {
    Cause.COGGING: text(
        "the speed has a ripple that comes again with the shaft's angle, as cogging or torque ripple causes it; the readings are too far "
        "apart to tell how often in a turn"
    ),
}
#: Of a record that no term explains: which were tried.
_SEEN_IN_RAMP_TRIED = {
    Cause.UNEXPLAINED: text(
        "inertia and friction do not explain the course of the speed, nor does any known cause that was tried "
        "({tried}): look for another torque on the shaft (shorted leads, a coupled machine), and for a filter or "
        "a counter gate in the speed signal"
    ),
}
#: What is said of a slow turn's torque.
_SEEN_IN_COGGING = {
    Cause.TOO_COARSE: text(
        "all torque readings lie within {span:.3g} N·m, and the sensor's step is {resolution:.3g} N·m: the cogging is too small for it, or "
        "it stands at an end of its range. Use a finer sensor, or show more decimals at its display and in the station file"
    ),
    Cause.DROPOUTS: text(
        "{count:.0f} of {readings:.0f} torque readings are invalid and were left out: {frozen:.0f} repeat the one "
        "before while the torque changes, the others are single spikes. Check cable and connection, and turn "
        "again"
    ),
    Cause.HUM: text(
        "mains hum of {frequency:.0f} Hz and {amplitude:.3g} N·m on the torque: shield the transducer's cable, ground at one point only"
    ),
    Cause.TORQUE_FILTER: text(
        "the torque's filter of {time_constant:.2g} s reduces order {order:.0f} by {share:.0%} at this speed: "
        "turn more slowly (speed_rpm), or make the filter faster"
    ),
    Cause.VIBRATION: text(
        "of the {order:.0f} periods per turn at this speed only {share:.0%} come again at half the speed. What goes with time and not with "
        "the angle is no cogging: a vibration of {frequency:.3g} Hz, or an order too high for the readings. Look for a machine that runs "
        "nearby, state the order, or take more readings"
    ),
    Cause.WRONG_PERIOD: text(
        "the torque also has {order:.1f} periods per turn, with {amplitude:.3g} N·m, which is not a multiple of "
        "the order given: check slots and poles, or leave the order out so that a whole turn is read"
    ),
}
#: Of a wave that only the part at half the speed has.
_SEEN_IN_COGGING_HALF = {
    Cause.VIBRATION: text(
        "at half the speed the torque has {order:.0f} periods per turn, with {amplitude:.3g} N·m, that were not seen before. They are a "
        "vibration of {frequency:.3g} Hz, or cogging of an order too high for the readings. Look for a machine that runs nearby, state the "
        "order, or take more readings"
    ),
}
#: Of a drag that comes by and by: `record` = "cogging-start".
_SEEN_IN_COGGING_START = {
    Cause.TORQUE_FILTER: text(
        "after the shaft began to turn the torque came to its mean with a time constant of about {time_constant:.2g} s, as behind a slow "
        "filter, and no cogging is seen: the filter may hide it. State the filter of the transducer in the station file, shorten it, or "
        "turn more slowly (speed_rpm)"
    ),
}
#: What is said of a torque constant: `record` = "torque-constant".
_SEEN_IN_TORQUE_CONSTANT = {
    Cause.TORQUE_ZERO: text(
        "the torque's zero, or the friction, moved by {drift:.3g} N·m ({share:.1%} of the torques' span) in {time:.0f} s, read at the "
        "first current once more: it is taken out as if it moved evenly. Let transducer and bearings warm up"
    ),
    Cause.CHANNELS_DIFFER: text(
        "torque over current on the dynamometer is {ratio:.4g} times 1.5·p·λ ({off:+.1%}), more than the stated limits of torque, current "
        "and flux linkage explain: check pole pairs, peak against rms current, the inverter's current scale with a meter, the "
        "transducer's calibration, and whether the current lies in the q axis. Iron that saturates also makes less torque for each ampere"
    ),
}
#: Where only the inverter's voltages tell of its flux linkage: `record` = "torque-constant-alone".
_SEEN_IN_TORQUE_CONSTANT_ALONE = {
    Cause.CHANNELS_DIFFER: text(
        "torque over current on the dynamometer is {ratio:.4g} times what the inverter's own voltage at no current gives, 1.5·|v|/ω "
        "({off:+.1%}), more than the stated limits of torque, current, voltage and speed explain: check the inverter's scales of current "
        "and voltage with a meter, the transducer's calibration, and whether the current lies in the q axis. A back-EMF constant tells "
        "which is wrong"
    ),
}
#: Of a drag that is the difference of two: `record` = "drag".
_SEEN_IN_DRAG = {
    Cause.TORQUE_ZERO: text(
        "the torque's zero moved by {drift:.3g} N·m ({share:.1%} of the motor's drag) in {time:.0f} s, from the dynamometer alone to the "
        "motor: turning both ways takes it out of the drag, if it moves evenly. Let the transducer warm up"
    ),
}
#: By the `record` that stands among a finding's figures.
SENTENCES = {
    "coast": _SEEN_IN_COAST,
    "ramp": _SEEN_IN_RAMP,
    "ramp-counted": _SEEN_IN_RAMP_COUNTED,
    "ramp-seldom": _SEEN_IN_RAMP_SELDOM,
    "ramp-tried": _SEEN_IN_RAMP_TRIED,
    "cogging": _SEEN_IN_COGGING,
    "cogging-half": _SEEN_IN_COGGING_HALF,
    "cogging-start": _SEEN_IN_COGGING_START,
    "drag": _SEEN_IN_DRAG,
    "torque-constant": _SEEN_IN_TORQUE_CONSTANT,
    "torque-constant-alone": _SEEN_IN_TORQUE_CONSTANT_ALONE,
}
