import json
from datetime import UTC, datetime
from pathlib import Path

import pytest

from bench.i18n.errors import InputError
from bench.journal.journal import Journal
from bench.journal.journal_file import read_journal
from bench.journal.run_folder import RunFolder
from bench.journal.signatures import Meaning, sign, signatures
from tests.command_line import Call
from tests.journals import event

NOON = datetime(2026, 11, 21, 12, tzinfo=UTC)


@pytest.fixture
def ended(tmp_path: Path) -> RunFolder:
    journal = Journal(tmp_path / "journal.jsonl", lambda: 0.0)
    journal.record(event("run_started", procedures=[], settings=[]))
    journal.record(event("run_finished", status="completed", bench_time=0.0, wall_time=0.0))
    journal.close()
    return RunFolder(tmp_path)


def test_a_signature_names_the_journals_end(ended: RunFolder) -> None:
    sign(ended, " J. Doe ", "engineer", "released", NOON, Meaning.APPROVED)
    sign(ended, "王工", "engineer", "", NOON, Meaning.MEASURED)
    first, second = signatures(ended)
    assert (first.person, first.meaning, first.words, first.time, first.holds) == (
        "J. Doe",
        "approved",
        "released",
        "2026-11-21T12:00:00+00:00",
        True,
    )
    assert first.sha256 == read_journal(ended.journal).last_hash
    assert (second.person, second.holds) == ("王工", True)


def test_the_same_is_signed_once(ended: RunFolder) -> None:
    sign(ended, "J. Doe", "engineer", "", NOON, Meaning.MEASURED)
    with pytest.raises(InputError, match=r"J\. Doe has signed this already: I measured this motor"):
        sign(ended, "J. Doe", "engineer", "", NOON.replace(hour=13), Meaning.MEASURED)
    sign(ended, "J. Doe", "engineer", "", NOON, Meaning.APPROVED)
    assert [signature.meaning for signature in signatures(ended)] == ["measured", "approved"]


def test_a_journal_that_went_on_voids_it(ended: RunFolder) -> None:
    sign(ended, "J. Doe", "engineer", "", NOON, Meaning.MEASURED)
    journal = Journal(ended.journal, lambda: 0.0, previous=read_journal(ended.journal))
    journal.record(event("run_resumed"))
    journal.record(event("run_finished", status="completed", bench_time=0.0, wall_time=0.0))
    journal.close()
    assert [signature.holds for signature in signatures(ended)] == [False]


def test_only_a_run_with_an_end_is_signed(tmp_path: Path) -> None:
    journal = Journal(tmp_path / "journal.jsonl", lambda: 0.0)
    journal.record(event("run_started", procedures=[], settings=[]))
    with pytest.raises(InputError, match="has not ended"):
        sign(RunFolder(tmp_path), "J. Doe", "engineer", "", NOON, Meaning.MEASURED)
    journal.close()
    assert signatures(RunFolder(tmp_path)) == ()


@pytest.mark.parametrize(
    ("person", "words", "said"), [("  ", "", "needs the name"), ("J", "x" * 501, "501 characters")]
)
def test_what_is_no_signature(ended: RunFolder, person: str, words: str, said: str) -> None:
    with pytest.raises(InputError, match=said):
        sign(ended, person, "engineer", words, NOON, Meaning.MEASURED)


@pytest.mark.parametrize("content", ["no json", json.dumps([{"who": 1}]), json.dumps({"a": 1})])
def test_a_spoilt_file_is_told(ended: RunFolder, content: str) -> None:
    (ended.path / "signatures.json").write_text(content)
    with pytest.raises(InputError, match="no signatures"):
        signatures(ended)


def test_a_run_is_signed_at_a_terminal(ended: RunFolder, call: Call) -> None:
    code, out, _ = call("sign", str(ended.path), "--by", "Li Wei", "--meaning", "checked", "--json")
    (made,) = signatures(ended)
    assert code == 0
    assert json.loads(out)["sha256"] == made.sha256
    assert (made.person, made.role, made.meaning, made.holds) == ("Li Wei", "at a terminal", "checked", True)


@pytest.mark.parametrize(
    ("given", "status", "said"),
    [
        (("--by", "Li Wei", "--meaning", "seen"), 2, "--meaning seen: allowed are measured, checked, approved"),
        (("--by", " "), 1, "a signature needs the name of the person who signs"),
        ((), 2, "--by needs a value"),
        (("--by", "Li\x1b[31m Wei"), 1, "contains the sign U+001B, which cannot be read"),
        (("--by", "Li\nWei"), 1, "contains the sign U+000A"),
        (("--by", "Li\u202eWei"), 1, "contains the sign U+202E"),
        (("--by", 300 * "x"), 1, "has 300 characters; up to 200 are allowed"),
    ],
)
def test_a_signature_that_says_nothing_is_refused(
    ended: RunFolder, call: Call, given: tuple[str, ...], status: int, said: str
) -> None:
    code, _, err = call("sign", str(ended.path), *given)
    assert (code, said in err) == (status, True), err
    assert signatures(ended) == ()
