"""A run on a disturbed virtual bench: `--disturbances FILE`, as the virtual bench that is served takes it."""

import pytest

from bench.cli.main import main

SERIES = "[contacts]\nresistance = 0.5\nremaking = 0.0\n"


def test_a_run_is_disturbed_as_the_file_says_and_keeps_it(motorbench, tmp_path):
    file = tmp_path / "contacts.toml"
    file.write_text(SERIES, encoding="utf-8")
    arguments = ("run", "stator-resistance", "--station", "virtual", "--motor", "gimbal")
    (_, clear), (_, disturbed) = motorbench(*arguments), motorbench(*arguments, "--disturbances", str(file))
    found = [each["parameters"]["stator_resistance"]["value"] for each in (clear, disturbed)]
    assert found[1] - found[0] == pytest.approx(0.5, rel=0.1)
    assert "disturbances" not in clear
    assert disturbed["disturbances"] == SERIES


def test_contacts_that_differ_between_polarities_are_named_and_kelvin_clips_do_without(motorbench, tmp_path):
    file = tmp_path / "contacts.toml"
    file.write_text("[contacts]\nresistance = 3.0\n", encoding="utf-8")
    arguments = ("run", "stator-resistance-dc", "--station", "virtual", "--motor", "gimbal", "--seed", "2")
    _, failed = motorbench(*arguments, "--disturbances", str(file))
    assert "contacts of the clamps are in the reading" in failed["cause"]
    file.write_text("[contacts]\nresistance = 1.0\nkelvin = true\n", encoding="utf-8")
    _, own = motorbench(*arguments, "--disturbances", str(file))
    low, high = own["parameters"]["stator_resistance"]["coverage_interval"]
    assert low <= own["parameters"]["stator_resistance"]["truth"] <= high
    # Each connection reads oddly at the supply; it is said once.
    (wiring,) = (warning["message"] for warning in own["warnings"] if warning["id"] == "wiring")
    assert "further connections" in wiring


@pytest.mark.parametrize("more", [[], ["--rehearse"]])
def test_a_bench_of_somebody_else_is_not_disturbed(tmp_path, capsys, more):
    station = tmp_path / "station.toml"
    station.write_text("", encoding="utf-8")
    with pytest.raises(SystemExit) as stopped:
        main(["run", "stator-resistance", "--motor", "gimbal", "--station", str(station), "--disturbances", "x", *more])
    assert stopped.value.code != 0
    assert "--disturbances" in capsys.readouterr().err
