import json
from pathlib import Path

import pytest

from bench.cli.main import main
from bench.eol.plan import load_plan
from bench.eol.plan_name import plan_name

MOTOR = Path(__file__).parents[3] / "docs" / "examples" / "eol" / "motor.toml"


def call(*arguments: str) -> int:
    with pytest.raises(SystemExit) as ended:
        main(list(arguments))
    return int(ended.value.code or 0)


def test_limits_stand_about_what_was_found_and_no_narrower_than_it_was_known(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    runs, path = tmp_path / "runs", tmp_path / "plans" / "drone.toml"
    run = ("run", "stator-resistance", "pole-pairs-static", "--station", "virtual", "--motor", "drone")
    assert call(*run, "--operator", "virtual", "--set", "winding_temperature=25", "--runs", str(runs)) == 0
    capsys.readouterr()
    plan = ("eol", "plan", "--runs", str(runs), "--output", str(path))
    assert call(*plan, "--percent", "1", "--json") == 0
    said = json.loads(capsys.readouterr().out)
    assert (sorted(said["limited"]), said["unlimited"]) == (["pole_pairs", "stator_resistance"], [])
    made = load_plan(path)
    assert made.motor == "drone"
    assert [(check.name, dict(check.settings)) for check in made.checks] == [
        ("stator-resistance", {"winding_temperature": 25.0}),
        ("pole-pairs-static", {}),
    ]
    result = json.loads(next(runs.glob("*/result.json")).read_text())["parameters"]["stator_resistance"]
    low, high = result["coverage_interval"]
    limit = made.absolute["stator_resistance"]
    # The bridge knows so small a resistance to several per cent: 1 % would decide nothing.
    assert limit.low <= result["value"] - (high - low)
    assert limit.high >= result["value"] + (high - low)
    assert (made.absolute["pole_pairs"].low, made.absolute["pole_pairs"].high) == (7.0, 7.0)
    assert call(*plan) == 1
    assert "already exists" in capsys.readouterr().err
    assert call(*plan, "--percent", "0") == 2


def test_a_safety_test_comes_first_whenever_the_run_had_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    runs, path = tmp_path / "runs", tmp_path / "plan.toml"
    run = ("run", "pole-pairs-static", "insulation-resistance", "--station", "virtual", "--motor", str(MOTOR))
    assert call(*run, "--operator", "fixture", "--runs", str(runs)) == 0
    assert call("eol", "plan", "--runs", str(runs), "--output", str(path)) == 0
    assert [check.name for check in load_plan(path).checks] == ["insulation-resistance", "pole-pairs-static"]


@pytest.mark.parametrize(
    ("model", "name"), [("Pump drive 3", "pump-drive-3.toml"), ("../x", "x.toml"), ("", "motor.toml")]
)
def test_a_plans_file_is_named_by_the_type_and_stays_in_its_folder(model: str, name: str) -> None:
    assert plan_name(model) == name
