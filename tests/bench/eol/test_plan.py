import json
import math
from pathlib import Path

import pytest

from bench.eol.limits import GuardBand, ParameterLimits
from bench.eol.plan import load_plan, plan_schema
from bench.i18n.errors import InputError

GOOD = """
[plan]
name = "Pump"
motor = "lg-400w"
serial_pattern = 'P-\\d{4}'
guard = "shared"
minimum_ratio = 2.0
on_failure = "go_on"

[[procedure]]
name = "stator-resistance"
on_failure = "retry"
retries = 2
settings = { repeats = 1 }

[[procedure]]
name = "back-emf-constant"
every = 10

[[limit]]
parameter = "stator_resistance"
low = 0.014
high = 0.018

[[limit]]
parameter = "flux_linkage"
percent = 5.0

[[limit]]
parameter = "inertia"
percent = 10.0
of = "golden"

[golden]
inertia = 6.0e-5
"""


@pytest.fixture
def write(tmp_path: Path):
    def put(content: str) -> Path:
        path = tmp_path / "plan.toml"
        path.write_text(content, encoding="utf-8")
        return path

    return put


def test_a_plan_as_it_is_read(write) -> None:
    plan = load_plan(write(GOOD))
    assert [(c.name, c.every, c.on_failure, c.retries) for c in plan.checks] == [
        ("stator-resistance", 1, "retry", 2),
        ("back-emf-constant", 10, "go_on", 1),
    ]
    assert plan.guard is GuardBand.SHARED
    limits = plan.limits({"flux_linkage": 0.01})
    assert limits["stator_resistance"] == ParameterLimits(0.014, 0.018)
    assert (limits["flux_linkage"].low, limits["flux_linkage"].high) == pytest.approx((0.0095, 0.0105))
    assert (limits["inertia"].low, limits["inertia"].high) == pytest.approx((5.4e-5, 6.6e-5))


def test_the_motor_file_may_lie_beside_the_plan(write, tmp_path: Path) -> None:
    (tmp_path / "own.toml").write_text("")
    assert load_plan(write(GOOD.replace("lg-400w", "own.toml"))).motor == str(tmp_path / "own.toml")


@pytest.mark.parametrize("low", ['"14 mΩ"', '"0.014 Ω"', '"14000 uOhm"', '"0,014"', "0.014"])
def test_a_limit_may_have_its_unit(write, low: str) -> None:
    plan = load_plan(write(GOOD.replace("low = 0.014", f"low = {low}")))
    assert plan.absolute["stator_resistance"] == ParameterLimits(0.014, 0.018)


def test_a_golden_motor_s_figure_may_have_its_unit(write) -> None:
    plan = load_plan(write(GOOD.replace("inertia = 6.0e-5", 'inertia = "600 g·cm²"')))
    assert plan.absolute["inertia"].tolerance == pytest.approx(0.2 * 6.0e-5)


def test_one_side_may_stay_open(write) -> None:
    plan = load_plan(write(GOOD.replace("high = 0.018\n", "")))
    assert plan.absolute["stator_resistance"] == ParameterLimits(0.014, math.inf)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("low = 0.014", "low = 0.02", "low = 0.02 is above high = 0.018"),
        ("low = 0.014", 'low = "20 mΩ"', "low = 20 mΩ is above high = 0.018"),
        ("low = 0.014", 'low = "14 mH"', "limit on stator_resistance: low: '14 mH' is in mH, and Ω is asked for"),
        (
            "inertia = 6.0e-5",
            'inertia = "60 furlongs"',
            "golden.inertia: '60 furlongs': the unit furlongs is not known",
        ),
        ("low = 0.014", "low = -0.014", "low: -0.014 is not possible; figures of this parameter are above 0"),
        ("low = 0.014\nhigh = 0.018", "high = 0", "high: 0 is not possible"),
        ("inertia = 6.0e-5", "inertia = -6.0e-5", "limit on inertia: golden.inertia: -6e-05 is not possible"),
        ("low = 0.014", "low = nan", "limit"),
        ('"stator-resistance"', '"stator-resistence"', "did you mean stator-resistance"),
        ('name = "back-emf-constant"', 'name = "stator-resistance"', "procedure stator-resistance stands twice"),
        ("every = 10", "every = 0", "every"),
        ('guard = "shared"', 'guard = "tight"', "guard"),
        ("percent = 5.0", "percent = 5.0\nlow = 1.0", "or percent"),
        ("inertia = 6.0e-5", "", "golden.inertia is missing"),
        ("retries = 2", "retrys = 2", "did you mean retries"),
        ("P-\\d{4}", "P-(", "is no regular expression"),
        ("[[procedure]]", "[[procedures]]", "unknown key procedures"),
    ],
)
def test_what_is_wrong_is_named_with_its_file(write, old: str, new: str, message: str) -> None:
    path = write(GOOD.replace(old, new))
    with pytest.raises(InputError) as refused:
        load_plan(path)
    assert str(path) in str(refused.value)
    assert message in str(refused.value)


def test_per_cent_of_a_type_that_has_no_value(write) -> None:
    with pytest.raises(InputError, match=r"expected\.flux_linkage"):
        load_plan(write(GOOD)).limits({})


@pytest.mark.parametrize("serial", ["P-0001", "P-9999"])
def test_serials_that_match(write, serial: str) -> None:
    load_plan(write(GOOD)).check_serial(serial)


@pytest.mark.parametrize("pattern", [r"Ｐ－０\d{3}", r"\？?[０-９Ｐ－]{6}", r"P\-(０００１|0００２)|P-000１"])
def test_a_pattern_of_full_width_characters_matches_what_is_kept(write, pattern: str) -> None:
    plan = load_plan(write(GOOD.replace(r"P-\d{4}", pattern)))
    plan.check_serial("P-0001")
    for other in ("P-00011", "?P-00"):
        with pytest.raises(InputError, match="serial number"):
            plan.check_serial(other)


@pytest.mark.parametrize("serial", ["", "P-1", "P-00011", "P-0001\n", "\x1b[2J", "P-0001" * 20])
def test_serials_that_do_not(write, serial: str) -> None:
    with pytest.raises(InputError, match="serial number"):
        load_plan(write(GOOD)).check_serial(serial)


def test_the_schema_tells_an_editor_what_is_allowed() -> None:
    schema = json.dumps(plan_schema())
    assert all(word in schema for word in ("serial_pattern", "minimum_ratio", "retry", "golden"))
