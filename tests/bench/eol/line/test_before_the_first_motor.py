"""What is said of plans, serial numbers, calibrations and warm-up before a batch's first motor."""

from collections.abc import Callable
from datetime import date, timedelta
from io import StringIO
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from bench.eol.admission_rule import AdmittedTest
from bench.eol.line.admission.next_motor import Admission
from bench.eol.line.admission.serial_numbers import open_serials
from bench.eol.line.admission.serial_register import SerialRegister
from bench.eol.line.batch_log import BatchMotor
from bench.eol.line.calibration_watch import CalibrationWatch
from bench.eol.line.preparation.line_file import load_line
from bench.eol.line.preparation.prepare import BatchRequest, calibrations_of, prepare
from bench.eol.plan import Plan, load_plan
from bench.eol.plans_beside import PlanBeside, check_name, check_serial, plans_beside
from bench.eol.store.database import open_database
from bench.eol.store.records import Records
from bench.i18n.errors import InputError, UsageError
from bench.station.calibration_list import SOON, calibration_list
from procedures.core.bench import Role
from tests.bench.eol.line.conftest import MOTOR, PLAN
from tests.bench.eol.line.golden import open_gate
from tests.bench.eol.motor_records import motor_record

TODAY = date(2026, 11, 24)


def plan_file(folder: Path, name: str, *pairs: tuple[str, str]) -> Plan:
    content = PLAN.replace("motor.toml", "lg-400w")
    for old, new in pairs:
        assert old in content
        content = content.replace(old, new, 1)
    (folder / name).write_text(content, encoding="utf-8")
    return load_plan(folder / name)


def pattern(expression: str, name: str) -> tuple[str, str]:
    return 'name = "small"', f'name = "{name}"\nserial_pattern = "{expression}"'


def test_the_plans_beside_are_read_and_what_is_none_is_passed_over(tmp_path: Path) -> None:
    own = plan_file(tmp_path, "own.toml")
    plan_file(tmp_path, "other.toml", pattern("P-.*", "other"))
    (tmp_path / "line.toml").write_text('[line]\nbench = "virtual"\n', encoding="utf-8")
    (tmp_path / "broken.toml").write_text("[plan\n", encoding="utf-8")
    (tmp_path / "odd.toml").write_text("plan = 3\n", encoding="utf-8")
    (tmp_path / "latin.toml").write_bytes(b'[plan]\nname = "\xe9"\n')
    assert list(plans_beside(Path(own.source))) == [PlanBeside(tmp_path / "other.toml", "other", "lg-400w", "P-.*")]


def test_two_plans_of_one_name_are_refused_and_a_copy_is_not(tmp_path: Path) -> None:
    own = plan_file(tmp_path, "own.toml")
    plan_file(tmp_path, "copy.toml")
    check_name(own)
    plan_file(tmp_path, "other.toml", ("percent = 60.0", "percent = 50.0"))
    with pytest.raises(InputError, match=r"plan\.name = 'small' is the name of .*other\.toml, too"):
        check_name(own)


def test_a_serial_number_of_another_plan_s_type_is_named(tmp_path: Path) -> None:
    own = plan_file(tmp_path, "own.toml", pattern("P-[0-9]+", "pump"))
    plan_file(tmp_path, "fan.toml", pattern("F-[0-9]+", "fan"))
    wrong = '[plan]\nname = "wrong"\nmotor = "lg-400w"\nserial_pattern = "("\n'
    (tmp_path / "wrong.toml").write_text(wrong, encoding="utf-8")
    check_serial(own, "P-1")
    with pytest.raises(InputError, match=r"it belongs to the plan fan \(fan\.toml\) for the type lg-400w"):
        check_serial(own, "F-1")
    with pytest.raises(InputError) as refused:
        check_serial(own, "X-1")
    assert "it belongs to" not in str(refused.value)


def test_made_up_serial_numbers_that_the_plan_does_not_allow_are_refused_with_what_to_do(tmp_path: Path) -> None:
    plan = plan_file(tmp_path, "own.toml", pattern("P-[0-9]+", "pump"))
    request = BatchRequest(tmp_path / "own.toml", "virtual", tmp_path / "runs", motors=2)
    line = load_line("virtual", 1)
    with pytest.raises(InputError) as refused:
        open_serials(request, plan, line, StringIO())
    assert "does not match the plan's pattern P-[0-9]+; --motors makes serial numbers up by virtual.serial" in str(
        refused.value
    )
    made_up = ("[virtual]", '[virtual]\nserial = "P-{number}"')
    plan = plan_file(tmp_path, "own.toml", pattern("P-[0-9]+", "pump"), made_up)
    assert open_serials(request, plan, line, StringIO()).take() == "P-1"


def test_the_records_know_a_plan_by_its_name(tmp_path: Path) -> None:
    engine = open_database(str(tmp_path / "records.sqlite"))
    register = SerialRegister(engine, "", lambda: iter(()))
    assert list(register.check_plan("Pump", "1" * 64, "LG-400W")) == [], "nobody knows it yet"
    Records(engine).save(motor_record(1, batch="monday"))
    assert list(register.check_plan("Pump", "0" * 64, "LG-400W")) == []
    (words,) = register.check_plan("Pump", "1" * 64, "LG-400W")
    assert "the plan Pump has changed since batch monday" in str(words)
    with pytest.raises(
        InputError, match=r"know the plan Pump for the type LG-400W \(batch monday\), and this one is for"
    ):
        list(register.check_plan("Pump", "0" * 64, "other"))
    register.close()
    engine.dispose()


def test_a_batch_is_refused_for_its_plan_s_name_before_its_first_motor(bench: Any) -> None:
    content = (bench.folder / "plan.toml").read_text(encoding="utf-8")
    (bench.folder / "another.toml").write_text(content.replace("percent = 60.0", "percent = 50.0"), encoding="utf-8")
    with pytest.raises(InputError, match="which is another plan"):
        bench.run()
    assert not (bench.folder / "runs").exists()


def calibrated(due: date, certificate: str) -> str:
    return (
        f"[instruments.lcr_meter.calibration]\ndate = {due - timedelta(days=365)}\ndue = {due}\n"
        f'certificate = "{certificate}"\n'
    )


@pytest.fixture
def station(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[str], Path]:
    monkeypatch.setattr("bench.eol.line.preparation.prepare.wall_date", lambda: TODAY)

    def written(table: str) -> Path:
        path = tmp_path / "station.toml"
        path.write_text(
            '[station]\nname = "s"\n[instruments.lcr_meter]\ndriver = "keysight-e4980a"\n'
            f'address = "TCPIP0::10.0.0.9::inst0::INSTR"\n{table}'
            '[sockets.left.instruments.supply]\ndriver = "keysight-e36300"\naddress = "TCPIP0::10.0.0.1::inst0::INSTR"\n'
            "channel = 1\nmaximum_current = 10.0\n"
            '[sockets.right.instruments.supply]\ndriver = "keysight-e36300"\naddress = "TCPIP0::10.0.0.2::inst0::INSTR"\n'
            "channel = 1\nmaximum_current = 10.0\n",
            encoding="utf-8",
        )
        return path

    return written


@pytest.mark.parametrize(
    ("days", "said"),
    [
        (-3, "was due on 2026-11-21, 3 days ago"),
        (0, "is due on 2026-11-24, in 0 days"),
        (SOON, f"is due on 2026-12-24, in {SOON} days"),
        (SOON + 1, ""),
    ],
)
def test_calibrations_that_are_due_are_told_of_once(station: Callable[[str], Path], days: int, said: str) -> None:
    line = load_line(str(station(calibrated(TODAY + timedelta(days=days), "K-1"))), None)
    words = [str(each) for each in calibrations_of(line, frozenset({Role.LCR_METER, Role.SUPPLY}))]
    # The meter is shared by both sockets, and the supplies have no calibration, which does not press.
    assert len(words) == bool(said)
    assert all(each.startswith("lcr_meter: calibration K-1") and said in each for each in words)
    assert calibrations_of(line, frozenset({Role.SUPPLY})) == [], "what the plan does not use is nobody's trouble"


@pytest.mark.parametrize("refuse", [True, False])
def test_a_calibration_that_runs_out_during_a_batch_ends_it_where_the_station_refuses(
    bench: Any, station: Callable[[str], Path], refuse: bool
) -> None:
    path = station(calibrated(TODAY, "K-1"))
    if refuse:
        content = path.read_text(encoding="utf-8")
        path.write_text(content.replace('name = "s"\n', 'name = "s"\noverdue = "refuse"\n'), encoding="utf-8")
    heard, day = bench.listener, TODAY
    roles = frozenset({Role.LCR_METER})
    watch = CalibrationWatch(load_line(str(path), None), roles, heard.noted, heard.trouble, lambda: day)
    serials = iter(["A1", "A2"])
    given = SimpleNamespace(take=lambda: next(serials, None), ended=False, listed=False, descriptor=None)
    desk = SimpleNamespace(admit=lambda *_: AdmittedTest(1, "", judged_before=False), spelling_stated=False, person="")
    admission = Admission(given, (), desk, open_gate(bench.folder), refused=watch.refused)  # type: ignore[arg-type]
    assert isinstance(admission.take("left"), BatchMotor)
    assert (heard.troubles, heard.noticed) == ([], []), "of the first day the batch's beginning has told"
    day += timedelta(days=1)
    motor = admission.take("right")
    assert (motor is None, admission.ended) == (refuse, refuse)
    for _ in range(2):
        admission.take("left")
    if refuse:
        assert "the line takes no more motors" in str(admission.held_up)
        assert [str(admission.held_up)] == heard.troubles
        assert "certificate K-1 was due on 2026-11-24 and today is 2026-11-25" in heard.troubles[0]
    else:
        assert heard.noticed == ["lcr_meter: calibration K-1 was due on 2026-11-24, 1 days ago"]


def test_a_calibration_of_a_socket_s_own_instrument_is_told_of_by_socket(station: Callable[[str], Path]) -> None:
    path = station("")
    content = path.read_text(encoding="utf-8")
    for number, name in enumerate(("left", "right"), 1):
        own = calibrated(TODAY, f"K-{number}").replace("instruments.lcr", f"sockets.{name}.instruments.lcr")
        content += own.replace("lcr_meter", "supply")
    path.write_text(content, encoding="utf-8")
    words = [str(each) for each in calibrations_of(load_line(str(path), None), frozenset({Role.SUPPLY}))]
    assert [(each.split(":")[0], number in each) for each, number in zip(words, ("K-1", "K-2"), strict=True)] == [
        ("socket left", True),
        ("socket right", True),
    ]


def test_the_list_has_what_is_due_first_and_what_has_none_last(station: Callable[[str], Path]) -> None:
    line = load_line(str(station(calibrated(TODAY + timedelta(days=5), "K-1"))), None)
    entries = line.sockets[0].station
    assert entries is not None
    due = calibration_list(entries.entries.values(), TODAY)
    assert [(each.role, each.days_left, each.pressing) for each in due] == [
        ("lcr_meter", 5, True),
        ("supply", None, False),
    ]
    assert "no calibration is entered" in str(due[1].words)
    assert due[0].as_dict()["calibration"]["certificate"] == "K-1"


PROCEDURE = """
from typing import ClassVar
from procedures.core.procedure import Procedure, Settings
from procedures.core.bench import Role
from procedures.core.steps import step


class Nothing(Procedure[Settings]):
    name: ClassVar[str] = "nothing"
    title: ClassVar[str] = "Nothing"
    section: ClassVar[str] = "9.9"
    roles: ClassVar[frozenset[Role]] = frozenset()
    gives: ClassVar[tuple[str, ...]] = ("pole_pairs",)

    def measure(self) -> None:
        self.know()

    @step("9.9/1", "Know it")
    def know(self) -> None:
        quantity = self.bench.uncertainties.statistical("count", 4.0, 1e-3)
        self.report("pole_pairs", quantity, section="9.9", estimator="known")
"""


@pytest.fixture
def cold(bench: Any) -> Any:
    """A real station that has measured nothing yet and takes 20 minutes to warm up; it needs no instrument."""
    (bench.folder / "nothing.py").write_text(PROCEDURE, encoding="utf-8")
    (bench.folder / "plan.toml").write_text(
        '[plan]\nname = "small"\nmotor = "motor.toml"\n[plugins]\nfiles = ["nothing.py"]\n[[procedure]]\nname = "nothing"\n'
        '[[limit]]\nparameter = "pole_pairs"\nlow = 3\nhigh = 5\n',
        encoding="utf-8",
    )
    (bench.folder / "line.toml").write_text('[station]\nname = "s"\n[line]\nwarm_up = 1200.0\n', encoding="utf-8")
    (bench.folder / "serials.txt").write_text("A1\nA2\n", encoding="utf-8")
    return bench


def test_a_person_who_says_that_it_is_warm_has_it_begin_at_once(cold: Any) -> None:
    serials = {"motors": None, "serials": str(cold.folder / "serials.txt")}
    with pytest.raises(UsageError, match="--warm: a person must take the responsibility"):
        cold.run(**serials, warm=True)
    counts, stopped = cold.run(**serials, warm=True, person="Wang")
    assert (counts.motors, stopped, cold.listener.troubles) == (2, "", [])
    assert [(record.verdict.value, record.cause) for record in cold.listener.records] == [("pass", ""), ("pass", "")]
    # From here on it is warm by itself, and nobody needs to say so.
    (cold.folder / "serials.txt").write_text("A3\n", encoding="utf-8")
    counts, _ = cold.run(**serials, batch="next")
    assert (counts.motors, cold.listener.troubles) == (1, [])


@pytest.mark.parametrize(
    ("file", "old", "new", "said"),
    [
        ("plan.toml", '"small"', f'"{"x" * 201}"', r"plan\.toml: plan\.name = .*allowed are 1 to 200 printable characters"),
        ("plan.toml", '"small"', '"a\\u0000b"', r"plan\.name = 'a\\x00b'"),
        ("plan.toml", '"small"', '" "', r"plan\.name = ' '"),
        ("motor.toml", '"LG-400W"', f'"{"x" * 201}"', r"motor\.toml: nameplate\.name"),
        ("line.toml", "[line]", f'[line]\nname = "{"x" * 201}"', r"line\.toml: line\.name"),
    ],
)  # fmt: skip
def test_a_name_that_no_database_keeps_is_refused_before_the_first_motor(
    bench: Any, file: str, old: str, new: str, said: str
) -> None:
    path = bench.folder / file
    content = path.read_text(encoding="utf-8")
    assert old in content
    path.write_text(content.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(InputError, match=said):
        bench.run(batch="B1")
    assert not (bench.folder / "runs").exists()


def test_a_name_that_cannot_be_the_batch_s_is_the_option_s_or_the_plan_s(bench: Any) -> None:
    with pytest.raises(UsageError, match=r"--batch 'a/b': allowed are up to 100 letters"):
        bench.run(batch="a/b")
    with pytest.raises(UsageError, match=r"--person 'W\\x00': allowed are 1 to 200 printable"):
        bench.run(person="W\0")
    path = bench.folder / "plan.toml"
    path.write_text(path.read_text(encoding="utf-8").replace('"small"', '"a/b"'), encoding="utf-8")
    with pytest.raises(
        UsageError, match=r"plan\.toml: plan\.name = 'a/b' cannot be the batch's name, too.*give --batch NAME"
    ):
        bench.run()


@pytest.mark.parametrize(
    ("one", "other", "excluded"),
    [
        # λ = 8.5 mV·s/rad and four pole pairs are 3.56 V/krpm, of line to line, rms, 4.36.
        ("flux_linkage 0.0081 0.0089", "back_emf_constant_v_per_krpm 3.39 3.73", False),
        ("flux_linkage 0.0081 0.0089", "back_emf_constant_v_per_krpm 4.15 4.57", True),
        ("flux_linkage 0.0081 0.0089", "back_emf_constant_mechanical 0.0323 0.0357", False),
        ("back_emf_constant_mechanical 0.0323 0.0357", "back_emf_constant_v_per_rpm 0.00415 0.00457", True),
        ("flux_linkage 0.0081 0.0089", "back_emf_constant_v_per_rpm 0.0036 1.0", False),
    ],
)
def test_limits_of_one_quantity_that_exclude_each_other_are_told_of(
    tmp_path: Path, one: str, other: str, excluded: bool
) -> None:
    rows = "".join(
        '[[limit]]\nparameter = "{}"\nlow = {}\nhigh = {}\n'.format(*limit.split()) for limit in (one, other)
    )
    for limit in ('[[limit]]\nparameter = "pole_pairs"\nlow = 4\nhigh = 4\n', ""):
        path = tmp_path / "plan.toml"
        path.write_text(
            '[plan]\nname = "p"\nmotor = "motor.toml"\n[[procedure]]\nname = "pole-pairs-back-emf"\n[[procedure]]\n'
            f'name = "back-emf-constant"\n{limit}{rows}',
            encoding="utf-8",
        )
        # The pole pairs are those of the plan's limit, else the type's.
        (tmp_path / "motor.toml").write_bytes(MOTOR.read_bytes())
        told = [str(note) for note in prepare(path, "virtual", 1).notes if "exclude each other" in str(note)]
        assert len(told) == excluded
        assert all(f"limits on {one.split()[0]} and {other.split()[0]} exclude" in note for note in told)
