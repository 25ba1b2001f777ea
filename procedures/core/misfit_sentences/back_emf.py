"""Sentences of misfits in records of the back-EMF."""

from drivers.interfaces.text import text
from procedures.estimation.fitting.misfit import Cause

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
_SEEN_IN_HALL = {
    Cause.PROBE_FACTOR: text(
        "all Hall sensors together look turned by about half an electrical turn ({offset:.0f}°). A probe on C and A instead of A and C, or "
        "a channel that inverts, looks the same: check the EMF's probe before the sensors. Where the motor is made so, state its place, "
        "as in --set hall-sensors.offset=180"
    ),
}
_SEEN_IN_EMF_BOTH_WAYS = {
    Cause.DISTORTION: text(
        "channel {channel} makes harmonics of even order, {share:.2%} of the fundamental, which do not change their sign with the EMF "
        "where the shaft turns the other way: the probe, its amplifier or the converter is not linear. Use another probe or range"
    ),
}
_SEEN_IN_EMF_TWO_SPEEDS = {
    Cause.BANDWIDTH: text(
        "the distortion differs between the two speeds, most on channel {channel}: a bandwidth, a resonance or an average of probe or "
        "converter changes it by about {share:.2%} of the fundamental. Use a probe of more bandwidth, or a lower speed (speed_share)"
    ),
}
_SEEN_IN_EMF_MEMORY = {
    Cause.DISTORTION: text(
        "channel {channel} does not change after each turning point and then lags, as hysteresis of a core or a "
        "dielectric causes it: about {share:.2%} of the fundamental is lost there. Use another probe, and check "
        "whether this remains"
    ),
}
_SEEN_IN_EMF_MODULATED = {
    Cause.MODULATED: text(
        "the flux linkage changes by {share:.1%} along the record. The averaging of an oscilloscope at a speed that varies causes this, "
        "or a gain or a time base that drifts, or another wave near the frequency. Record one acquisition without averaging"
    ),
}
_SEEN_IN_EMF_SMOOTHED = {
    Cause.BANDWIDTH: text(
        "the noise of the record is smooth, as a mean over about {time:.2g} s makes it (a moving average, a high-resolution mode, a "
        "low-pass filter): the fundamental would be too small by up to {share:.2%}. Record without smoothing, or with a higher bandwidth"
    ),
}
_SEEN_IN_EMF_JUMPS = {
    Cause.DROPOUTS: text(
        "the phase of the waveform jumps {count:.0f} times in all channels at once: samples are missing, although "
        "the time column has no gap. Only the longest part without a jump is used, {used:.0%} of the record. "
        "Export the complete record"
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
#: By the `record` that stands among a finding's figures.
SENTENCES = {
    "hall": _SEEN_IN_HALL,
    "emf-both-ways": _SEEN_IN_EMF_BOTH_WAYS,
    "emf-two-speeds": _SEEN_IN_EMF_TWO_SPEEDS,
    "emf": _SEEN_IN_EMF,
    "emf-dead-zone": _SEEN_IN_EMF_DEAD_ZONE,
    "emf-memory": _SEEN_IN_EMF_MEMORY,
    "emf-modulated": _SEEN_IN_EMF_MODULATED,
    "emf-smoothed": _SEEN_IN_EMF_SMOOTHED,
    "emf-jumps": _SEEN_IN_EMF_JUMPS,
    "frequency": _SEEN_IN_FREQUENCY,
    "emf-none": _SEEN_IN_EMF_NONE,
    "emf-to-star": _SEEN_IN_EMF_TO_STAR,
    "emf-to-line": _SEEN_IN_EMF_TO_LINE,
}
