"""Plans that are refused before anything begins, and those that are told of."""

from pathlib import Path
from typing import Any

import pytest

from bench.eol.line.preparation.prepare import prepare
from bench.i18n.errors import InputError
from procedures.note import stator_resistance


def changed(bench: Any, *pairs: tuple[str, str]) -> Path:
    path: Path = bench.folder / "plan.toml"
    content = path.read_text(encoding="utf-8")
    for old, new in pairs:
        assert old in content
        content = content.replace(old, new, 1)
    path.write_text(content, encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("percent = 60.0", "low = 2.0\nhigh = 1.0", "low = 2 is above high = 1"),
        ('parameter = "pole_pairs"', 'parameter = "pole_pears"', "no procedure of the plan gives it"),
        ('parameter = "pole_pairs"', 'parameter = "inertia"', "add the procedure inertia"),
        ('name = "stator-resistance"', 'name = "stator-resistence"', "did you mean stator-resistance"),
        ("repeats = 1", "repeats = 0", "procedure stator-resistance: settings.repeats"),
        ("resistance = 3.0", 'serial = "fixed"', "put the number in"),
        ('name = "pole-pairs-back-emf"', 'name = "pole-pairs-back-emf"\nafter = ["inertia"]', "not listed before it"),
        ("every = 2", "retries = 2", "retries = 2 has no effect with on_failure = 'go_on'"),
        ("low = 4\nhigh = 4", "low = 4.2\nhigh = 4.8", "it is a count, and no whole number lies within 4.2 … 4.8"),
        (
            'motor = "motor.toml"',
            'motor = "no such.toml"',
            "plan.toml: plan.motor: no such.toml: there is no such motor file",
        ),
        ("percent = 60.0", "low = nan", "allowed is a number in the parameter's unit, or text with another"),
        ("percent = 60.0", "low = 0.016\nhigh = 0.016", "low and high are both 0.016"),
        ("percent = 60.0", 'low = "15 mOm"', "low: '15 mOm': the unit mOm is not known here"),
        ("percent = 60.0", 'low = "15 mH"', "low: '15 mH' is in mH, and Ω is asked for"),
    ],
)
def test_a_plan_that_is_not_right_is_refused_before_anything_begins(
    bench: Any, old: str, new: str, message: str
) -> None:
    with pytest.raises(InputError, match=r"plan\.toml") as refused:
        prepare(changed(bench, (old, new)), "virtual", 1)
    assert message in str(refused.value)


@pytest.mark.parametrize(
    ("pairs", "said"),
    [
        ([], []),
        ([("percent = 60.0", "low = 15.2\nhigh = 16.8")], ["the type's own 0.016 (expected.stator_resistance of"]),
        (
            [('[[limit]]\nparameter = "pole_pairs"\nlow = 4\nhigh = 4\n', "")],
            ["so that only what they refuse is rejected: pole-pairs-back-emf"],
        ),
        (
            [
                ('[[limit]]\nparameter = "stator_resistance"\npercent = 60.0\n', ""),
                ('[[limit]]\nparameter = "pole_pairs"\nlow = 4\nhigh = 4\n', ""),
            ],
            ["there is no [[limit]]: every motor that can be measured passes"],
        ),
    ],
)
def test_limits_that_are_allowed_and_likely_a_mistake_are_told_of(
    bench: Any, pairs: list[tuple[str, str]], said: list[str]
) -> None:
    notes = prepare(changed(bench, *pairs), "virtual", 1).notes
    assert len(notes) == len(said)
    for note, words in zip(notes, said, strict=True):
        assert words in str(note)


def test_a_virtual_socket_has_a_fixture_and_the_type_s_six_step_drive(bench: Any) -> None:
    plan = changed(bench, ('name = "stator-resistance"', 'name = "insulation-resistance"'))
    content = plan.read_text(encoding="utf-8").replace('repeats = 1, aperture = "SHOR", winding_temperature = 25.0', "")
    content = content.replace(
        'parameter = "stator_resistance"\npercent = 60.0', 'parameter = "insulation_resistance"\nlow = 1e8'
    )
    plan.write_text(content, encoding="utf-8")
    assert prepare(plan, "virtual", 1).plan.checks[0].name == "insulation-resistance"
    with pytest.raises(InputError, match="insulation_tester, which the virtual bench does not have"):
        prepare(plan, "virtual", 1, "virtual")
    plan.write_text(content.replace("insulation-resistance", "no-load-current-six-step"), encoding="utf-8")
    with pytest.raises(InputError):
        prepare(plan, "virtual", 1)
    six_step = (
        '[plan]\nname = "six"\nmotor = "92bl-30-25l"\n[[procedure]]\nname = "no-load-current-six-step"\n'
        '[[procedure]]\nname = "hall-sensors"\n'
    )
    plan.write_text(six_step, encoding="utf-8")
    assert [check.name for check in prepare(plan, "virtual", 1).plan.checks] == [
        "no-load-current-six-step",
        "hall-sensors",
    ]


def test_plug_in_files_of_a_plan_that_cannot_be_used_are_told_of(bench: Any) -> None:
    """Nobody names what they declare: the plan does all the same, and less than its author thinks."""
    (bench.folder / "torn.py").write_text("def (", encoding="utf-8")
    (bench.folder / "empty.py").write_text("x = 1\n", encoding="utf-8")
    own = Path(stator_resistance.__file__).read_text(encoding="utf-8")
    (bench.folder / "own.py").write_text(own, encoding="utf-8")
    plan = changed(bench)
    with plan.open("a", encoding="utf-8") as file:
        file.write('[plugins]\nfiles = ["torn.py", "empty.py", "own.py"]\n')
    torn, empty, own = (str(words) for words in prepare(plan, "virtual", 1).notes)
    assert f"{bench.folder / 'torn.py'} cannot be used" in torn
    assert "it declares nothing" in empty
    assert f"stator-resistance from {bench.folder / 'own.py'}" in own
    assert "the name is taken by" in own
