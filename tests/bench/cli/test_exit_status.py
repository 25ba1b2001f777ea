"""One rule of exit statuses for all commands (docs/reference/commands.rst): one case of each typed."""

import io
import re
import shlex
from pathlib import Path

import pytest

from bench.cli.main import make_app
from tests.command_line import Call

EXAMPLE = Path(__file__).parents[3] / "docs" / "examples" / "eol"
#: What is wrong with what was typed, or with a file that it names; nothing is begun. {bad} is no file of any kind, {other} a TOML file of
#: something else, {none} is not there, {empty} an empty folder.
WRONG = (
    "results {empty}",
    "results list --runs {none}",
    "results schema more",
    "results verify {empty}",
    "results unpack {empty}",
    "demo --motor {other}",
    "run nameplate --station {other} --motor lg-400w",
    "run nameplate --station virtual --motor {other}",
    "run nameplate --station virtual --motor lg-400w --faults {other}",
    "run nameplate --station virtual --motor lg-400w --disturbances {other}",
    "run nameplate --station virtual --motor lg-400w --operator answers --answers {other}",
    "run nameplate --station virtual --motor lg-400w --set nope=1",
    "run nameplat --station virtual --motor lg-400w",
    "run --resume {empty}",
    "procedures --station {bad}",
    "parameters --unknown",
    "report {empty}",
    "sign {empty} --by X",
    "export {empty} --for vesc",
    "study nameplate --motor {other}",
    "serve --station {bad}",
    "serve --station {none}",
    "doctor {other}",
    "analyze back-emf {bad}",
    "analyze step-response {bad}",
    "analyze coast-down {bad}",
    "analyze rotor-sweep {bad}",
    "analyze four-wire {bad}",
    "analyze cogging {bad}",
    "analyze six-step {other}",
    "analyze six-step-loads {bad}",
    "analyze table {bad}",
    "analyze flux-map {bad}",
    "analyze short-circuit {bad}",
    "analyze efficiency {bad}",
    "sim six-step {other} --speed 1000",
    "sim serve --motor {other}",
    "sim serve --station {other} --motor lg-400w",
    "station check {other}",
    "station drivers nobody",
    "station scan {other}",
    "station new",
    "station record {other} --output x",
    "station replay {bad}",
    "station set-framing {other}",
    "station reset {other} --by X",
    "eol run {other} --station virtual",
    "eol check {other}",
    "eol schema more",
    "eol export --records {bad} --format csv",
    "eol motor S1 --records {bad}",
    "eol labels --records {bad} --batch B",
    "eol archive B --records {bad} --output x",
    "eol restore {bad}",
    "eol retain {other}",
    "eol pack B --runs {none}",
    "eol close B --runs {none}",
    "eol motors --records {none}",
    "eol plan {empty} --output x.toml",
    "eol migrate --records {bad}",
    "eol stats --records {none}",
    "eol forward --records {other}",
    "user add",
)


@pytest.fixture
def named(tmp_path: Path) -> dict[str, Path]:
    made = {name: tmp_path / f"{name}.toml" for name in ("bad", "other", "none", "empty")}
    made["bad"].write_bytes(b"\xff\xfe\x00\x00 no file of any kind \x80")
    made["other"].write_text("[something]\nelse = 1\n", encoding="utf-8")
    made["empty"].mkdir()
    return made


@pytest.mark.parametrize("typed", WRONG)
def test_what_is_wrong_with_what_was_typed_is_two(call: Call, named: dict[str, Path], typed: str) -> None:
    code, out, err = call(*(word.format(**named) for word in typed.split()))
    assert (code, out) == (2, ""), err
    assert err.startswith("motorbench: ")


def test_every_command_has_its_case() -> None:
    typed = {" ".join(re.split(r" [{-]", case)[0].split()[:2]) for case in WRONG}
    for name in (each for each in make_app() if not each.startswith("-")):
        app = make_app()[name]
        inner = [each for each in app if not each.startswith("-")]
        for one in inner or [""]:
            assert any(case.startswith(f"{name} {one}".strip()) for case in typed), (name, one)


@pytest.mark.parametrize(
    "typed",
    [
        "run stator-resistance --station virtual --motor lg-400w --fault 'open_phase terminal=A'",
        "station check {silent}",
    ],
)
def test_what_was_begun_and_failed_is_one(call: Call, tmp_path: Path, typed: str) -> None:
    silent = tmp_path / "silent.toml"
    silent.write_text(
        '[station]\nname = "S"\n[instruments.supply]\ndriver = "keysight-e36300"\n'
        'address = "TCPIP0::127.0.0.1::1::SOCKET"\nchannel = 1\nmaximum_current = 1.0\n',
        encoding="utf-8",
    )
    code, _, err = call(*(word.format(silent=silent) for word in shlex.split(typed)))
    assert code == 1, err


def test_a_hyphen_names_the_input_and_another_option_is_no_value(
    call: Call, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """As the guide has it: `--serials -`."""
    typed = ("eol", "run", str(EXAMPLE / "plan.toml"), "--station", "virtual", "--runs", str(tmp_path / "runs"))
    monkeypatch.setattr("sys.stdin", io.StringIO("\n"))
    code, _, err = call(*typed, "--records", str(tmp_path / "records.sqlite"), "--serials", "-")
    assert code == 2
    assert "no serial number came before the end of the input" in err
    code, _, err = call(*typed, "--serials", "--again")
    assert (code, err) == (2, "motorbench: --serials needs a value.\n")
