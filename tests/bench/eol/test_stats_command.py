"""`motorbench eol stats` from the command line."""

import json
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from sqlalchemy import Engine

from bench.cli.main import main
from bench.eol.statistics.gauge import gauge_study
from tests.command_line import Call, called

Put = Callable[..., None]


@pytest.fixture
def call(capsys: pytest.CaptureFixture[str], reference: str) -> Call:
    def run(*arguments: str) -> tuple[int, str, str]:
        return called(capsys, "eol", "stats", *arguments, "--records", reference)

    return run


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
    low, high = result["cpk"]["interval"]
    assert low < result["cpk"]["value"] < high
    # The one that is far off spoils the whole spread more than the neighbours'.
    assert result["ppk"]["value"] < result["cpk"]["value"]
    assert {"index": 39, "rule": 1, "serial_number": "P-0040"} in result["chart"]["signals"]
    assert result["golden"][0]["values"] == [10.5]
    code, out, _ = call("--parameter", "stator_resistance", "--golden", "GOLD", "--language", "en")
    assert code == 0
    for words in (
        "39 / 40",
        "97.50",
        "Stator resistance",
        "Ppk",
        "rule 1, a point beyond 3 sigma: P-0040",
        "GOLD: 1 ×",
    ):
        assert words in out
    assert "最终合格" in call("--language", "zh")[1]


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
        (("--parameter", "stator_resistence"), 1, "did you mean stator_resistance"),
        (("B7",), 1, "there is no batch 'B7'; there are: B1"),
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
