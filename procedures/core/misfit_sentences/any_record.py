"""Sentences of misfits that are the same for all records, or for those that have none of their own."""

from drivers.interfaces.text import text
from procedures.estimation.fitting.misfit import Cause

#: By cause: what was seen and what to do. A sentence may name the figures that come with every finding of its cause.
SENTENCES = {
    Cause.WINDAGE: text(
        "part of the friction grows with the square of the speed: {share:.0%} of it at {speed:.0f} rad/s, as "
        "the air or a fan causes it (quadratic friction)"
    ),
    Cause.STRIBECK: text(
        "friction is larger at low speed, by {share:.0%} of the Coulomb friction, up to about {speed:.3g} rad/s "
        "(Stribeck effect)"
    ),
    Cause.FRICTION_DRIFT: text(
        "friction changed by {share:+.1%} while the shaft turned for {time:.3g} s, as it does when grease warms up: the figures are those "
        "at the beginning. Let the shaft turn until it is warm, then record the ramps"
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
    Cause.REPEATED_ROWS: text(
        "only one row in {every:.4g} holds a new reading, and the rows between repeat it: the file was written faster than the converter "
        "samples. Only the rows with new readings are used, {used:.0f} of {rows:.0f}. Export at the converter's own rate, because the "
        "instants of the readings are known no better than these rows"
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
        "channel {channel} is clipped at the end of its range for {lost:.0%} of the record: use a wider range, or, at the widest one, a "
        "probe that divides more or a smaller signal (a lower speed)"
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
        "pairs, a negative value a reversed sign; check the units too. No torque is given"
    ),
    Cause.UNEXPLAINED: text(
        "the record differs from the model by more than noise, and none of the known causes explains it: check "
        "the residual before you trust the figure"
    ),
}
