"""A short look with hypothesis at everything that is fuzzed: only the documented errors, no hang, bounded memory."""

import warnings
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings

from tests.studies.fuzz.__main__ import by_chance
from tests.studies.fuzz.catalogue import all_targets
from tests.studies.fuzz.mutation import mutated
from tests.studies.fuzz.target import Target, TooSlowError, check, in_time

TARGETS = all_targets()


@pytest.mark.parametrize("name", TARGETS)
def test_only_documented_errors(name: str) -> None:
    target = TARGETS[name]

    @settings(max_examples=12, deadline=None, database=None, suppress_health_check=list(HealthCheck))
    @given(mutated(target.seeds))
    def run(data: bytes) -> None:
        with in_time():
            check(target, data)

    for seed in target.seeds:
        check(target, seed)
    run()


def test_what_is_not_documented_is_found_and_kept(tmp_path: Path) -> None:
    def run(data: bytes) -> None:
        if b"[[" in data:
            raise KeyError("planted")
        if b"\xff" in data:
            raise ValueError("documented")

    outcome = by_chance(Target("planted", "", run, (ValueError,), (b"[a]",)), 20.0, tmp_path)
    assert outcome.finding == "KeyError: 'planted'"
    assert b"[[" in (tmp_path / "planted-crash").read_bytes()


@pytest.mark.parametrize("wrong", [ValueError(""), UserWarning("said")])
def test_an_error_without_words_and_a_warning_are_findings(wrong: Exception) -> None:
    def run(data: bytes) -> None:
        if isinstance(wrong, Warning):
            warnings.warn(wrong, stacklevel=1)
        else:
            raise wrong

    with pytest.raises((AssertionError, UserWarning)):
        check(Target("planted", "", run, (ValueError,), ()), b"")


def test_what_hangs_is_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tests.studies.fuzz.target.LONGEST", 0.05)

    def forever() -> None:
        while True:
            pass

    with pytest.raises(TooSlowError), in_time():
        forever()
