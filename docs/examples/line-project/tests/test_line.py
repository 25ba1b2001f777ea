"""The house's own step, meter and limits against virtual motors, as its CI runs them: pytest, with the wheel installed."""

from pathlib import Path

HERE = Path(__file__).parents[1]


def test_a_sound_motor_passes(eol_plan):
    judged = eol_plan(HERE / "plan.toml", station=HERE / "station.toml").measure()
    assert judged.verdict.value == "pass"
    assert judged.figures["leakage_current"].value < 1e-6


def test_a_winding_that_leaks_fails_by_the_hipot_step(eol_plan):
    judged = eol_plan(HERE / "plan.toml", station=HERE / "station.toml").measure(insulation_resistance=1e7)
    assert judged.verdict.value == "fail"
    assert judged.figures["leakage_current"].verdict.value == "fail"


def test_one_that_breaks_down_fails_too(eol_plan):
    judged = eol_plan(HERE / "plan.toml", station=HERE / "station.toml").measure(insulation_resistance=1e3)
    assert judged.verdict.value == "fail"
    assert [each.code for each in judged.diagnoses] == ["INSULATION"]


def test_the_meter_passes_the_conformance_kit(conformance):
    conformance.driver("acme-dm5")
