"""Sentences of misfits in records of the winding: current steps, four-wire readings, bridges, inductances over a turn."""

from drivers.interfaces.text import text
from procedures.estimation.fitting.misfit import Cause

#: What is said otherwise of a current step: its findings carry `record` = "step" among their figures.
_SEEN_IN_STEP = {
    Cause.SWITCHING: text(
        "the voltage switches between {low:.3g} V and {high:.3g} V at about {frequency:.3g} Hz, like that of a "
        "drive (PWM): the samples do not show the winding's voltage between them. Use a plain DC supply instead"
    ),
    Cause.PULSE_ENDS: text(
        "the voltage ends {after:.3g} s after the step while the current continues, as through a freewheeling "
        "diode: the record after {at:.6g} s is left out (--to sets another end)"
    ),
    Cause.PROBE_FACTOR: text(
        "channel {channel} shows {share:.3g} times the value expected from the supply and the resistances "
        "measured before: its probe's factor is wrong, or the probe is not connected properly. Multiplied by "
        "{factor:.4g} it would agree; correct the probe's attenuation in the station file"
    ),
    Cause.CHANNELS_DIFFER: text(
        "channel {channel} differs by {difference:+.1%} from the value expected from the supply's readings, more "
        "than its accuracy explains: compare its probe with a meter"
    ),
    Cause.NO_BASELINE: text(
        "no baseline: the record shows {samples:.0f} samples of the circuit at rest before the step, at least {needed:.0f} are needed; set "
        "the trigger so that the record begins before the supply is switched on"
    ),
    Cause.CLIPPED: text(
        "the {channel} is cut off at {level:.4g}, the end of a range or the supply's limit, and {lost:.0%} of the step is lost: use a "
        "wider range, or a smaller step"
    ),
    Cause.TOO_COARSE: text(
        "the converter's step of the {channel} ({resolution:.3g}) is more than ten times the noise, so that rounding does not average out "
        "and hides other causes: use a finer range"
    ),
    Cause.SKEW: text(
        "the current is recorded {time:.3g} s later than the voltage (negative: earlier): deskew the probes, and "
        "state the remaining delay"
    ),
    Cause.BANDWIDTH: text(
        "the {channel} channel has a time constant of {time_constant:.3g} s ({bandwidth:.3g} Hz): switch off its "
        "bandwidth limit, or use a faster probe"
    ),
    Cause.RINGING: text(
        "the edge rings at {frequency:.3g} Hz with {amplitude:.3g} A, which halves within {half:.3g} s: keep "
        "leads and ground clips short, damp or change the probe, or switch on the channel's bandwidth limit"
    ),
    Cause.SATURATION: text(
        "the inductance depends on the current: at {current:.4g} A it is {share:.3g} times the value at zero "
        "current, which is the one given. Use a step to {smaller:.3g} A, where the difference is about 1 %. If "
        "the resistance changes as well, the current probe is not linear, not the iron"
    ),
    Cause.SECOND_TIME_CONSTANT: text(
        "a second time constant of {time_constant:.3g} s with a coupling of {coupling:.2g}, as eddy currents in "
        "iron or magnets cause it; the inductance given is the one for slow changes"
    ),
    Cause.COMPENSATION: text(
        "the voltage probe shows {more:+.2%} of what changes faster than its time constant of {time_constant:.3g} s, as with a wrong "
        "compensation, or the iron has a second time constant: compensate the probe on the oscilloscope's square wave"
    ),
    Cause.AC_COUPLED: text(
        "the {channel} channel is AC coupled, with a corner of {corner:.3g} Hz: couple it DC, or use a probe that measures direct "
        "current. A rotor that turns during the step lowers the current in the same way: lock it"
    ),
    Cause.HUM: text(
        "mains hum of {frequency:.0f} Hz and {amplitude:.3g} A on the current: keep the leads short and twisted, and the probe away from "
        "transformers"
    ),
    Cause.SLOPE: text(
        "the current's channel drifts by {slope:.3g} A/s: let the probe warm up and degauss it, or take a shorter record"
    ),
    Cause.DROPOUTS: text(
        "about {count:.0f} samples are missing {after:.3g} s after the step, although the time column has no gap: "
        "export the complete record"
    ),
    Cause.REPEATS_DIFFER: text(
        "{count:.0f} steps on one axis differ by {ratio:.2g} times what their uncertainties explain: check the "
        "lock of the shaft and the contacts, and measure again"
    ),
}
#: What is said of a current step whose voltage picks mains hum up, too.
_SEEN_IN_STEP_BOTH = {
    Cause.HUM: text(
        "mains hum of {frequency:.0f} Hz, {voltage:.3g} V on the voltage and {amplitude:.3g} A on the current: twist and shield the leads, "
        "ground at one point only, and record at least 20 ms after the step"
    ),
}
_SEEN_IN_STEP_BEND = {
    Cause.DISTORTION: text(
        "the current channel may read {share:.1%} too little at the end of the step, as a probe does whose core comes near saturation, or "
        "the inductance rises with the current. The resistance would be smaller by as much. Use a smaller step, or a probe for more "
        "current. A four-wire resistance, or the probe beside a calibrated ammeter at the current of the step, tells which of both it is"
    ),
}
_SEEN_IN_STEP_AXES = {
    Cause.DISTORTION: text(
        "steps of opposite signs to one voltage show resistances that differ by {share:.1%}: channel {channel} reads more of one sign than "
        "of the other, or its gain has changed since, or the winding's temperature has. Exchange the probe's ends and repeat, or compare "
        "the probe with a meter at both signs"
    ),
    Cause.REPEATS_DIFFER: text(
        "steps to one voltage on both axes show resistances that differ by {share:.1%}: the gain of channel {channel} has changed "
        "since, or the winding's temperature has. Let probe and winding come to rest, and repeat"
    ),
}
_SEEN_IN_STEP_TRIED = {
    Cause.UNEXPLAINED: text(
        "current and voltage do not fit a winding, and no known cause that was tried explains it ({tried}): check "
        "both probes, and that the rotor is locked"
    ),
}
#: What is said of four-wire readings of one line: `record` = "four-wire…"; "-scatter" where no single one is odd.
_SEEN_IN_FOUR_WIRE = {
    Cause.REPEATS_DIFFER: text(
        "of {count:.0f} four-wire readings of a line, the one at {current:.3g} A deviates by {off:+.2%} from the "
        "straight line through the others and is left out: check clips and terminals, and measure again"
    ),
    Cause.CURVATURE: text(
        "the voltage of a line does not follow a straight line over the current, by {bend:.2%} of it: a contact "
        "rectifies, one range of the ammeter reads differently, or the winding becomes warmer at the larger "
        "currents. Clean the contacts, keep one range, use less current"
    ),
}
_SEEN_IN_FOUR_WIRE_SCATTER = {
    Cause.REPEATS_DIFFER: text(
        "{count:.0f} four-wire readings of a line scatter by {scatter:.2%} about their straight line, more than "
        "the meters' limits of error: check clips, terminals and the supply, and measure again"
    ),
}
_SEEN_IN_FOUR_WIRE_UNSTATED = {
    Cause.REPEATS_DIFFER: text(
        "{count:.0f} four-wire readings of a line scatter by {scatter:.2%} about their straight line, and nothing stated explains it: "
        "check clips, terminals, ranges and the supply, and measure again, or state the meters' limits of error"
    ),
}
_SEEN_IN_FOUR_WIRE_SETTLING = {
    Cause.UNSETTLED: text(
        "four-wire readings had not settled: while the current flowed for as long again, voltage over current changed by {ratio:+.2%}, and "
        "the current by {flow:+.2%} between its reading and the voltage's. The supply is slow, the voltmeter averages, or the winding "
        "warms up: raise settle=…, switch the voltmeter's averaging off, or use less current"
    ),
}
#: What is said of a bridge's readings at several frequencies: `record` = "bridge".
_SEEN_IN_BRIDGE = {
    Cause.SECOND_TIME_CONSTANT: text(
        "the resistance at {frequency:g} Hz is {rise:.1%} above that at {lowest:g} Hz, and the inductance for slow changes {more:.1%} "
        "above that at {frequency:g} Hz: a second time constant of {time_constant:.3g} s with a coupling of {coupling:.2g}, as eddy "
        "currents in iron or magnets, or shorted turns, cause it. The inductance for slow changes is the one given, as "
        "at_frequency=false says; a lower frequency reads more of it"
    ),
}
#: The same where the inductance at the bridge's frequency is meant: `record` = "bridge-frequency".
_SEEN_AT_BRIDGE_FREQUENCY = {
    Cause.SECOND_TIME_CONSTANT: text(
        "the resistance at {frequency:g} Hz is {rise:.1%} above that at {lowest:g} Hz, and the inductance for slow changes {more:.1%} "
        "above that at {frequency:g} Hz: a second time constant of {time_constant:.3g} s with a coupling of {coupling:.2g}, as eddy "
        "currents in iron or magnets, or shorted turns, cause it. The inductance at {frequency:g} Hz is the one given; "
        "at_frequency=false gives that for slow changes"
    ),
}
#: What is said of a bridge's resistance at several frequencies: `record` = "bridge-resistance".
_SEEN_IN_BRIDGE_RESISTANCE = {
    Cause.SECOND_TIME_CONSTANT: text(
        "the resistance at {highest:g} Hz is {rise:.1%} above that at {frequency:g} Hz, as losses in iron or magnets, or shorted turns, "
        "cause it: {least:.1%} to {most:.1%} of the reading at {frequency:g} Hz is theirs and not the winding's. A direct current reads "
        "none of it"
    ),
}
#: What is said of lines that two instruments have read: `record` = "lines".
_SEEN_IN_LINES = {
    Cause.CONTACT: text(
        "the three lines compare with each other otherwise than when the bridge read them, by up to {apart:.2%}: contacts differ each time "
        "they are made. Clean them, use four terminals at the winding itself (Kelvin clips), and measure again"
    ),
}
#: What is said of inductances over a turn: `record` = "sweep".
_SEEN_IN_SWEEP = {
    Cause.ODD_READING: text(
        "reading {number:.0f}, {read:.5g} µH, is left out: the other readings give {expected:.5g} µH there. Read "
        "it again"
    ),
    Cause.CONTACT: text(
        "the resistance read with the inductance jumps by {change:+.2%} at reading {number:.0f}: a clamp or a lead moved, or the bridge "
        "changed its range. Fasten the leads, hold the range, and sweep again"
    ),
    Cause.RESISTANCES_DIFFER: text(
        "the bridge reads {read:.4g} Ω at {frequency:g} Hz, far below the {direct:.4g} Ω between two lines by the resistance measured "
        "before, which no series resistance is: something else is connected to the terminals, the bridge reads other terminals, or that "
        "resistance is wrong. Disconnect the drive, check the clamps, and measure both again"
    ),
}
#: Of a sweep by hand whose way is known: `record` = "hand-sweep".
_SEEN_IN_HAND_SWEEP = {
    Cause.WRONG_PERIOD: text(
        "the readings show {periods:.1f} periods, but the angle that was turned has {expected:.1f}: turning "
        "induced a voltage that disturbs the meter more than the saliency changes its readings, or the shaft was "
        "not turned far enough. Turn the whole way, and more slowly"
    ),
}
#: Of a step before which the voltage is there: `record` = "step-before".
_SEEN_BEFORE_STEP = {
    Cause.NO_BASELINE: text(
        "no baseline: {share:.0%} of the voltage at the end is there before the step already, so the record does not show the circuit at "
        "rest; set the trigger so that the record begins before the supply is switched on"
    ),
}
#: By the `record` that stands among a finding's figures.
SENTENCES = {
    "step": _SEEN_IN_STEP,
    "step-before": _SEEN_BEFORE_STEP,
    "step-both": _SEEN_IN_STEP_BOTH,
    "step-bend": _SEEN_IN_STEP_BEND,
    "step-axes": _SEEN_IN_STEP_AXES,
    "step-tried": _SEEN_IN_STEP_TRIED,
    "four-wire": _SEEN_IN_FOUR_WIRE,
    "four-wire-scatter": _SEEN_IN_FOUR_WIRE_SCATTER,
    "four-wire-unstated": _SEEN_IN_FOUR_WIRE_UNSTATED,
    "four-wire-settling": _SEEN_IN_FOUR_WIRE_SETTLING,
    "bridge": _SEEN_IN_BRIDGE,
    "bridge-frequency": _SEEN_AT_BRIDGE_FREQUENCY,
    "bridge-resistance": _SEEN_IN_BRIDGE_RESISTANCE,
    "lines": _SEEN_IN_LINES,
    "sweep": _SEEN_IN_SWEEP,
    "hand-sweep": _SEEN_IN_HAND_SWEEP,
}
