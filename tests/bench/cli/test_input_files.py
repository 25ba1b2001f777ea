"""Every command with a file that is not there, or that cannot be read: exit status 2, and one sentence that names it."""

from pathlib import Path

import pytest
from cyclopts import App

from bench.cli.main import make_app
from bench.eol.plan import load_plan
from bench.operators.answers import load_answers
from tests.command_line import Call

#: What is typed after a command; FILE stands for the file that cannot be used.
INPUTS = {
    "run": [
        "nameplate --station FILE --motor lg-400w",
        "nameplate --station virtual --motor FILE",
        "nameplate --station virtual --motor lg-400w --faults FILE",
        "nameplate --station virtual --motor lg-400w --disturbances FILE",
        "nameplate --station FILE --motor lg-400w --rehearse",
        "nameplate --resume FILE",
    ],
    "demo": ["--motor FILE", "--disturbances FILE", "--faults FILE"],
    "procedures": ["--station FILE"],
    "parameters": ["--station FILE"],
    "report": ["FILE"],
    "export": ["FILE --for odrive", "--list --station FILE"],
    "serve": ["--station FILE"],
    "results": ["FILE"],
    "sign": ["FILE --by me --meaning checked"],
    "results verify": ["FILE"],
    "analyze back-emf": ["FILE"],
    "analyze step-response": ["FILE"],
    "analyze coast-down": ["FILE"],
    "analyze rotor-sweep": ["FILE"],
    "analyze four-wire": ["FILE"],
    "analyze cogging": ["FILE"],
    "analyze six-step": ["FILE --load 0.5"],
    "analyze six-step-loads": ["FILE"],
    "analyze table": ["FILE --motor lg-400w"],
    "sim six-step": ["--motor FILE --load 0.5"],
    "sim serve": ["--motor FILE", "--motor lg-400w --disturbances FILE", "--motor lg-400w --faults FILE"],
    "station check": ["FILE"],
    "station record": ["FILE --out out.traffic"],
    "station replay": ["FILE", "FILE --serve"],
    "station scan": ["--station FILE"],
    "station drivers": ["--station FILE"],
    "station set-framing": ["FILE dynamometer --rate 19200"],
    "station reset": ["FILE --by me"],
    "doctor": ["FILE"],
    "eol run": ["FILE --station virtual --motors 1"],
    "eol check": ["FILE"],
    "eol export": ["--format csv --records FILE --out out.csv"],
    "eol plan": ["FILE --output out.toml"],
    "eol labels": ["--batch one --records FILE"],
    "eol stats": ["--records FILE"],
    "eol motors": ["--records FILE"],
    "eol motor": ["P-0001 --records FILE"],
    "eol migrate": ["--records FILE"],
    "eol archive": ["one --records FILE --output out.tar.gz"],
    "eol restore": ["FILE"],
    "eol retain": ["FILE"],
    "results unpack": ["FILE"],
    "study": ["nameplate --station FILE --motor lg-400w", "nameplate --motor FILE"],
    "analyze flux-map": ["FILE"],
    "analyze short-circuit": ["FILE --pole-pairs 4"],
    "analyze efficiency": ["FILE"],
}
#: These take no file that has to be there.
NONE = {
    "station new",
    "results list",
    "results schema",
    "eol schema",
    "eol pack",
    "eol close",
    "eol forward",
    "user add",
}


def commands(app: App, *before: str) -> set[str]:
    """Return all commands by what is typed."""
    found = set()
    for name in app:
        if name.startswith("-"):
            continue
        inner = app[name]
        own = commands(inner, *before, name)
        found |= own
        if not own or inner.default_command is not None:
            found.add(" ".join((*before, name)))
    return found


def test_no_command_is_left_out() -> None:
    assert commands(make_app()) == set(INPUTS) | NONE


@pytest.mark.parametrize("what", ["missing", "no text", "a folder"])
@pytest.mark.parametrize(("command", "typed"), [(name, each) for name, all_of in INPUTS.items() for each in all_of])
def test_a_file_that_cannot_be_used_is_named(call: Call, tmp_path: Path, command: str, typed: str, what: str) -> None:
    file = tmp_path / "given.toml"
    if what == "no text":
        file.write_bytes(b"\xff\xfe\x00\x93" * 100)
    elif what == "a folder":
        file.mkdir()
    code, out, err = call(*command.split(), *typed.replace("FILE", str(file)).split())
    assert (code, out) == (2, "")
    assert err.startswith("motorbench: ")
    assert "given.toml" in err
    assert len(err.splitlines()) == 1


def test_a_byte_order_mark_before_a_file_changes_nothing(call: Call, tmp_path: Path) -> None:
    """Editors on Windows put one in front of UTF-8 text."""
    examples = Path(__file__).parents[3] / "docs/examples"
    for name in ("note/station.toml", "note/answers-pole-pairs.toml", "eol/plan.toml", "eol/motor.toml"):
        file = examples / name
        (tmp_path / file.name).write_bytes(b"\xef\xbb\xbf" + file.read_bytes())
    dialogue = sorted((Path(__file__).parents[2] / "drivers/dialogues").glob("*.traffic"))[0]
    (tmp_path / "one.traffic").write_bytes(b"\xef\xbb\xbf" + dialogue.read_bytes())
    assert call("station", "check", str(tmp_path / "station.toml"))[0] == 0
    assert call("station", "replay", str(tmp_path / "one.traffic"))[0] == 0
    assert load_answers(tmp_path / "answers-pole-pairs.toml")
    assert load_plan(tmp_path / "plan.toml").name == load_plan(examples / "eol/plan.toml").name
    words = ("--station", str(tmp_path / "station.toml"), "--motor", str(tmp_path / "motor.toml"), "--rehearse")
    code, _, errors = call("run", "nameplate", *words, "--runs", str(tmp_path / "runs"))
    assert code == 0, errors


@pytest.mark.parametrize("command", ["procedures", "parameters", "station drivers"])
def test_a_key_that_no_station_has_is_refused_where_only_plug_ins_are_wanted(
    call: Call, tmp_path: Path, command: str
) -> None:
    file = tmp_path / "station.toml"
    for content, said in (
        ('[plugins]\nfiles = []\n[stations]\nname = "x"\n', "unknown key stations; did you mean station?"),
        ('[station]\nname = "x"\nvisa = "y"\n', "unknown key station.visa"),
        ("[instruments.multimeter]\n", "unknown key instruments.multimeter; did you mean voltmeter?"),
        ("plugins = 3\n", "plugins = 3; allowed is a table"),
    ):
        file.write_text(content, encoding="utf-8")
        code, out, err = call(*command.split(), "--station", str(file), "--language", "en")
        assert (code, out) == (2, ""), content
        assert said in err
    # A line's file has procedures, too.
    file.write_text('[line]\nbench = "virtual"\nsockets = 2\n', encoding="utf-8")
    assert call(*command.split(), "--station", str(file))[0] == 0
