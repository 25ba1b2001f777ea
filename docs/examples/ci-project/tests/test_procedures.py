"""Single procedures with settings of one's own."""


def test_flux_linkage_of_a_weaker_magnet(run_procedure, virtual_motor, assert_holds_truth):
    ran = run_procedure(
        "back-emf-constant", motor=virtual_motor(flux_linkage=7.0e-3), seed=3, settings={"winding_temperature": 25.0}
    )
    assert ran.status == "completed", ran.cause
    assert ran.truth["flux_linkage"] == 7.0e-3
    assert_holds_truth(ran, names=["flux_linkage"])
