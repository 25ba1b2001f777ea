"""The form for a new motor."""

from bench.motor.motor_sections import NameplateSection
from bench.panel.pages.motor_form import LABELS, WITHOUT_A_FIELD


def test_every_key_of_a_nameplate_has_its_label() -> None:
    assert {*LABELS, *WITHOUT_A_FIELD} == set(NameplateSection.model_fields)
