import pytest

from bench.panel.server.sessions import AccessRight, Sessions, SessionTimes


class Time:
    now = 0.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def time() -> Time:
    return Time()


@pytest.fixture
def sessions(time: Time) -> Sessions:
    return Sessions(SessionTimes(idle=100.0, length=250.0), time)


def test_one_that_nobody_uses_ends(sessions: Sessions, time: Time) -> None:
    session = sessions.open(AccessRight.ENGINEER)
    time.now = 99.0
    assert sessions.find(session.token) is session
    time.now = 100.0
    assert sessions.find(session.token) is None
    assert not session.may_lead
    assert not session.may_change
    assert sessions.newly_ended() == [session]
    assert sessions.newly_ended() == []


def test_one_that_is_used_ends_all_the_same_in_time(sessions: Sessions, time: Time) -> None:
    session = sessions.open(AccessRight.OPERATOR)
    for time.now in (90.0, 180.0, 249.0):
        assert sessions.find(session.token) is session
        sessions.use(session)
    time.now = 250.0
    assert sessions.newly_ended() == [session]
    sessions.use(session)
    assert sessions.find(session.token) is None


def test_without_times_none_ends(time: Time) -> None:
    sessions = Sessions(None, time)
    session = sessions.open(AccessRight.ENGINEER)
    time.now = 1e9
    assert sessions.find(session.token) is session


def test_there_are_never_more_than_a_thousand(time: Time) -> None:
    sessions = Sessions(None, time)
    used, unused = sessions.open(AccessRight.ENGINEER), sessions.open(AccessRight.ENGINEER)
    for time.now in range(1, 2000):
        sessions.open(AccessRight.ENGINEER)
        sessions.use(used)
    assert sessions.find(used.token) is used
    assert unused.ended
    assert len(sessions.newly_ended()) == 1001


def test_nobody_can_guess_a_token(sessions: Sessions) -> None:
    tokens = {sessions.open(AccessRight.VIEWER).token for _ in range(100)}
    assert len(tokens) == 100
    assert all(len(token) >= 43 for token in tokens)


def test_who_is_logged_in_takes_no_other_name(sessions: Sessions) -> None:
    anybody, anna = sessions.open(AccessRight.ENGINEER), sessions.open(AccessRight.ENGINEER, "anna")
    anna.logged_in = True
    for session in (anybody, anna):
        session.call(" J. Doe ")
        session.call("")
    assert (anybody.person, anna.person) == ("J. Doe", "anna")
