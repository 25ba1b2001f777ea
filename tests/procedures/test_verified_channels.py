"""Records in ranges that a verification left out rest on the data sheet, and that is said of the figures that they reach."""

import numpy as np
import pytest

from bench.i18n.language import translator
from drivers.interfaces import Accuracy, Waveform
from procedures.core.budget import Uncertainties
from procedures.core.result import Parameter
from procedures.verification.verified_channels import VerifiedChannels, VerifiedGain

SHEET = "data sheet; gain 2 % of full scale"


def channels(*ranges: float) -> VerifiedChannels:
    return VerifiedChannels(
        [VerifiedGain(number, each, 1.01, 1e-3, "voltmeter") for number in (1, 2) for each in ranges]
    )


def wave(full_scale: float, channel: int = 1, unit: str = "V") -> Waveform:
    times = np.linspace(0.0, 1.0, 5)
    return Waveform(
        channel, times, np.full(5, 1.01), unit, 0.0, Accuracy(gain=0.02, source=SHEET), full_scale=full_scale
    )


def reported(record: Waveform) -> Parameter:
    unc = Uncertainties()
    quantity = unc.instrument("oscilloscope", float(record.values[0]), record.accuracy)
    return unc.parameter("flux_linkage", "V·s/rad", quantity, procedure="p", section="S", estimator="e")


def test_a_record_in_a_verified_range_is_corrected_and_nothing_is_said() -> None:
    known = channels(16.0, 40.0)
    parameter = reported(known.corrected(wave(40.0)))
    assert parameter.value == pytest.approx(1.0)
    assert not known.resting_on_data_sheet([parameter])


def test_a_record_in_another_range_says_so_in_budget_and_warning_and_both_languages() -> None:
    known = channels(16.0, 40.0)
    records = [known.corrected(wave(80.0, channel)) for channel in (1, 2)]
    parameter = reported(records[0])
    assert parameter.value == pytest.approx(1.01), "no gain is known there"
    (row,) = parameter.budget
    assert row.source.render(translator("zh")).endswith("此量程未经验证")
    assert str(row.source).endswith(f"{SHEET}; not verified in this range")
    (said,) = known.resting_on_data_sheet([parameter])
    assert str(said) == (
        "the verified gain of channel 1, 2 holds at 16 … 40 V full scale; records at 80 V use the data sheet's limits. "
        "Add ranges for them to voltage_ranges of probe-verification"
    )
    assert said.render(translator("zh")).startswith("通道 1, 2 经验证的增益适用于满量程 16 … 40 V")


def test_only_what_reaches_a_budget_is_said() -> None:
    known = channels(40.0)
    coarse = known.corrected(wave(100.0))
    fine = reported(known.corrected(wave(40.0)))
    assert not known.resting_on_data_sheet([fine])
    known.not_used([coarse])
    parameter = reported(known.corrected(wave(80.0)))
    (said,) = known.resting_on_data_sheet([parameter])
    assert "records at 80 V" in str(said), "the one that only told the range is not named"
    known.begin()
    assert not known.resting_on_data_sheet([parameter]), "another procedure took it"


def test_a_channel_that_was_left_out_on_purpose_is_none_of_these() -> None:
    known = channels(40.0)
    current = wave(80.0, channel=4, unit="A")
    assert known.corrected(current) is current
    assert not known.resting_on_data_sheet([reported(current)])
