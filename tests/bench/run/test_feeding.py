"""What is on and what has turned the shaft, as the journal tells it."""

from bench.run.feeding import FeedingRoles
from drivers.interfaces import Role
from tests.journals import event


def test_what_is_on_stays_so_until_it_is_off_or_made_safe() -> None:
    feeding = FeedingRoles()
    feeding.hear(event("energising", instrument="supply"))
    feeding.hear(event("energising", instrument="oscilloscope"))
    assert (set(feeding.roles), feeding.turned) == ({Role.SUPPLY}, False)
    feeding.hear(event("de_energised", instrument="supply", error="no reply"))
    assert set(feeding.roles) == {Role.SUPPLY}
    feeding.hear(event("made_safe", instrument="supply", item="output_off", outcome="failed"))
    assert set(feeding.roles) == {Role.SUPPLY}
    feeding.hear(event("made_safe", instrument="supply", item="output_off", outcome="safe"))
    assert not feeding.roles


def test_a_driven_shaft_turns_until_it_was_seen_at_rest() -> None:
    feeding = FeedingRoles()
    feeding.hear(event("energising", instrument="dynamometer"))
    feeding.hear(event("de_energised", instrument="dynamometer"))
    assert not feeding.roles
    assert feeding.turned
    feeding.stands()
    assert not feeding.turned
