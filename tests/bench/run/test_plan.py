from types import SimpleNamespace

import pytest

from bench.i18n.errors import InputError, UsageError
from bench.plugins.catalogues import installed
from bench.run.plan import make_plan


def test_settings_reach_every_procedure_that_knows_them(kit: SimpleNamespace) -> None:
    plan = make_plan(["tiny", "other"], ["current=2.5", "other.repeats=7"], kit.CATALOGUE)
    assert [planned.settings.model_dump() for planned in plan] == [
        {"current": 2.5, "repeats": 2},
        {"current": 2.5, "repeats": 7},
    ]


def test_all_means_all_but_the_end_of_line_checks_in_order() -> None:
    measurements = [name for name, kind in installed().procedures.items() if kind.in_all()]
    assert [planned.name for planned in make_plan(["all"], [], installed().procedures)] == measurements
    assert 0 < len(measurements) < len(installed().procedures)


def test_words_need_no_quotes() -> None:
    plan = make_plan(["back-emf-constant"], ["probing=line", "speeds_rpm=[1000, 500]"], installed().procedures)
    assert plan[0].settings.model_dump(mode="json")["probing"] == "line"
    assert plan[0].settings.model_dump()["speeds_rpm"] == (1000.0, 500.0)


@pytest.mark.parametrize(
    ("names", "assignments", "said"),
    [
        (["tiney"], [], "'tiney' is neither a procedure nor all: did you mean tiny"),
        (["all", "tiny"], [], "all stands alone"),
        (["tiny"], ["curent=1"], "no setting curent; did you mean current"),
        (["tiny"], ["current"], "give name=value"),
        (["tiny"], ["other.current=1"], "other is not a procedure of this run; its procedures are: tiny"),
    ],
)
def test_what_does_not_exist_is_a_usage_error(
    kit: SimpleNamespace, names: list[str], assignments: list[str], said: str
) -> None:
    with pytest.raises(UsageError, match=said):
        make_plan(names, assignments, kit.CATALOGUE)


@pytest.mark.parametrize(
    ("assignment", "said"),
    [
        ("current=0", r"--set: tiny\.current = 0; allowed is a number above 0 and up to 5 \(holding current, A\)"),
        ("current=nan", r"tiny\.current = nan"),
        ("repeats=1.5", r"tiny\.repeats = 1\.5; allowed is a whole number of at least 1"),
    ],
)
def test_a_value_that_is_not_allowed_is_named(kit: SimpleNamespace, assignment: str, said: str) -> None:
    with pytest.raises(InputError, match=said):
        make_plan(["tiny"], [assignment], kit.CATALOGUE)
