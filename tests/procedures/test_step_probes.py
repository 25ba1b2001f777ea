import numpy as np
import pytest

from drivers.interfaces import Accuracy, Waveform
from procedures.core.misfit_text import sentence
from procedures.estimation.fitting.misfit import Answer, Cause, Finding, Misfit
from procedures.techniques.winding.step_probes import (
    SettledSteps,
    StepSource,
    probes_against_supply,
    probes_between_axes,
)

#: 10 V over 2 Ω, of which the probed winding has 1.5 Ω.
SOURCE = StepSource(10.0, 0.02, 2.0, 1.5)
TIME = np.linspace(-0.1, 0.9, 1000)


def wave(channel: int, level: float, unit: str, tau: float) -> Waveform:
    values = np.where(TIME < 0.0, 0.0, level * (1.0 - np.exp(-np.maximum(TIME, 0.0) / tau)))
    return Waveform(channel, TIME, values, unit, 0.0, Accuracy(gain=0.03, source="sheet"))


def across(gain: float, leads: float) -> Waveform:
    """The voltage behind leads (Ω), as a channel of this gain shows it."""
    supplied = np.where(TIME < 0.0, 0.0, 10.0) - leads * wave(2, 5.0, "A", 0.05).values
    return Waveform(1, TIME, gain * supplied, "V", 0.0, Accuracy(gain=0.03, source="sheet"))


def judged(voltage: float = 1.0, current: float = 1.0, source: StepSource = SOURCE, found: Misfit | None = None):
    return probes_against_supply(across(voltage, 0.5), wave(2, 5.0 * current, "A", 0.05), source, found or Misfit())


@pytest.mark.parametrize("source", [SOURCE, StepSource(10.0, 0.02, 2.0)])
def test_probes_that_agree_are_not_accused(source: StepSource) -> None:
    for v, i in ((1.0, 1.0), (1.03, 0.98), (0.97, 1.03)):
        assert judged(v, i, source).misfit == Misfit()
        assert judged(v, i, source).share == 0.0


@pytest.mark.parametrize(
    ("voltage", "current", "channel"), [(10.0, 1.0, "1"), (0.1, 1.0, "1"), (1.0, 10.0, "2"), (1.0, 0.1, "2")]
)
@pytest.mark.parametrize("source", [SOURCE, StepSource(10.0, 0.02, 2.0)])
def test_a_wrong_factor_is_named_with_its_channel(
    voltage: float, current: float, channel: str, source: StepSource
) -> None:
    (found,) = judged(voltage, current, source).misfit.findings
    assert (found.cause, found.answer) == (Cause.PROBE_FACTOR, Answer.WITHHELD)
    assert found.figures["channel"] == channel
    assert found.figures["factor"] == pytest.approx(1.0 / (voltage * current), rel=1e-6)
    assert "attenuation" in sentence(found).render()


def test_a_channel_that_is_off_beyond_its_accuracy_widens() -> None:
    one = judged(current=1.08)
    (found,) = one.misfit.findings
    assert (found.cause, found.answer) == (Cause.CHANNELS_DIFFER, Answer.WIDENED)
    assert one.share == pytest.approx(0.08, abs=1e-3)
    assert "+8.0%" in sentence(found).render()


def test_a_winding_that_is_warm_is_no_wrong_probe() -> None:
    assert judged(source=StepSource(10.0, 0.02, 2.0, 1.25)).misfit == Misfit()


def test_a_clipped_record_says_nothing_of_a_factor() -> None:
    clipped = Misfit((Finding(Cause.CLIPPED, Answer.MODELLED),))
    assert judged(current=0.5, found=clipped).misfit == Misfit()


def test_a_current_that_reads_too_much_even_where_it_is_cut_off_gives_nothing() -> None:
    clipped = Misfit((Finding(Cause.CLIPPED, Answer.MODELLED),))
    voltage, current = wave(1, 7.5, "V", 1e-6), wave(2, 6.5, "A", 0.05)
    # The fit of what is left says that the current goes on to 10 A.
    (found,) = probes_against_supply(voltage, current, SOURCE, clipped, 0.75).misfit.findings
    assert (found.cause, found.answer, found.figures["channel"]) == (Cause.PROBE_FACTOR, Answer.WITHHELD, "2")
    assert found.figures["factor"] == 0.5


def test_a_voltage_above_the_supplys_is_the_channels_error() -> None:
    high = probes_against_supply(
        wave(1, 10.8, "V", 1e-6), wave(2, 5.0, "A", 0.05), StepSource(10.0, 0.02, 2.0), Misfit()
    )
    (found,) = high.misfit.findings
    assert (found.cause, found.figures["channel"], high.channel) == (Cause.CHANNELS_DIFFER, "1", 1)
    assert high.share == pytest.approx(0.08)


def test_two_limits_that_would_have_to_add_up_widen_without_a_word() -> None:
    assert judged(current=1.031).share == 0.0
    silent = judged(current=1.039)
    assert (silent.misfit, silent.channel) == (Misfit(), 2)
    assert silent.share == pytest.approx(0.039, rel=1e-4)


@pytest.mark.parametrize("bow", [0.08, -0.08, 0.004])
@pytest.mark.parametrize("channel", [1, 2])
@pytest.mark.parametrize("reverse", [-1.0, 1.0])
def test_axes_of_two_resistances_are_a_channel_that_bends_or_drifts(bow: float, channel: int, reverse: float) -> None:
    bent = [1.0 + bow * (channel == each) for each in (1, 2)]
    d = SettledSteps.of(wave(1, reverse * 7.5, "V", 1e-6), wave(2, reverse * 5.0, "A", 0.05), 1.5, 0.003)
    fitted = 1.5 * bent[0] / bent[1]
    q = SettledSteps.of(wave(1, 7.5 * bent[0], "V", 1e-6), wave(2, 5.0 * bent[1], "A", 0.05), fitted, 0.003)
    judged = probes_between_axes(d, q)
    if abs(bow) < 0.01:
        assert judged.misfit == Misfit()
        return
    (found,) = judged.misfit.findings
    assert found.cause is (Cause.DISTORTION if reverse < 0.0 else Cause.REPEATS_DIFFER)
    assert (judged.channel, found.figures["channel"]) == (channel, str(channel))
    # It holds the error of each axis, whichever of both is right.
    assert abs(bow) * 0.9 < judged.share < abs(bow) * 1.1
    assert f"channel {channel}" in sentence(found).render()


def test_resistances_that_nobody_knows_well_do_not_contradict_each_other() -> None:
    ends = wave(1, 7.5, "V", 1e-6), wave(2, 5.0, "A", 0.05)
    judged = probes_between_axes(SettledSteps.of(*ends, 1.5, 0.03), SettledSteps.of(*ends, 1.6, 0.03))
    assert judged.misfit == Misfit()
    assert judged.share == 0.0


@pytest.mark.parametrize("gain", [0.9, 1.0])
@pytest.mark.parametrize("leads", [0.0, 0.4])
def test_leads_do_not_hide_a_voltage_that_reads_too_little(gain: float, leads: float) -> None:
    source = StepSource(10.0, 0.02, 2.0)
    judged = probes_against_supply(across(gain, leads), wave(2, 5.0, "A", 0.05), source, Misfit())
    if gain == 1.0:
        assert (judged.misfit, judged.share) == (Misfit(), 0.0)
        return
    (found,) = judged.misfit.findings
    assert (found.figures["channel"], judged.channel) == ("1", 1)
    assert judged.share == pytest.approx(0.1, abs=1e-3)
