"""What procedures rest on comes before them: a plan that lacks it is refused, and no computed order parts them."""

from pathlib import Path

import pytest

from bench.eol.line.preparation.prepare import Prepared, prepare
from bench.eol.line.preparation.procedure_order import by_time_over_failures
from bench.i18n.errors import InputError

WINDING = "winding_resistance = 0.3, winding_inductance = 5e-4"
PLAN = """
[plan]
name = "six"
motor = "92bl-30-25l"
{before}
[[procedure]]
name = "equivalent-resistance"
settings = {{ {settings} }}
{after}
"""
CONSTANT = '[[procedure]]\nname = "torque-constant"\n'


def plan(folder: Path, before: str = "", after: str = "", settings: str = WINDING) -> Path:
    path = folder / "plan.toml"
    path.write_text(PLAN.format(before=before, after=after, settings=settings), encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({}, "torque_constant; no procedure of the plan gives it: put torque-constant before this one, or give settings.loads"),
        ({"after": CONSTANT}, "torque-constant gives it too late"),
        ({"before": CONSTANT + "every = 2\n"}, "with every = 2 only, and this one is measured with every = 1"),
        ({"settings": "loads = [0.1, 0.2, 0.3]"}, "needs stator_resistance; no procedure of the plan gives it"),
    ],
)  # fmt: skip
def test_what_nothing_gives_in_time_is_refused_with_what_to_do(
    tmp_path: Path, given: dict[str, str], said: str
) -> None:
    path = plan(tmp_path, **given)
    with pytest.raises(InputError) as refused:
        prepare(path, "virtual", 1)
    assert str(refused.value).startswith(f"{path}: procedure equivalent-resistance: it needs ")
    assert said in str(refused.value)


def test_a_setting_does_instead(tmp_path: Path) -> None:
    assert prepare(plan(tmp_path, settings=f"loads = [0.1, 0.2, 0.3], {WINDING}"), "virtual", 1).plan.checks


def test_no_order_parts_a_procedure_from_what_it_wants(tmp_path: Path) -> None:
    checks = prepare(plan(tmp_path, before=CONSTANT), "virtual", 1).plan.checks
    quick_last = {"torque-constant": (100, 0, 60.0), "equivalent-resistance": (100, 50, 1.0)}
    assert [check.name for check in by_time_over_failures(checks, quick_last)] == [
        "torque-constant",
        "equivalent-resistance",
    ]


PROCEDURE = '[[procedure]]\nname = "{name}"\n'
VERIFIED = ("back-emf-shape", "stator-resistance-dc", "no-load-current", "back-emf-constant", "probe-verification")


def in_order(folder: Path, names: tuple[str, ...], extra: str = "") -> list[str]:
    path = folder / "plan.toml"
    listed = "".join(PROCEDURE.format(name=name) for name in names)
    path.write_text(f'[plan]\nname = "p"\nmotor = "lg-400w"\n{listed}{extra}', encoding="utf-8")
    checks = prepare(path, "virtual", 1).plan.checks
    # Slow, and it finds nothing: by time over failures alone it comes last.
    experience = dict.fromkeys(names, (100, 50, 1.0)) | {"probe-verification": (100, 0, 60.0)}
    return [check.name for check in by_time_over_failures(checks, experience)]


@pytest.mark.parametrize("names", [VERIFIED, VERIFIED[::-1]])
def test_what_corrects_an_instrument_comes_before_all_that_read_it(tmp_path: Path, names: tuple[str, ...]) -> None:
    order = in_order(tmp_path, names)
    place = order.index("probe-verification")
    assert {"back-emf-shape", "back-emf-constant"} <= set(order[place:])
    assert set(order[:place]) == {"stator-resistance-dc", "no-load-current"}


def test_a_correction_that_is_to_wait_for_a_reader_waits(tmp_path: Path) -> None:
    names = ("back-emf-shape", "back-emf-constant", "probe-verification")
    assert in_order(tmp_path, names, 'after = ["back-emf-shape"]\n') == [
        "back-emf-shape",
        "probe-verification",
        "back-emf-constant",
    ]


@pytest.mark.parametrize(
    ("names", "extra", "late"),
    [
        (VERIFIED, "", "back-emf-shape, back-emf-constant"),
        (VERIFIED[::-1], "", ""),
        (("probe-verification", "back-emf-shape"), "", ""),
        # What the plan itself has come first is no mistake.
        (("back-emf-shape", "back-emf-constant", "probe-verification"), 'after = ["back-emf-shape"]\n', "back-emf-constant"),
        (("back-emf-shape", "probe-verification"), 'after = ["back-emf-shape"]\n', ""),
    ],
)  # fmt: skip
def test_a_correction_that_is_listed_too_late_is_told_of(
    tmp_path: Path, names: tuple[str, ...], extra: str, late: str
) -> None:
    path = tmp_path / "plan.toml"
    listed = "".join(PROCEDURE.format(name=name) for name in names)
    for order in ("listed", "time over failure rate"):
        path.write_text(f'[plan]\nname = "p"\nmotor = "lg-400w"\norder = "{order}"\n{listed}{extra}', encoding="utf-8")
        told = [str(note) for note in prepare(path, "virtual", 1).notes if "probe-verification corrects" in str(note)]
        assert len(told) == (bool(late) and order == "listed")
        assert all(f"is listed after {late}, which read" in note for note in told)


SAFETY = ("no-load-current", "winding-balance", "insulation-resistance")
HIPOT = Path(__file__).parents[4] / "docs" / "examples" / "line-project" / "acme_line" / "hipot.py"


def prepared_in(folder: Path, names: tuple[str, ...], extra: str = "", before: str = "") -> Prepared:
    path = folder / "plan.toml"
    listed = "".join(PROCEDURE.format(name=name) for name in names)
    path.write_text(f'[plan]\nname = "p"\nmotor = "lg-400w"\n{before}{listed}{extra}', encoding="utf-8")
    return prepare(path, "virtual", 1)


def finding_all_but(*slow: str, names: tuple[str, ...]) -> dict[str, tuple[int, int, float]]:
    """Return experience by which some find nothing in a long time, so that alone they would come last."""
    return dict.fromkeys(names, (100, 50, 1.0)) | dict.fromkeys(slow, (100, 0, 600.0))


def test_a_safety_test_comes_before_what_energises_however_little_it_finds(tmp_path: Path) -> None:
    done = prepared_in(tmp_path, SAFETY)
    slow = finding_all_but("insulation-resistance", names=SAFETY)
    order = [check.name for check in by_time_over_failures(done.plan.checks, slow)]
    # A bridge feeds the motor nothing.
    assert order == ["winding-balance", "insulation-resistance", "no-load-current"]
    assert done.safety_tests == ("insulation-resistance",)


def test_without_records_the_order_to_be_computed_begins_with_safety_all_the_same(tmp_path: Path) -> None:
    done = prepared_in(tmp_path, SAFETY, before='order = "time over failure rate"\n')
    assert not any("safety" in str(note) for note in done.notes)
    assert [check.name for check in by_time_over_failures(done.plan.checks, {})] == [
        "insulation-resistance",
        "no-load-current",
        "winding-balance",
    ]


def test_a_plug_ins_voltage_test_comes_behind_the_insulation_and_before_what_energises(tmp_path: Path) -> None:
    names = ("cogging-torque", "hipot", "insulation-resistance")
    done = prepared_in(tmp_path, names, before=f'[plugins]\nfiles = ["{HIPOT}"]\n')
    slow = finding_all_but("insulation-resistance", names=names)
    assert [check.name for check in by_time_over_failures(done.plan.checks, slow)] == list(reversed(names))
    assert done.safety_tests == ("insulation-resistance", "hipot")


def test_a_safety_test_waits_for_what_the_plan_says_and_for_nothing_else(tmp_path: Path) -> None:
    names = ("no-load-current", "cogging-torque", "insulation-resistance")
    done = prepared_in(tmp_path, names, 'after = ["cogging-torque"]\n')
    slow = finding_all_but("insulation-resistance", names=names)
    order = [check.name for check in by_time_over_failures(done.plan.checks, slow)]
    assert order == ["cogging-torque", "insulation-resistance", "no-load-current"]
    # Of what it waits for by the plan nothing is complained of.
    (said,) = [str(note) for note in done.notes if "is a safety test" in str(note)]
    assert "is listed after no-load-current, which energise" in said


@pytest.mark.parametrize(
    ("names", "before", "said"),
    [
        (SAFETY, "", "insulation-resistance is a safety test and is listed after no-load-current, which"),
        (SAFETY[1:], "", ""),
        (SAFETY[::-1], "", ""),
        (SAFETY[::-1], 'on_failure = "go_on"\n', "a safety test is energised all the same: on_failure is go_on for insulation-resistance"),
        (SAFETY[1:], 'on_failure = "go_on"\n', ""),
    ],
)  # fmt: skip
def test_a_listed_order_that_energises_first_is_warned_of_and_not_refused(
    tmp_path: Path, names: tuple[str, ...], before: str, said: str
) -> None:
    done = prepared_in(tmp_path, names, before=before)
    assert [check.name for check in done.plan.checks] == list(names)
    notes = [str(note) for note in done.notes if "safety test" in str(note)]
    assert len(notes) == bool(said)
    assert all(said in note for note in notes)
