import tomllib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bench.files.toml_text import toml_text

scalars = (
    st.booleans()
    | st.integers(-(2**62), 2**62)
    | st.floats(allow_nan=False)
    | st.text(st.characters(exclude_categories=["Cs"]))
)
values = scalars | st.lists(scalars, max_size=3)
tables = st.recursive(
    st.dictionaries(st.text(st.characters(exclude_categories=["Cs"]), max_size=5), values, max_size=3),
    lambda inner: st.dictionaries(st.text("abc 1.", max_size=3), values | inner, max_size=3),
    max_leaves=5,
)


@given(tables)
def test_what_is_written_is_read_again(data: dict[str, object]) -> None:
    assert tomllib.loads(toml_text(data)) == data


def test_the_form() -> None:
    station = {"station": {"name": 'a "b"'}, "instruments": {"scope": {"bits": 8, "probes": {"1": {"kind": "V"}}}}}
    assert toml_text(station) == (
        '[station]\nname = "a \\"b\\""\n\n[instruments.scope]\nbits = 8\n\n[instruments.scope.probes.1]\nkind = "V"\n'
    )


def test_what_has_no_form_is_named() -> None:
    with pytest.raises(TypeError, match="NoneType has no form"):
        toml_text({"nothing": None})
