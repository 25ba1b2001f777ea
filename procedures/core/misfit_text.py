"""Messages about a record that differs from its model: what was seen, what was done about it, what to do."""

from collections.abc import Mapping
from typing import Any

from drivers.interfaces.text import Text, Translate, english, text, word
from procedures.estimation.fitting.misfit import Answer, Cause, Finding

#: By cause: what was seen and what to do. A sentence may name the figures that come with every finding of its cause.
_SEEN = {
    Cause.WINDAGE: text(
        "part of the friction grows with the square of the speed: {share:.0%} of it at {speed:.0f} rad/s, as "
        "the air or a fan causes it (quadratic friction)"
    ),
    Cause.STRIBECK: text(
        "friction is larger at low speed, by {share:.0%} of the Coulomb friction, up to about {speed:.3g} rad/s "
        "(Stribeck effect)"
    ),
    Cause.SPEED_FILTER: text(
        "the speed signal has passed a filter with a time constant of about {time_constant:.2g} s: state the "
        "filter of the sensor, or make it faster"
    ),
    Cause.TORQUE_FILTER: text(
        "the torque signal has passed a filter with a time constant of about {time_constant:.2g} s: state the "
        "filter of the transducer, or make it faster"
    ),
    Cause.TORQUE_ZERO: text(
        "the torque's zero moved by {drift:.3g} N·m ({share:.1%} of the ramp's torque) in {time:.0f} s, read at rest before and after: let "
        "the transducer warm up, and keep the ramps short"
    ),
    Cause.DROPOUTS: text(
        "{count:.0f} of {readings:.0f} speed readings are zero or outliers and were left out: check the sensor's "
        "cable and threshold"
    ),
    Cause.COGGING: text(
        "the speed has a ripple of {order:.0f} periods per turn, as cogging or torque ripple causes it"
    ),
    Cause.ECCENTRICITY: text(
        "the readings have a ripple of {order:.0f} periods per turn, as the run-out of a coupling or an encoder "
        "causes it: align it"
    ),
    Cause.REGRIP: text(
        "the shaft stopped or turned back {count:.0f} times during the sweep, as when the hand changes its grip; "
        "or turning induced a voltage in the winding that disturbs the meter. Turn in one direction without a "
        "stop, and more slowly"
    ),
    Cause.MODULATED: text(
        "the amplitude of the cogging changes by {share:.1%} over the part of the turn that was read, as an "
        "eccentric rotor, unequal magnets or the gear of the drive cause it: measure whole turns, without stating "
        "the order"
    ),
    Cause.TURNING_POINTS: text(
        "apart from its ends, the sweep shows {maxima:.0f} maxima and {minima:.0f} minima of the inductance; two "
        "of each are needed to find both axes: turn through two electrical turns"
    ),
    Cause.WRONG_PERIOD: text(
        "the readings vary by {swing:.1%}, but not with twice the electrical angle: the number of pole pairs or "
        "the unit of the angle is wrong"
    ),
    Cause.SLOPE: text(
        "the readings drift with time by more than their scatter: let the instrument and the motor settle, and repeat"
    ),
    Cause.WARM_WINDING: text(
        "the resistance changed by {change:+.2%} in {seconds:.0f} s, as that of a winding that was warmer than "
        "its surroundings and cools down: wait until it no longer changes, and measure again"
    ),
    Cause.CONTACT: text(
        "the resistance of a line changed by {change:+.2%} when its terminals were connected again, so contacts "
        "differ by that much. Clean them, use four terminals at the winding itself (Kelvin clips), and measure "
        "again"
    ),
    Cause.REPEATS_DIFFER: text(
        "{count:.0f} readings of one quantity, {terminals}, contradict each other: {least:.4g} … {most:.4g} "
        "{unit}; check contacts, range and unit, and repeat the readings"
    ),
    Cause.CLIPPED: text(
        "channel {channel} is clipped at the end of its range for {lost:.0%} of the record: use a wider range"
    ),
    Cause.HUM: text(
        "channel {channel} carries mains hum of {frequency:.4g} Hz, {amplitude:.3g} V: twist or shield the leads, ground at one point only"
    ),
    Cause.AC_COUPLED: text(
        "{channels} may be AC coupled, which would reduce the reading by up to {shortfall:.1%} at {frequency:.3g} "
        "Hz and cannot be seen in the record: use DC coupling, and state it if the file does not (--coupling dc)"
    ),
    Cause.DISTORTION: text(
        "channel {channel} shows harmonics of even order, {share:.2%} of the fundamental. No winding causes them: "
        "the probe, its amplifier or the converter is not linear. Use another probe or range, and check whether "
        "they remain"
    ),
    Cause.TOO_COARSE: text(
        "the noise of channel {channel} is below a tenth of its step of {resolution:.3g} V, so averaging does not "
        "remove the rounding: use a finer range"
    ),
    Cause.PROBE_FACTOR: text(
        "channel {channel} shows {share:.3g} times the value of the other channels: its probe's factor is wrong, "
        "or the probe is not connected properly. Analyse again with --scale {channel}={factor:.4g}; for a run, "
        "correct the probe's attenuation in the station file"
    ),
    Cause.CHANNELS_DIFFER: text(
        "the channels differ by {difference:.2%} ({lowest} is lowest, {highest} is highest), more than noise and "
        "stated limits explain: compare the probes on one signal"
    ),
    Cause.SPEED_TREND: text(
        "the flux linkage depends on the speed: it changes by {span:.2%} from {slowest:.4g} to {fastest:.4g} Hz "
        "(laws that fit: {laws}). Possible causes are the roll-off of a divider or probe, the iron, or magnets "
        "that became warmer. Repeat the first speed at the end, and use five speeds or more"
    ),
    Cause.UNEVEN_SPEED: text(
        "the speed is not constant: the readings fit angles that differ from those of a constant speed; check the "
        "drive's speed control at this speed"
    ),
    Cause.ASYMMETRIC_MAP: text(
        "the flux linkage is not symmetric in i_q: at i_d {i_d:.3g} A, i_q {i_q:.3g} A its asymmetric part is "
        "{odd:.3g} V·s, {share:.2%} of the largest. Both signs of i_q are treated as separate points, and "
        "resistance and drops are separated by both signs of the speed"
    ),
    Cause.RESIDUAL_VARIANCE: text(
        "the readings scatter about the map with {ratio:.2g} times the variance that their noise explains: let "
        "each point settle, check the temperatures, and reverse the speed more often"
    ),
    Cause.ODD_READING: text(
        "reading {number:.0f} at i_d {i_d:.3g} A, i_q {i_q:.3g} A contradicts the others: read it again"
    ),
    Cause.RESISTANCES_DIFFER: text(
        "the braking torque gives {ratio:.3g} times the resistance that the currents give ({by_torque:.4g} "
        "against {by_current:.4g} Ω). Above 1, the q axis saturates; below 1, switches or contacts drop voltage, "
        "or a drive makes the short circuit; near √2, the currents are rms; near √3 or 1/√3, a line value stands "
        "for a phase value (flux linkage, or currents inside a delta); near 2 or one half, poles were entered for "
        "pole pairs; further away, the flux linkage is in another unit"
    ),
    Cause.IRON_LOSS: text(
        "the braking power grows with the speed beyond the heat in the winding, by {size:.1%} at the highest: iron loss, or windage "
        "that is still in the torque"
    ),
    Cause.FRICTION_LEFT: text(
        "the torque contains a part that no current makes, {size:.1%} of the largest torque: friction, or the transducer's zero. Read the "
        "torque with open terminals at the same speeds, and give it as the column friction"
    ),
    Cause.MAP_HOLES: text(
        "{holes:.0f} points of the table's grid have no values; they are interpolated from the others"
    ),
    Cause.AXES_SWAPPED: text(
        "each flux linkage depends on the other axis' current ({across:.3g} H against {along:.3g} H): the columns "
        "of i_d and i_q, or of ψ_d and ψ_q, are exchanged. Name them with --column"
    ),
    Cause.CURRENTS_OUTWARD: text(
        "both flux linkages decrease as their currents increase: the currents are counted positive out of the "
        "motor. Change the signs of i_d and i_q"
    ),
    Cause.SIGN_REVERSED: text(
        "the inductance of the {axis} axis is negative ({inductance:.3g} H): the sign of i_{axis} or of ψ_{axis} is reversed"
    ),
    Cause.TURNED_180: text(
        "ψ_d is {psi_d:.3g} V·s at zero current: the d axis is turned by 180°. Change the signs of all currents and flux linkages"
    ),
    Cause.OTHER_D_AXIS: text(
        "the magnet lies at {angle:.0f}° from the d axis: d was laid along the axis of high inductance, as for reluctance motors. "
        "With the magnet along −q: ψ_d = −ψ_q′, i_d = −i_q′, ψ_q = ψ_d′, i_q = i_d′; along +q both signs the other way round"
    ),
    Cause.MAP_TURNED: text(
        "at zero current the flux lies {angle:+.2f}° off the d axis: the angle's zero was off by that much"
    ),
    Cause.RESISTANCE_LEFT: text(
        "the map's two axes do not conserve energy: a wrong resistance of ΔR/ω = {remainder:.3g} Ω·s would explain it, "
        "{share:.2%} of the largest flux linkage at full current"
    ),
    Cause.TORQUE_COMPUTED: text(
        "the torque column is {ratio:.4g} times what the flux linkages give, in every row to its last digit: it "
        "was computed from them, and is no independent check"
    ),
    Cause.RMS_FOR_PEAK: text(
        "the torque is {ratio:.3g} times what the flux linkages give with peak values: currents or flux linkages are rms. "
        "Multiply those by √2"
    ),
    Cause.TORQUE_DIFFERS: text(
        "the torque column is {ratio:.3g} times what the flux linkages give: one half means poles given as pole "
        "pairs, a negative value a reversed sign; check the units too"
    ),
    Cause.UNEXPLAINED: text(
        "the record differs from the model by more than noise, and none of the known causes explains it: check "
        "the residual before you trust the figure"
    ),
}
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
_SEEN_IN_COAST = {
    Cause.UNEXPLAINED: text(
        "the fit gives a negative friction, which is impossible: the friction of this shaft follows none of the laws that are fitted, or "
        "something drove or braked it"
    ),
}
#: What is said otherwise of a map whose torque contradicts it: 2, where pole pairs may be half of what they are, and 2/3.
_SEEN_IN_MAP_TWICE = {
    Cause.RMS_FOR_PEAK: text(
        "the torque is {ratio:.3g} times what the flux linkages give with peak values: currents and flux linkages are rms (multiply both "
        "by √2), or the pole pairs given are half of the motor's"
    ),
}
_SEEN_IN_MAP_POWER = {
    Cause.RMS_FOR_PEAK: text(
        "the torque is {ratio:.3g} times what the flux linkages give with peak values, which is 2/3: currents and flux linkages are scaled "
        "for equal power. Multiply both by √(2/3); if the torque's formula lacks the factor 1.5, leave the torque out"
    ),
}
#: What is said otherwise of voltages that do not follow the waveform: `record` = "emf", and "emf-jumps" of samples that are missing.
_SEEN_IN_EMF = {
    Cause.DROPOUTS: text(
        "{count:.0f} of {readings:.0f} readings, most of them of channel {channel}, are invalid and were left "
        "out: {frozen:.0f} repeat the one before while the voltage changes, {spikes:.0f} are single spikes. Check "
        "cable and connection, and record again"
    ),
}
_SEEN_IN_EMF_DEAD_ZONE = {
    Cause.DISTORTION: text(
        "channel {channel} does not change near zero, as a dead zone of an amplifier or a converter, or gaps "
        "between magnets, cause it: up to {share:.2%} of the fundamental is lost there. Use another probe or "
        "range, and check whether this remains"
    ),
}
_SEEN_IN_EMF_MEMORY = {
    Cause.DISTORTION: text(
        "channel {channel} does not change after each turning point and then lags, as hysteresis of a core or a "
        "dielectric causes it: about {share:.2%} of the fundamental is lost there. Use another probe, and check "
        "whether this remains"
    ),
}
_SEEN_IN_SHORT_CIRCUIT = {
    Cause.SLOPE: text(
        "the flux linkage changes by {change:+.1%} from the first row to the last, as that of magnets does which warm while they are "
        "braked: let the motor cool between the speeds, and measure the open circuit's flux linkage again after the last"
    ),
    Cause.SATURATION: text(
        "the q axis saturates: at half the short-circuit current its inductance is lower by a factor of about {factor:.2g} than at none. "
        "A flux map shows L_q at each current"
    ),
    Cause.CONTACT: text(
        "a voltage of {size:.2%} of R·I at high speed does not grow with the current, as that of switches and worn contacts: join the "
        "terminals by clean links"
    ),
}
_SEEN_IN_EMF_JUMPS = {
    Cause.DROPOUTS: text(
        "the phase of the waveform jumps {count:.0f} times in all channels at once: samples are missing, although "
        "the time column has no gap. Only the longest part without a jump is used, {used:.0%} of the record. "
        "Export the complete record"
    ),
}
#: What is said of a current step whose voltage picks mains hum up, too.
_SEEN_IN_STEP_BOTH = {
    Cause.HUM: text(
        "mains hum of {frequency:.0f} Hz, {voltage:.3g} V on the voltage and {amplitude:.3g} A on the current: twist and shield the leads, "
        "ground at one point only, and record at least 20 ms after the step"
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
    Cause.WRONG_PERIOD: text(
        "the torque also has {order:.1f} periods per turn, with {amplitude:.3g} N·m, which is not a multiple of "
        "the order given: check slots and poles, or leave the order out so that a whole turn is read"
    ),
}
#: What is said of a six-step drive's loads: `record` = "six-step".
_SEEN_IN_SIX_STEP = {
    Cause.CLIPPED: text(
        "the line's current at {torque:.3g} N·m is clipped at the end of its range for {lost:.0%} of the record, "
        "so the parts are not separated at this load: use a wider range"
    ),
    Cause.LOAD_POINT: text(
        "the bus voltage at {torque:.3g} N·m differs by {off:+.1%} from the plane through the other {left:.0f} "
        "loads over speed and current, so this load is left out: let it settle, check the voltmeter, and measure "
        "again"
    ),
    Cause.DROPOUTS: text(
        "at {count:.0f} of {loads:.0f} loads the speed reading differs by up to {worst:+.0%} from the speed by "
        "the current's frequency, which is used there: check the tachometer's mark and cable"
    ),
    Cause.SPEED_DIFFERS: text(
        "the tachometer shows {ratio:.4g} times the speed that the current's frequency gives with {pairs:.0f} pole pairs: check its marks "
        "a turn, and the number of pole pairs"
    ),
    Cause.UNSETTLED: text(
        "the speed reading differs by up to {worst:+.2%} from the speed by the current's frequency shortly "
        "before: the speed still changes, or the tachometer is wrong. Raise settle=…"
    ),
    Cause.PROBE_FACTOR: text(
        "the line's current corresponds to {ratio:.3g} times the DC source's current that the drive reads: the "
        "probe's factor or the drive's current reading is wrong. With the probe multiplied by {factor:.4g} they "
        "would agree; correct it in the station file"
    ),
    Cause.CHANNELS_DIFFER: text(
        "the line's current and the current out of the source differ by up to {worst:+.1%}, more than their limits of error explain: "
        "compare the probe with a meter, and look for ripple on the drive's reading"
    ),
    Cause.UNEXPLAINED: text(
        "the mean voltages of {loads:.0f} loads contradict each other by {worst:.2%}, and the wrong one cannot be "
        "identified: use five loads or more, let each settle, and read the voltage at the drive's own terminals"
    ),
    Cause.POWER_BALANCE: text(
        "the torque by the currents exceeds the shaft's by an amount that changes with the load as no friction "
        "does, at {torque:.3g} N·m by {share:.1%}: the gain of the bus voltage or of the torque is wrong, or the "
        "voltage is not read at the drive's own terminals"
    ),
    Cause.TORQUE_ZERO: text(
        "the shaft torque is up to {zero:.3g} N·m larger than the torque by the currents: zero the torque at "
        "rest, and measure again. Predictions for other loads cannot be more accurate than that"
    ),
    Cause.CURVATURE: text(
        "the commutation part deviates by {bend:.1%} from a straight line over the speed: use it between the "
        "loads measured, and do not extrapolate it to standstill"
    ),
}
_SEEN_IN_SIX_STEP_CURRENT = {
    Cause.LOAD_POINT: text(
        "at {torque:.3g} N·m the ratio of the line's current to the source's differs by {off:+.1%} from that at "
        "the other {left:.0f} loads, so this load is left out: check the ranges of both meters, and measure again"
    ),
}
_SEEN_IN_SIX_STEP_TORQUE = {
    Cause.LOAD_POINT: text(
        "the torque reading at {torque:.3g} N·m differs by {missing:.3g} N·m from the torque by the currents "
        "there and at the other loads: let the torque settle, and measure again. Predictions for other loads "
        "cannot be more accurate than that"
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
_SEEN_IN_FOUR_WIRE_SETTLING = {
    Cause.UNSETTLED: text(
        "four-wire readings had not settled: while the current flowed for as long again, voltage over current changed by {ratio:+.2%}, and "
        "the current by {flow:+.2%} between its reading and the voltage's. The supply is slow, the voltmeter averages, or the winding "
        "warms up: raise settle=…, switch the voltmeter's averaging off, or use less current"
    ),
}
#: What is said of the frequency that pole pairs are counted by: `record` = "frequency".
_SEEN_IN_FREQUENCY = {
    Cause.WRONG_PERIOD: text(
        "the voltage has {frequency:.4g} Hz, as of {pairs:.0f} pole pairs, but also {slower:.4g} Hz with {share:.0%} of its amplitude, as "
        "of {fewer:.0f} pole pairs: a probe or an amplifier that is not linear makes twice the frequency of the fundamental larger than "
        "the fundamental itself. Use another channel or a wider range, and measure again"
    ),
}
#: What is said of a bridge's readings at several frequencies: `record` = "bridge".
_SEEN_IN_BRIDGE = {
    Cause.SECOND_TIME_CONSTANT: text(
        "the resistance at {frequency:g} Hz is {rise:.1%} above that at {lowest:g} Hz, and the inductance for slow changes {more:.1%} "
        "above that at {frequency:g} Hz: a second time constant of {time_constant:.3g} s with a coupling of {coupling:.2g}, as eddy "
        "currents in iron or magnets, or shorted turns, cause it. The inductance for slow changes is the one meant; a lower frequency "
        "reads more of it"
    ),
}
#: What is said of a torque constant: `record` = "torque-constant".
_SEEN_IN_TORQUE_CONSTANT = {
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
#: Of a record that no term explains: which were tried.
_SEEN_IN_RAMP_TRIED = {
    Cause.UNEXPLAINED: text(
        "inertia and friction do not explain the course of the speed, nor does any known cause that was tried "
        "({tried}): look for another torque on the shaft (shorted leads, a coupled machine), and for a filter or "
        "a counter gate in the speed signal"
    ),
}
_SEEN_IN_STEP_TRIED = {
    Cause.UNEXPLAINED: text(
        "current and voltage do not fit a winding, and no known cause that was tried explains it ({tried}): check "
        "both probes, and that the rotor is locked"
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
#: Of a channel of a back-EMF that contradicts the others: it shows nothing, or is probed between other points.
_SEEN_IN_EMF_NONE = {
    Cause.PROBE_FACTOR: text(
        "channel {channel} shows no back-EMF ({share:.1g} of the value of the other channels): its probe is off, or on a terminal that "
        "is grounded. Leave the channel out, or connect it and record again"
    ),
}
_SEEN_IN_EMF_TO_STAR = {
    Cause.PROBE_FACTOR: text(
        "channel {channel} shows {share:.3g} times the value of the other channels, which is 1/√3: its probe is on a phase (a line against "
        "a star point), and those of the others are between two lines. Probe all of them alike, or analyse the channel alone with "
        "--connection phase; if its probe has a wrong factor, use --scale {channel}={factor:.4g}"
    ),
}
_SEEN_IN_EMF_TO_LINE = {
    Cause.PROBE_FACTOR: text(
        "channel {channel} shows {share:.3g} times the value of the other channels, which is √3: its probe is between two lines, and those "
        "of the others are on phases (a line against a star point). Probe all of them alike, or analyse the channel alone with "
        "--connection line; if its probe has a wrong factor, use --scale {channel}={factor:.4g}"
    ),
}
_SEEN_IN = {
    "emf-none": _SEEN_IN_EMF_NONE,
    "emf-to-star": _SEEN_IN_EMF_TO_STAR,
    "emf-to-line": _SEEN_IN_EMF_TO_LINE,
    "hand-sweep": _SEEN_IN_HAND_SWEEP,
    "cogging": _SEEN_IN_COGGING,
    "four-wire": _SEEN_IN_FOUR_WIRE,
    "four-wire-settling": _SEEN_IN_FOUR_WIRE_SETTLING,
    "four-wire-scatter": _SEEN_IN_FOUR_WIRE_SCATTER,
    "six-step": _SEEN_IN_SIX_STEP,
    "six-step-current": _SEEN_IN_SIX_STEP_CURRENT,
    "six-step-torque": _SEEN_IN_SIX_STEP_TORQUE,
    "map-power": _SEEN_IN_MAP_POWER,
    "rms-both": _SEEN_IN_MAP_TWICE,
    "step": _SEEN_IN_STEP,
    "step-both": _SEEN_IN_STEP_BOTH,
    "coast": _SEEN_IN_COAST,
    "ramp": _SEEN_IN_RAMP,
    "ramp-tried": _SEEN_IN_RAMP_TRIED,
    "step-tried": _SEEN_IN_STEP_TRIED,
    "bridge": _SEEN_IN_BRIDGE,
    "frequency": _SEEN_IN_FREQUENCY,
    "lines": _SEEN_IN_LINES,
    "sweep": _SEEN_IN_SWEEP,
    "emf": _SEEN_IN_EMF,
    "emf-dead-zone": _SEEN_IN_EMF_DEAD_ZONE,
    "emf-jumps": _SEEN_IN_EMF_JUMPS,
    "emf-memory": _SEEN_IN_EMF_MEMORY,
    "short-circuit": _SEEN_IN_SHORT_CIRCUIT,
    "torque-constant": _SEEN_IN_TORQUE_CONSTANT,
    "torque-constant-alone": _SEEN_IN_TORQUE_CONSTANT_ALONE,
}
#: Causes whose sentence tells what was done, too.
_ALL_SAID = (Cause.PULSE_ENDS,)
_DONE = {
    Answer.MODELLED: text("the model includes it, and so does the interval of every figure that is given"),
    Answer.WIDENED: text("the interval of every figure that is given is widened by its possible effect"),
    Answer.SAID: text("it changes no interval"),
    Answer.WITHHELD: text("no figure is given, because no interval from this record would contain the true value"),
}


def sentence(finding: Finding) -> Text:
    """Return what was seen, what was done and what to do."""
    of_record = _SEEN_IN.get(str(finding.figures.get("record")), {})
    seen = of_record.get(finding.cause) or _SEEN[finding.cause]
    figures: dict[str, object] = dict(finding.figures)
    if "channel" in figures:
        # Where it is a quantity, it is said in the reader's words.
        figures["channel"] = word(str(figures["channel"]))
    if "tried" in figures:
        figures["tried"] = [word(name) for name in str(figures["tried"]).split(", ")]
    if finding.cause in _ALL_SAID:
        return Text(seen.template, figures)
    return text("{seen}; {done}", seen=Text(seen.template, figures), done=_DONE[finding.answer])


def told_again(row: Mapping[str, Any], translate: Translate) -> dict[str, Any]:
    """Return a row of `misfit` in another language; the words of a cause that is not known here stay as they were."""
    try:
        finding = Finding(
            Cause(row["cause"]),
            Answer(row["answer"]),
            tuple(row["parameters"]),
            float(row["score"]),
            dict(row["figures"]),
        )
        again = misfit_row(finding, translate)
    except (KeyError, TypeError, ValueError, IndexError):
        return dict(row)
    # A sentence that another version said otherwise is not this version's to replace.
    return {**row, "message": again["message"]} if misfit_row(finding)["message"] == row["message"] else dict(row)


def misfit_row(finding: Finding, translate: Translate = english) -> dict[str, Any]:
    """Return a finding as it stands under `misfit` in `result.json`."""
    return {
        "cause": finding.cause.value,
        "answer": finding.answer.value,
        "parameters": list(finding.estimates),
        "score": finding.score,
        "message": sentence(finding).render(translate),
        "figures": dict(finding.figures),
    }
