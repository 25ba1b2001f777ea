"""A short look with hypothesis at everything that is fuzzed: only the documented errors, no hang, bounded memory."""

import pytest
from hypothesis import HealthCheck, given, settings

from tests.studies.fuzz.catalogue import all_targets
from tests.studies.fuzz.mutation import mutated
from tests.studies.fuzz.target import check, in_time

TARGETS = all_targets()


@pytest.mark.parametrize("name", TARGETS)
def test_only_documented_errors(name: str) -> None:
    target = TARGETS[name]

    @settings(max_examples=25, deadline=None, database=None, suppress_health_check=list(HealthCheck))
    @given(mutated(target.seeds))
    def run(data: bytes) -> None:
        with in_time():
            check(target, data)

    for seed in target.seeds:
        check(target, seed)
    run()
