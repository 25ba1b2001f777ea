from tests.studies.kills import good, study, table


def test_a_killed_run_leaves_nothing_on_loses_nothing_and_goes_on() -> None:
    found = study(kills=1, seed=3, workers=1, procedures=("pole-pairs-static",))
    assert good(found), table(found) + "\n" + "\n".join(map(str, found))
