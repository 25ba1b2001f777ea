"""What is said of a finding stays true where a figure beside it is withheld for another reason."""

import pytest

from procedures.core.misfit_text import sentence
from procedures.estimation.fitting.misfit import Answer, Cause, Finding


@pytest.mark.parametrize("answer", [Answer.MODELLED, Answer.WIDENED])
def test_an_interval_is_claimed_of_given_figures_only(answer):
    said = sentence(Finding(Cause.SLOPE, answer)).render()
    assert "every figure that is given" in said
