"""What is written is what was measured: each file is read and led back to SI by the controllers' own formulas."""

from collections.abc import Callable

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from bench.plugins.catalogues import installed
from reports.exports.subject import Datasheet, Subject
from reports.exports.target import sheet_for
from tests.reports.exports.back_to_si import BACK
from tests.reports.exports.map_subject import MAPS
from tests.reports.exports.readers import READERS

#: Those of flux maps are read in test_map_exports.py.
PLAIN = [name for name in installed().exports if name not in MAPS]

#: Nine digits are written; a difference of two figures loses one or two.
ROUNDING = 2e-8

motors = st.builds(
    lambda p, r, l_d, saliency, flux, j, b: {
        "pole_pairs": float(p),
        "stator_resistance": r,
        "d_axis_inductance": l_d,
        "q_axis_inductance": l_d * saliency,
        "flux_linkage": flux,
        "inertia": j,
        "coulomb_friction": 100.0 * b,
        "viscous_friction": b,
    },
    st.integers(1, 40),
    st.floats(1e-3, 50.0),
    st.floats(1e-6, 0.1),
    st.floats(1.0, 3.0),
    st.floats(1e-4, 1.0),
    st.floats(1e-8, 1.0),
    st.floats(1e-8, 1e-2),
)
#: A fixture that only makes things may serve all examples.
shared = settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=20)


def test_every_target_has_a_reader() -> None:
    assert set(READERS) == set(BACK) == set(PLAIN)


@pytest.mark.parametrize("name", PLAIN)
@shared
@given(motor=motors)
def test_file_to_si(name: str, motor: dict[str, float], make_subject: Callable[..., Subject]) -> None:
    content = installed().exports[name].write(sheet_for(installed().exports[name], make_subject(motor)))
    found = BACK[name](READERS[name](content))
    wanted = {**motor, "mean_inductance": 0.5 * (motor["d_axis_inductance"] + motor["q_axis_inductance"])}
    assert {"pole_pairs", "stator_resistance", "flux_linkage"} <= set(found)
    assert found == pytest.approx({key: wanted[key] for key in found}, rel=ROUNDING)


nasty = st.text(max_size=40) | st.sampled_from(
    [
        "*/ int x; /*",
        "--> <evil/> <!--",
        "'); system('x'); disp('",
        "a\nimport os\n",
        '"]}',
        "=1+1",
        "\ud800",
        "电机 ??/",
        "\\\n",
    ]
)


@pytest.mark.parametrize("name", PLAIN)
@shared
@given(motor=nasty, serial=nasty)
def test_no_name_breaks_out_of_a_comment(
    name: str, motor: str, serial: str, make_subject: Callable[..., Subject]
) -> None:
    target = installed().exports[name]
    plain = target.write(sheet_for(target, make_subject()))
    content = target.write(sheet_for(target, make_subject(motor=motor, serial_number=serial)))
    assert READERS[name](content) == READERS[name](plain)
    content.encode("utf-8")


def test_the_plate_goes_along(make_subject: Callable[..., Subject]) -> None:
    target = installed().exports["mathworks"]
    read = READERS["mathworks"](target.write(sheet_for(target, make_subject())))
    assert (read["I_rated"], read["N_max"]) == (29.0, 4000.0)
    without = make_subject(datasheet=Datasheet(29.0, 80.0, 3000.0, None))
    assert sheet_for(target, without).line("pmsm.N_max").figure.value == 3000.0


@pytest.mark.parametrize("name", [n for n in PLAIN if n not in ("json", "csv", "mdf4")])
def test_every_figure_has_its_unit_and_convention_beside_it(name: str, make_subject: Callable[..., Subject]) -> None:
    target = installed().exports[name]
    sheet = sheet_for(target, make_subject())
    written = target.write(sheet).splitlines()
    for line in sheet.lines:
        assert line.comment.isascii()
        assert line.unit in line.comment
        beside = line.comment.replace("--", "- -") if name == "vesc" else line.comment
        assert any(line.text in row and line.name.rpartition(".")[2] in row and beside in row for row in written)
    heading = "\n".join(written[:8])
    assert "LG-400W, serial number 0042" in heading
    assert "20261121T000000Z-lg-400w" in heading
