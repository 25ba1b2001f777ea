"""One unit in the spellings that headings have."""

import math

import pytest

from bench.captures.units import si, split_heading

MINUTE = 2.0 * math.pi / 60.0


@pytest.mark.parametrize(
    ("written", "unit", "factor"),
    [
        *((text, "rad/s", MINUTE) for text in ("rpm", "1/min", "min-1", "min^-1", "min⁻¹", "min−1", "U/min", "r/min")),
        *((text, "rad/s", 1.0) for text in ("rad/s", "rad s-1", "rad·s⁻¹", "rad s^-1")),
        *((text, "rad/s", 2.0 * math.pi) for text in ("rps", "rev/s", "r/s", "turn/s", "turns/s")),
        ("kHz", "Hz", 1e3),
        *((text, "N·m", 1.0) for text in ("Nm", "N.m", "N·m", "N⋅m", "N m", "N*m", "N-m")),
        *((text, "N·m", 1e-3) for text in ("mNm", "mN.m", "mN·m", "mN m")),
        *((text, "N·m", 1e-2) for text in ("Ncm", "N·cm", "cNm")),
        *((text, "N·m", 1e-3) for text in ("Nmm", "N.mm", "N·mm", "N-mm", "mNm")),
        *((text, "rad/s", 1.0) for text in ("rad.s-1", "rad.s^-1")),
        *((text, "N·m", 0.0070615518) for text in ("ozf·in", "oz-in", "oz.in", "in·oz")),
        *((text, "N·m", 0.1129848290) for text in ("lbf·in", "in-lb", "lb.in")),
        *((text, "N·m", 1.3558179483) for text in ("lbf·ft", "ft-lb", "ft·lbf")),
        *((text, "N·m", 0.0980665) for text in ("kgf·cm", "kg·cm")),
        *((text, "N·m", 9.80665e-5) for text in ("gf·cm", "g-cm")),
        *((text, "H", 1e-6) for text in ("uH", "\u00b5H", "\u03bcH")),
        *((text, "rad", 2.0 * math.pi) for text in ("rev", "turn", "turns")),
        *((text, "Ω", 1e-3) for text in ("mohm", "mOhm", "mOhms", "m\u03a9", "m\u2126")),
    ],
)
def test_a_unit_in_every_spelling(written: str, unit: str, factor: float) -> None:
    for spelling in (written, split_heading(f"x ({written})")[1], split_heading(f"x [{written}]")[1]):
        found = si(spelling)
        assert found is not None
        assert found[0] == unit
        assert found[1] == pytest.approx(factor)


@pytest.mark.parametrize("written", ["M", "Mm", "1/s", "s.", "min.", "g·cm²", "g-cm2", "°C", "", "m"])
def test_what_is_no_unit_of_a_record(written: str) -> None:
    assert si(written) is None


@pytest.mark.parametrize(
    ("heading", "name", "unit", "factor"),
    [
        ("omega_rad_s", "omega", "rad/s", 1.0),
        ("speed_rad/s", "speed", "rad/s", 1.0),
        ("w_rad_per_s", "w", "rad/s", 1.0),
        ("torque_N_m", "torque", "N·m", 1.0),
        ("torque_mN_m", "torque", "N·m", 1e-3),
    ],
)
def test_names_of_variables_state_products_and_quotients(heading: str, name: str, unit: str, factor: float) -> None:
    found, written = split_heading(heading)
    assert (found, si(written)) == (name, (unit, factor))
