"""A probe whose limit nobody has stated is asked for, or refused with the key to write; it is never taken as exact."""

import pytest

from bench.i18n.errors import InputError, UsageError
from bench.run.probe_limits import check_asked, given_limits, unstated_probes
from bench.station.station_file import make_station
from bench.virtual.virtual_station import virtual_station
from drivers.interfaces import Accuracy, ChannelSettings, Waveform
from procedures.verification.stated_probes import StatedProbes

SCOPE = {
    "driver": "keysight-infiniivision",
    "address": "TCPIP0::192.0.2.4::inst0::INSTR",
    "probes": {
        "1": {"kind": "V", "attenuation": 10.0},
        "2": {"kind": "V", "attenuation": 10.0, "gain": 0.01},
        "3": {"kind": "V", "attenuation": 10.0, "source": "K-12, negligible"},
        "4": {"kind": "A", "attenuation": 10.0},
    },
    "calibration": {"4": {"gain": 0.01}},
}
STATION = make_station({"station": {"name": "bench"}, "instruments": {"oscilloscope": SCOPE}}, "bench.toml", b"")


def test_only_probes_without_any_statement_are_open():
    assert unstated_probes(STATION) == {1}
    assert unstated_probes(virtual_station({"oscilloscope": "-"})) == set()
    assert given_limits(["CH1 = 2%"], STATION) == {1: 0.02}


@pytest.mark.parametrize(
    ("word", "said"),
    [("CH1=2", "give CHANNEL=LIMIT"), ("CH1=60%", "up to 50 %"), ("2=1%", "leaves open the probes of channels 1 only")],
)
def test_what_cannot_be_is_refused(word, said):
    with pytest.raises(UsageError, match=said):
        given_limits([word], STATION)


def test_without_a_person_the_key_is_named():
    with pytest.raises(InputError, match=r"\[instruments\.oscilloscope\.probes\.1\], or give --probe CH1=2%"):
        check_asked(STATION, {}, somebody=False)
    check_asked(STATION, {1: 0.02}, somebody=False)
    check_asked(STATION, {}, somebody=True)


class Scope:
    def configure_channel(self, channel, settings):
        pass

    def fetch(self, channels, timeout):
        known = Accuracy(gain=0.02, source="sheet; probe: error not stated, taken as none")
        return {channel: Waveform(channel, (), (), "V", 0.1, known) for channel in channels}


def test_the_answer_is_in_the_accuracy_and_asked_for_once():
    asked = []

    def answer(action):
        asked.append((action.unit, str(action.quantity)))
        return 1.5

    probes = StatedProbes({1, 3}, {3: 0.01})
    for _ in range(2):
        scope = probes.on(Scope(), answer)
        for channel in (1, 2, 3):
            scope.configure_channel(channel, ChannelSettings(8.0))
    waves = scope.fetch([1, 2, 3], 1.0)
    assert [wave.accuracy.gain for wave in waves.values()] == pytest.approx([0.035, 0.02, 0.03])
    assert waves[1].accuracy.source == "sheet; probe: limit as entered"
    assert len(asked) == 1
    assert asked[0][0] == "%"
    assert "--probe CH1=2%" in asked[0][1]
