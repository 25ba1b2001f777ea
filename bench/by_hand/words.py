"""The words for commands, their values and their arguments."""

import re
from collections.abc import Mapping

from drivers.interfaces import Role
from drivers.interfaces.text import Text, lines, text, word
from reports.labels import role_name

#: A number and its unit, typed as two words and as one.
_UNIT = re.compile(r"(?<=\d) +(?=[^\d\s=]+(?: |$))")
_FIGURE = re.compile(r"^([-+−]?[\d.,]+(?:[eE][-+]?\d+)?)([^\d.,\s].*)$")

WORDS: Mapping[str, Text] = {
    "make_safe": text("bring to its harmless state"),
    "configure": text("set up"),
    "energised": text("output on"),
    "output_off": text("output off"),
    "output_mode": text("what regulates the output"),
    "measure_voltage": text("read the voltage"),
    "measure_current": text("read the current"),
    "measure_frequency": text("read the frequency"),
    "measure_amplitude": text("read the amplitude"),
    "measure_speed": text("read the speed"),
    "measure_bus_voltage": text("read the DC link voltage"),
    "measure_bus_current": text("read the DC link current"),
    "measure": text("measure"),
    "correct_short": text("short correction"),
    "configure_channel": text("set up a channel"),
    "configure_acquisition": text("set up the record"),
    "configure_trigger": text("set up the trigger"),
    "initiate": text("arm for one record"),
    "fetch": text("fetch the record"),
    "zero_torque": text("take the present torque as zero"),
    "driving_speed": text("drive at a speed"),
    "set_speed": text("change the speed"),
    "driving_torque": text("drive with a torque"),
    "driving_frequency": text("turn the field at a frequency"),
    "driving_current": text("regulate the current"),
    "set_current": text("change the current"),
    "driving_dq_current": text("regulate the d- and q-axis currents"),
    "set_dq_current": text("change the d- and q-axis currents"),
    "alternate_dq_current": text("alternate between two d- and q-axis currents"),
    "other_d_current": text("other d-axis current"),
    "other_q_current": text("other q-axis current"),
    "other_current_vector": text("other current vector"),
    "strokes": text("strokes"),
    "measure_dq": text("read currents, voltages and angle in the rotor's frame"),
    "d_current": text("d-axis current"),
    "q_current": text("q-axis current"),
    "current_vector": text("current vector"),
    "current_amplitude": text("current amplitude"),
    "command_zero": text("command zero"),
    "running": text("run at full voltage"),
    "hall_state": text("read the Hall signals"),
    "lock": text("lock the shaft"),
    "release": text("free the shaft"),
    "turn": text("turn the shaft until stopped"),
    "stop": text("stop"),
    "move_by": text("turn the shaft by an angle"),
    "angle": text("angle"),
    "couple_dynamometer": text("close the coupling"),
    "uncouple_dynamometer": text("open the coupling"),
    "voltage": text("voltage"),
    "current": text("current"),
    "current_limit": text("current limit"),
    "regulated": text("regulated quantity"),
    "frequency": text("frequency"),
    "level": text("level"),
    "aperture": text("measurement time"),
    "wanted": text("quantities to measure"),
    "channel": text("channel"),
    "channels": text("channels"),
    "range": text("full-scale range"),
    "offset": text("value at mid-screen"),
    "acquisition": text("acquisition"),
    "normal": text("normal"),
    "high_resolution": text("high resolution"),
    "record_time": text("length of the record"),
    "points": text("points"),
    "pre_trigger": text("share before the trigger"),
    "slope": text("edge"),
    "timeout": text("longest wait"),
    "speed": text("speed"),
    "speed_limit": text("speed limit"),
    "torque": text("torque"),
    "full_scale": text("largest voltage"),
    "power_line_cycles": text("power-line cycles"),
    "duration": text("duration"),
    "short": text("short"),
    "medium": text("medium"),
    "long": text("long"),
    "both": text("resistance and inductance"),
    "resistance": text("resistance"),
    "inductance": text("inductance"),
    "rising": text("rising"),
    "falling": text("falling"),
    "either": text("either"),
    "short-meter-leads": text("clip the bridge's leads together"),
    "separate-meter-leads": text("take the bridge's leads apart"),
    "lock-rotor": text("lock the rotor"),
    "release-rotor": text("free the rotor"),
    "couple-dynamometer": text("couple the dynamometer"),
    "uncouple-dynamometer": text("take the dynamometer off"),
    "turn-to-rest": text("turn the shaft to a stable angle"),
    "stop-turning": text("stop turning the shaft"),
}


def called(name: str) -> Text:
    """Return the name for people of a method, an argument, a choice or manual work; the identifier itself if it has none."""
    return WORDS.get(name) or Text("{name}", {"name": name.replace("_", " ")})


def command_words(typed: str) -> Text:
    """Return a command to an instrument, as it was typed, in the words of people; any other line as it is."""
    role, *rest = _UNIT.sub("\u00a0", typed).split(" ")
    if role not in {one.value for one in Role} or not rest:
        return Text("{typed}", {"typed": typed})
    messages: list[Text] = [text("{instrument}: {what}", instrument=role_name(role), what=called(rest[0]))]
    for words in rest[1:]:
        name, equals, value = words.partition("=")
        if equals and value in WORDS:
            messages.append(text("{what}: {value}", what=called(name), value=called(value)))
        else:
            figure = _FIGURE.sub("\\1\u00a0\\2", value if equals else words)
            messages.append(
                Text("{name} {figure}", {"name": called(name), "figure": figure}) if equals else word(figure)
            )
    return lines(messages, " · ")
