"""The power state machine of CiA 402 by itself."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.cia402.power_state import PowerState, decode_state, error_name


@given(st.integers(0, 0xFFFF))
def test_every_statusword_is_one_state_or_none(word: int) -> None:
    matching = [state for state in PowerState if word & state.value[0] == state.value[1]]
    assert len(matching) <= 1
    if matching:
        assert decode_state(word) is matching[0]
    else:
        with pytest.raises(ValueError, match="is not a valid state"):
            decode_state(word)


def test_error_codes_have_names() -> None:
    assert error_name(0x2310) == "0x2310 (continuous over-current)"
    assert error_name(0x23FF) == "0x23FF (current)"
    assert error_name(0x0000) == "0x0000 (unknown)"
