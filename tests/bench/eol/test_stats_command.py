"""`motorbench eol stats` from the command line."""

import json
import math
from collections.abc import Callable
from datetime import timedelta
from pathlib import Path

import numpy as np
import pytest
from scipy.special import ndtri
from sqlalchemy import Engine

from bench.cli.main import main
from bench.eol.record import MeasuredFigure
from bench.eol.statistics.gauge import gauge_study
from bench.eol.store.records import Records
from bench.eol.store.schema import FIGURE, MOTOR
from bench.eol.verdict import Verdict
from tests.bench.eol.motor_records import NOON, motor_record
from tests.command_line import Call, called

Put = Callable[..., None]


@pytest.fixture
def call(capsys: pytest.CaptureFixture[str], reference: str) -> Call:
    def run(*arguments: str) -> tuple[int, str, str]:
        return called(capsys, "eol", "stats", *arguments, "--records", reference)

    return run


def test_figures_that_are_alike_tell_of_no_capability(call: Call, put: Put) -> None:
    for n in range(800):
        put(stator_resistance=10.0, back_emf_constant=0.1 if n % 400 else 0.11)
    code, out, _ = call("--json")
    assert code == 0
    found = json.loads(out)["parameters"]
    assert found["stator_resistance"]["ppk"]["value"] is None
    assert found["back_emf_constant"]["ppk"]["value"] is None
    code, out, _ = call("--language", "en")
    assert "inf" not in out.split()
    assert "all 800 figures are alike" in out
    assert "nearly all figures are alike" in out


def test_what_a_line_is_told(call: Call, put: Put) -> None:
    random = np.random.default_rng(1)
    for value in random.normal(10.0, 0.2, 39):
        put(stator_resistance=float(value))
    put(stator_resistance=12.0)
    put(serial="GOLD", stator_resistance=10.5)
    code, out, _ = call("--golden", "GOLD", "--json")
    assert code == 0
    created = json.loads(out)
    assert created["motors"] == 40
    assert created["yield"]["final"]["hits"] == 39
    assert created["failures"]["by_parameter"] == [{"name": "stator_resistance", "failed": 1, "errors": 0}]
    result = created["parameters"]["stator_resistance"]
    assert result["most"] == 12.0
    # The one that is far off is of no normal distribution: 40 motors leave its tail open.
    assert (result["method"], result["normality"]["rejected"]) == ("percentiles", True)
    assert (result["ppk"]["value"], result["ppk"]["interval"][0], result["cpk"]["value"]) == (None, 0.0, None)
    assert result["outside"] == 1
    assert {"index": 39, "rule": 1, "serial_number": "P-0040"} in result["chart"]["signals"]
    assert result["golden"][0]["values"] == [10.5]
    code, out, _ = call("--parameter", "stator_resistance", "--golden", "GOLD", "--language", "en")
    assert code == 0
    for words in (
        "39 / 40",
        "97.50",
        "Stator resistance",
        "Ppk",
        "the figures are not normal",
        "GOLD, S · 1: 1 ×",
    ):
        assert words in out
    assert "最终合格" in call("--language", "zh")[1]


def test_a_golden_motor_is_followed_at_each_socket(call: Call, put: Put, records: Records) -> None:
    put(stator_resistance=10.0)
    for number in range(8):
        value = (10.0 if number % 2 else 10.5) + 0.001 * (number // 2 % 2)
        figure = MeasuredFigure("stator_resistance", value, "Ω", 0.1, 0.2, 9.0, 11.0, Verdict.PASS)
        began = NOON + timedelta(hours=number)
        socket = str(1 + number % 2)
        golden = {"serial_number": "GOLD", "golden": True, "socket": socket}
        records.save(motor_record(100 + number, started=began, measured=(figure,), **golden))
    found = json.loads(call("--json")[1])["parameters"]["stator_resistance"]["golden"]
    assert [(each["serial_number"], each["socket"], len(each["values"])) for each in found] == [
        ("GOLD", "1", 4),
        ("GOLD", "2", 4),
    ]
    assert all(each["drift"]["standard_deviation"] < 0.001 for each in found), "the sockets differ by their instruments"


def test_a_gauge_study_out_of_records(call: Call, put: Put) -> None:
    random = np.random.default_rng(5)
    data = 10.0 + random.normal(0, 1.0, (1, 4, 1)) + random.normal(0, 0.2, (3, 1, 1)) + random.normal(0, 0.1, (3, 4, 2))
    for trial in range(2):
        for part in range(4):
            for who in range(3):
                put(serial=f"P{part}", person="ABC"[who], stator_resistance=float(data[who, part, trial]))
    code, out, _ = call("--gauge", "person", "--json")
    assert code == 0
    result, truth = json.loads(out)["gauge"]["stator_resistance"], gauge_study(data)
    assert result["grr"] == pytest.approx(truth.grr, rel=1e-9)
    assert result["grr_interval"] == pytest.approx(list(truth.grr_interval), rel=1e-9)
    assert result["alpha"] == 0.05
    code, out, _ = call("--gauge", "person", "--alpha", "0.25", "--language", "en")
    assert "above 0.25" in out
    assert call("--gauge", "socket")[2] == (
        "motorbench: stator_resistance: a crossed study needs 2 sockets, 2 motors and 2 repetitions at least; "
        "the records have 1, 4 and 6\n"
    )
    put(serial="P0", person="A", stator_resistance=10.0)
    assert "P1 has 2 figures by person 'A' and others have 3" in call("--gauge", "person")[2]


def test_one_motor_alone_has_no_statistics_and_no_error(call: Call, put: Put) -> None:
    put(limits=(-math.inf, math.inf), flux_linkage=0.01)
    code, out, _ = call("--json")
    assert code == 0
    result = json.loads(out)["parameters"]["flux_linkage"]
    assert (result["cpk"]["value"], result["limits"]["low"], result["chart"]) == (None, None, None)
    assert call("--parameter", "flux_linkage")[0] == 0


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (("--parameter", "stator_resistence"), 2, "did you mean stator_resistance"),
        (("B7",), 2, "no batch is named 'B7'; the batches are: B1"),
        (("--rule", "9"), 2, "Nelson's rules are 1 to 8"),
        (("--last", "1"), 2, "2 to 10000"),
        (("--alpha", "1.5"), 2, "between 0 and 1"),
    ],
)
def test_wrong_use(arguments: tuple[str, ...], code: int, message: str, call: Call, put: Put) -> None:
    put(stator_resistance=10.0)
    got, out, err = call(*arguments)
    assert (got, out) == (code, "")
    assert message in err


def test_asking_makes_no_database(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    with pytest.raises(SystemExit) as stop:
        main(["eol", "stats", "--records", str(tmp_path / "none.sqlite")])
    assert stop.value.code == 2
    assert "there are no records here" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_before_the_first_motor(call: Call, engine: Engine) -> None:
    assert call()[2] == "motorbench: there are no records yet\n"


@pytest.fixture
def kept(engine: Engine) -> Callable[[np.ndarray, tuple[float, float]], None]:
    """Keep figures of one parameter, much faster than one record after the other."""

    def keep(values: np.ndarray, limits: tuple[float, float]) -> None:
        low, high = (side if math.isfinite(side) else None for side in limits)
        verdicts = ["pass" if limits[0] <= value <= limits[1] else "fail" for value in values]
        with engine.begin() as connection:
            connection.execute(
                MOTOR.insert(),
                [
                    {column.name: getattr(motor_record(n), column.name, None) for column in MOTOR.columns}
                    | {"id": n, "verdict": verdict}
                    for n, verdict in enumerate(verdicts, 1)
                ],
            )
            connection.execute(
                FIGURE.insert(),
                [
                    {"motor": n, "parameter": "x", "value": float(value), "unit": "", "low": low, "high": high}
                    | {"verdict": verdict}
                    for n, (value, verdict) in enumerate(zip(values, verdicts, strict=True), 1)
                ],
            )

    return keep


@pytest.mark.slow
def test_a_lognormal_process_is_not_called_capable(call: Call, kept: Callable[..., None]) -> None:
    # 1570 of a million lie beyond the limit; the normal formula would say 2.05 of a range that is mostly empty.
    values = np.exp(0.5 * np.random.default_rng(2).standard_normal(20_000))
    high = math.exp(0.5 * float(ndtri(1.0 - 1570e-6)))
    kept(values, (-math.inf, high))
    result = json.loads(call("--json")[1])["parameters"]["x"]
    assert result["method"] == "percentiles"
    # By the true percentiles 0.971.
    truth = (high - 1.0) / (math.exp(0.5 * 3.0) - 1.0)
    assert result["ppk"]["value"] == pytest.approx(truth, abs=0.06)
    low, up = result["ppk"]["interval"]
    assert low < truth < up
    assert up - low < 0.4
    assert (result["pp"]["value"], result["cpk"]["value"]) == (None, None)
    assert result["percentiles"][1] == pytest.approx(float(np.median(values)), rel=1e-12)
    said = call("--language", "en")[1]
    assert "the figures are not normal (Anderson-Darling A²" in said
    assert "by the percentiles 0.135, 50 and 99.865 % (ISO 22514-2)" in said
    assert "数据不服从正态分布" in call("--language", "zh")[1]


def test_what_has_limits_comes_first_and_rules_say_their_false_alarms(call: Call, put: Put) -> None:
    random = np.random.default_rng(5)
    for a, b in random.normal(10.0, 0.2, (30, 2)):
        put(limits=(-math.inf, math.inf), flux_linkage=float(a))
        put(stator_resistance=float(b))
    code, out, _ = call("--json")
    assert code == 0
    assert list(json.loads(out)["parameters"]) == ["stator_resistance", "flux_linkage"]
    assert "At most 1.0%" in call("--language", "en")[1]
    assert (
        "of charts of 30 motors signal without any change (by simulation)"
        in call("--rule", "1", "2", "3", "--language", "en")[1]
    )


def test_what_goes_with_failures(call: Call, put: Put) -> None:
    random = np.random.default_rng(6)
    for n in range(60):
        bad = n % 6 == 0
        put(
            stator_resistance=11.5 if bad else float(random.normal(10.0, 0.1)),
            flux_linkage=float(random.normal(10.3 if bad else 10.0, 0.05)),
            inertia=float(random.normal(10.0, 0.1)),
        )
    found = json.loads(call("--json")[1])["associations"]
    assert (found[0]["failure"], found[0]["parameter"]) == ("stator_resistance", "flux_linkage")
    assert found[0]["interval"][0] > 0.5
    assert "inertia" not in {each["parameter"] for each in found}
    # That a figure for which a procedure failed lies off says nothing.
    assert [each["parameter"] for each in found if each["failure"] == "r"] == ["flux_linkage"]
    assert "Stator resistance failed: Flux linkage of these motors lies +" in call("--language", "en")[1]


def studied(put: Put, values: list[tuple[str, str, float]]) -> None:
    for serial, person, value in values:
        put(serial=serial, person=person, stator_resistance=value)


def test_a_type_one_study(call: Call, put: Put) -> None:
    data = np.random.default_rng(8).normal(10.02, 0.01, 50)
    studied(put, [("REF", "Wang", float(value)) for value in data])
    code, out, _ = call("--study", "type-1", "--parameter", "stator_resistance", "--reference", "REF=10.0", "--json")
    assert code == 0
    study = json.loads(out)["type_1"]["stator_resistance"]
    # The tolerance is 2.
    assert study["cg"] == pytest.approx(0.4 / (6.0 * data.std(ddof=1)))
    assert study["cgk"] == pytest.approx((0.2 - abs(data.mean() - 10.0)) / (3.0 * data.std(ddof=1)))
    assert "Cgk" in call("--study", "type-1", "--parameter", "stator_resistance", "--reference", "REF=10.0")[1]


def test_a_study_by_ranges_and_one_of_linearity(call: Call, put: Put) -> None:
    studied(put, [("P1", "A", 9.85), ("P2", "A", 9.75), ("P1", "B", 9.80), ("P2", "B", 9.70)])
    code, out, _ = call("--study", "range", "--json")
    assert code == 0
    assert json.loads(out)["range"]["stator_resistance"]["mean_range"] == pytest.approx(0.05)
    arguments = (
        "--study",
        "linearity",
        "--parameter",
        "stator_resistance",
        "--reference",
        "P1=9.8",
        "--reference",
        "P2=9.7",
    )
    code, out, _ = call(*arguments, "--json")
    assert code == 0
    assert json.loads(out)["linearity"]["stator_resistance"]["slope"] == pytest.approx(0.0, abs=1e-9)
    assert "R²" in call(*arguments, "--language", "en")[1]
    code, _, err = call("--study", "linearity", "--parameter", "stator_resistance", "--reference", "P1=9.8")
    assert (code, "twice at least" in err) == (2, True)
    code, _, err = call("--study", "type-1", "--parameter", "stator_resistance", "--reference", "P9=9.8")
    assert (code, "there are no figures of P9" in err) == (1, True)


def test_the_motors_behind_a_figure(capsys: pytest.CaptureFixture[str], reference: str, put: Put) -> None:
    for n in range(20):
        put(stator_resistance=9.5 + 0.1 * n)

    def listed(*arguments: str) -> list[str]:
        code, out, _ = called(capsys, "eol", "motors", *arguments, "--records", reference, "--json")
        assert code == 0
        return [motor["serial_number"] for motor in json.loads(out)["motors"]]

    assert listed("--parameter", "stator_resistance", "--from", "9.65", "--to", "9.85") == ["P-0003", "P-0004"]
    assert listed("--failed", "stator_resistance", "--most", "2") == ["P-0020", "P-0019"]
    assert listed() == [f"P-{n:04d}" for n in range(20, 16, -1)]
    assert listed("--serial", "P-0007") == ["P-0007"]
    code, _, err = called(capsys, "eol", "motors", "--from", "1", "--records", reference)
    assert (code, "--from and --to go with --parameter" in err) == (2, True)


def test_large_indices_leave_the_parameter_its_name(call: Call, put: Put) -> None:
    for value in (10.000001, 10.000002, 10.0, 10.000001, 10.000003, 10.000002):
        put(stator_resistance=value)
    code, out, _ = call()
    assert (code, "…]" in out, "…\n" in out) == (0, False, False)
    assert sum(line.startswith(" Stator resistance") for line in out.splitlines()) == 2


def test_a_figure_that_cannot_be_negative_has_no_control_limit_below_zero(call: Call, put: Put) -> None:
    for value in np.abs(np.random.default_rng(1).normal(0.9, 0.3, 40)):
        put(resistance_unbalance=float(value))
    code, out, _ = call("--json")
    chart = json.loads(out)["parameters"]["resistance_unbalance"]["chart"]
    assert (code, chart["low"], chart["high"] > 1.5) == (0, None, True)
    code, out, _ = call("--parameter", "resistance_unbalance")
    words = " ".join(out.split())
    assert "control limits – …" in words
    assert "▽" not in words


def test_a_chart_of_what_is_not_normally_distributed_has_no_limits_in_words(call: Call, put: Put) -> None:
    for value in np.random.default_rng(3).lognormal(0.0, 1.0, 120):
        put(stator_resistance=float(value))
    code, out, _ = call()
    assert (code, "without control limits" in " ".join(out.split()), "inf" in out) == (0, True, False)


def test_limits_are_shown_as_they_were_stated_whatever_the_spread(call: Call, put: Put) -> None:
    put(stator_resistance=1.0, limits=(0.5, 1.5))
    assert "0.5 … 1.5" in call("--language", "en")[1], "one motor has no spread"
    put(stator_resistance=900.0, limits=(0.5, 1.5))
    assert "0.5 … 1.5" in call("--language", "en")[1]


def test_a_golden_motor_that_was_never_tested_is_a_slip(call: Call, put: Put) -> None:
    put(serial="GOLD", stator_resistance=10.5)
    put(stator_resistance=10.5)
    assert call("--golden", "GOLD")[0] == 0
    code, _, err = call("--golden", "GOLDD")
    assert (code, "no test of a motor 'GOLDD'" in err) == (2, True)


def test_brackets_in_names_are_printed_as_they_are(call: Call, records: Records) -> None:
    """The terminal's library takes them for its own: of some it makes a colour, of others an error."""
    records.save(motor_record(1, station="hall [/7]", serial_number="A[red]1"))
    code, out, _ = call("--by", "station")
    assert (code, "hall [/7]" in out) == (0, True)


def test_motors_that_nothing_can_match_are_said_to_be_none(
    put: Put, records: Records, reference: str, capsys: pytest.CaptureFixture[str]
) -> None:
    put(stator_resistance=10.0, serial="A[/b]1")
    put(stator_resistance=20.0, serial="A[/b]2")

    def motors(*arguments: str) -> tuple[int, str, str]:
        return called(capsys, "eol", "motors", *arguments, "--records", reference, "--language", "en")

    code, out, err = motors("--failed", "stator_resistance")
    assert (code, "A[/b]2" in out, "A[/b]1" in out, err) == (0, True, False, "")
    assert "did you mean stator_resistance?" in motors("--failed", "stator_resistanse")[2]
    assert motors("--failed", "stator_resistanse")[0] == 2
    limits = ("--parameter", "stator_resistance", "--from")
    assert [motors(*limits, *given)[0] for given in (("nan",), ("5", "--to", "1"), ("15",))] == [2, 2, 0]
    code, _, err = motors("--serial", "A3")
    assert (code, err) == (0, "motorbench: no motor of the records is as wanted\n")
