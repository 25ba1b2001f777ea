"""Sentences of misfits in flux maps, short circuits and the loads of a six-step drive."""

from drivers.interfaces.text import text
from procedures.estimation.fitting.misfit import Cause

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
_SEEN_IN_SHORT_CIRCUIT = {
    Cause.UNEXPLAINED: text(
        "the currents deviate by {left:.1%} rms from every curve of constant inductances: look for a current probe that clips or "
        "saturates, for a contact that changes, and for one phase that is open"
    ),
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
#: What is said of loads that are read at the source and the shaft alone, and of an EMF above the voltage.
_SEEN_IN_SIX_STEP_SUPPLY = {
    Cause.LOAD_POINT: text(
        "at {torque:.3g} N·m the bus voltage less the EMF differs by {off:+.1%} of the bus voltage from what the other {left:.0f} loads "
        "give for this current and speed, so this load is left out: look for a digit that is mistyped, let it settle, and measure again"
    ),
    Cause.UNEXPLAINED: text(
        "the bus voltages of {loads:.0f} loads, less the EMF, contradict each other by {worst:.2%}, and no single load is the cause: look "
        "for an EMF constant in another unit or of another motor, a tachometer with other marks a turn, commutation that leads or lags, an "
        "inverter that chops the voltage, and a voltmeter that is not at the drive's own terminals"
    ),
}
_SEEN_IN_SIX_STEP_EMF = {
    Cause.CHANNELS_DIFFER: text(
        "at {torque:.3g} N·m the EMF, {emf:.4g} V by the EMF constant and the speed, is above the bus voltage of {voltage:.4g} V, which no "
        "motor that drives has: check the EMF constant's unit and terminals, the speed's unit, and the tachometer's marks a turn"
    ),
}
_SEEN_IN_SIX_STEP_SPEED = {
    Cause.UNEXPLAINED: text(
        "R_eq would be {light:.3g} Ω at {less:.3g} A and {heavy:.3g} Ω at {more:.3g} A, but a drive's grows with the speed, and no faster "
        "than it: look for an EMF constant in another unit or of another motor, a tachometer with other marks a turn, commutation that "
        "leads or lags, an inverter that chops the voltage, and a voltmeter that is not at the drive's own terminals"
    ),
}
_SEEN_IN_SIX_STEP_TORQUE = {
    Cause.LOAD_POINT: text(
        "the torque reading at {torque:.3g} N·m differs by {missing:.3g} N·m from the torque by the currents "
        "there and at the other loads: let the torque settle, and measure again. Predictions for other loads "
        "cannot be more accurate than that"
    ),
}
_SEEN_IN_MAP_TORQUE = {
    Cause.TORQUE_DIFFERS: text(
        "the torque column is {ratio:.3g} times what the flux linkages give, which neither pole pairs, a sign, a unit nor rms values "
        "explain: which of the two is wrong is not known. Check the scales of currents, flux linkages and torque"
    ),
}
#: By the `record` that stands among a finding's figures.
SENTENCES = {
    "rms-both": _SEEN_IN_MAP_TWICE,
    "map-power": _SEEN_IN_MAP_POWER,
    "map-torque": _SEEN_IN_MAP_TORQUE,
    "short-circuit": _SEEN_IN_SHORT_CIRCUIT,
    "six-step": _SEEN_IN_SIX_STEP,
    "six-step-current": _SEEN_IN_SIX_STEP_CURRENT,
    "six-step-supply": _SEEN_IN_SIX_STEP_SUPPLY,
    "six-step-emf": _SEEN_IN_SIX_STEP_EMF,
    "six-step-speed": _SEEN_IN_SIX_STEP_SPEED,
    "six-step-torque": _SEEN_IN_SIX_STEP_TORQUE,
}
