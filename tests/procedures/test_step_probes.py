import numpy as np
import pytest

from drivers.interfaces import Accuracy, Waveform
from procedures.core.misfit_text import sentence
from procedures.estimation.fitting.misfit import Answer, Cause, Finding, Misfit
from procedures.techniques.winding.step_probes import StepSource, probes_against_supply

#: 10 V over 2 Ω, of which the probed winding has 1.5 Ω.
SOURCE = StepSource(10.0, 0.02, 2.0, 1.5)
TIME = np.linspace(-0.1, 0.9, 1000)


def wave(channel: int, level: float, unit: str, tau: float) -> Waveform:
    values = np.where(TIME < 0.0, 0.0, level * (1.0 - np.exp(-np.maximum(TIME, 0.0) / tau)))
    return Waveform(channel, TIME, values, unit, 0.0, Accuracy(gain=0.03, source="sheet"))


def judged(voltage: float = 1.0, current: float = 1.0, source: StepSource = SOURCE, found: Misfit | None = None):
    return probes_against_supply(
        wave(1, 7.5 * voltage, "V", 1e-6), wave(2, 5.0 * current, "A", 0.05), source, found or Misfit()
    )


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
