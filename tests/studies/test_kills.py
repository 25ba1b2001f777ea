from tests.studies.kills import good, study, table


def test_killed_runs_leave_nothing_on_lose_nothing_and_go_on() -> None:
    found = study(kills=2, seed=3, workers=1)
    assert good(found), table(found) + "\n" + "\n".join(map(str, found))
