"""A flux map between, on and beyond its points, the way back from fluxes, and the tables that are refused."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sim_instruments.physics.motor.flux_map import FluxMap
from sim_instruments.physics.motor.flux_table import FluxTable
from tests.sim_instruments.flux_maps import BALDOR_FILE, MADE, MadeMotor, made_motors, needs_baldor, reach_of


def points(motor: MadeMotor = MADE, reach: float = 60.0, count: int = 13) -> np.ndarray:
    """Return the rows id, iq, ψd, ψq of a made motor's table."""
    axis = np.linspace(-reach, reach, count)
    d, q = (each.ravel() for each in np.meshgrid(axis, axis, indexing="ij"))
    return np.array([d, q, *motor.flux(d, q)]).T


def of(rows: np.ndarray) -> FluxMap:
    return FluxMap.from_points(*rows.T)


@needs_baldor
def test_the_measured_map_is_what_its_data_sheet_says() -> None:
    # shared/data/flux_maps/README.md: ψd(0, 0), and MTPA by a bicubic spline.
    baldor = FluxMap.from_csv(BALDOR_FILE)
    assert baldor.flux_linkage == pytest.approx(0.444, abs=5e-4)
    angles = np.radians(np.arange(0.0, 90.0, 0.01))
    for current, angle in ((5.0, 32.5), (10.0, 42.2), (20.0, 50.7)):
        d, q = -current * np.sin(angles), current * np.cos(angles)
        d_flux, q_flux = baldor.flux(d, q)
        torque = 1.5 * 2 * (d_flux * q - q_flux * d)
        assert np.degrees(angles[torque.argmax()]) == pytest.approx(angle, abs=0.051)
    assert torque.max() == pytest.approx(55.5, abs=0.05)
    # The chord λ/I of a short circuit without resistance lies just beyond the table.
    d_short, q_short = baldor.currents(0.0, 0.0)
    assert baldor.flux_linkage / -d_short == pytest.approx(17.7e-3, abs=5e-5)
    assert q_short == pytest.approx(0.0, abs=1e-9)


@needs_baldor
def test_the_measured_map_goes_through_its_points() -> None:
    rows = np.loadtxt(BALDOR_FILE, delimiter=",", skiprows=1)
    d_flux, q_flux = FluxMap.from_csv(BALDOR_FILE).flux(rows[:, 0], rows[:, 1])
    assert np.abs(d_flux - rows[:, 2]).max() < 1e-12
    assert np.abs(q_flux - rows[:, 3]).max() < 1e-12


def test_between_its_points_a_map_is_the_motor() -> None:
    made = MADE.map(60.0)
    d, q = np.random.default_rng(1).uniform(-60.0, 60.0, (2, 500))
    scale = np.hypot(*MADE.flux(d, q)).max()
    assert np.abs(np.array(made.flux(d, q)) - MADE.flux(d, q)).max() < 2e-4 * scale
    dd, dq, qd, qq = made.differential_inductances(d, q)
    direct, cross, quadrature = MADE.inductances(d, q)
    largest = max(direct.max(), quadrature.max())
    for found, right in ((dd, direct), (dq, cross), (qd, cross), (qq, quadrature)):
        assert np.abs(found - right).max() < 5e-3 * largest


@given(made_motors(), st.integers(13, 25), st.data())
def test_any_map_is_smooth_and_has_one_current_for_every_flux(
    motor: MadeMotor, count: int, data: st.DataObject
) -> None:
    reach = reach_of(motor)
    made = motor.map(reach, count)
    place = st.floats(-5.0 * reach, 5.0 * reach)
    d, q = np.array(data.draw(st.lists(st.tuples(place, place), min_size=1, max_size=8))).T
    dd, dq, qd, qq = made.differential_inductances(d, q)
    assert (dd > 0.0).all()
    assert (4.0 * dd * qq > (dq + qd) ** 2).all()
    step = 1e-6 * reach
    for found, shift in (((dd, qd), (step, 0.0)), ((dq, qq), (0.0, step))):
        after, before = made.flux(d + shift[0], q + shift[1]), made.flux(d - shift[0], q - shift[1])
        slope = (np.array(after) - np.array(before)) / (2.0 * step)
        assert np.allclose(slope, found, rtol=1e-4, atol=1e-5 * max(dd.max(), qq.max()))
    back_d, back_q = made.currents(*made.flux(d, q))
    assert np.allclose(back_d, d, atol=1e-7 * reach)
    assert np.allclose(back_q, q, atol=1e-7 * reach)


@given(made_motors(), st.tuples(st.floats(-3.0, 3.0), st.floats(-3.0, 3.0)))
def test_one_point_is_one_of_many(motor: MadeMotor, place: tuple[float, float]) -> None:
    reach = reach_of(motor)
    made = motor.map(reach, 13)
    d, q = place[0] * reach, place[1] * reach
    together = (*made.flux(d, q), *made.differential_inductances(d, q))
    assert made.at(d, q) == pytest.approx([float(each) for each in together], rel=1e-12, abs=1e-15)


def test_fluxes_and_currents_have_any_shape() -> None:
    made = MADE.map(60.0)
    d, q = np.linspace(-50.0, 50.0, 6).reshape(2, 3), 10.0
    d_flux, q_flux = made.flux(d, q)
    assert d_flux.shape == q_flux.shape == (2, 3)
    back_d, back_q = made.currents(d_flux, q_flux)
    assert np.allclose(back_d, d)
    assert back_q == pytest.approx(np.full((2, 3), 10.0))
    assert made.flux(0.0, 0.0)[0].shape == ()


def test_a_steep_knee_does_not_swing_back() -> None:
    # A spline through a step swings below zero slope; the monotone cubic does not.
    axis = np.array([-30.0, -20.0, -10.0, 0.0, 10.0, 20.0, 30.0])
    d, q = (each.ravel() for each in np.meshgrid(axis, axis, indexing="ij"))
    hard = np.interp(q, [-30.0, -10.0, 10.0, 30.0], [-0.1001, -0.1, 0.1, 0.1001])
    made = FluxMap.from_points(d, q, 0.05 + 1e-3 * d, hard)
    _, _, _, qq = made.differential_inductances(0.0, np.linspace(-40.0, 40.0, 801))
    assert (qq > 0.0).all()
    assert made.flux(0.0, 20.0)[1] == pytest.approx(0.10005)


def test_a_table_of_forward_torque_is_completed_by_symmetry() -> None:
    rows = points()
    half = of(rows[rows[:, 1] >= 0.0])
    whole = of(rows)
    d, q = np.random.default_rng(2).uniform(-60.0, 60.0, (2, 50))
    assert np.allclose(half.flux(d, q), whole.flux(d, q))
    rows[:, 3] += 0.01
    with pytest.raises(ValueError, match=r"begins at iq = 0, where ψq is up to 0\.01"):
        of(rows[rows[:, 1] >= 0.0])


def test_a_delta_winding_has_its_own_currents_and_fluxes() -> None:
    made = MADE.map(60.0)
    winding = made.scaled(3.0**-0.5, 3.0**0.5)
    d_flux, q_flux = made.flux(12.0, 30.0)
    assert np.allclose(winding.flux(12.0 / 3.0**0.5, 30.0 / 3.0**0.5), (3.0**0.5 * d_flux, 3.0**0.5 * q_flux))
    assert winding.d_axis_inductance == pytest.approx(3.0 * made.d_axis_inductance)


def test_equal_tables_are_equal_maps() -> None:
    rows = points()
    shuffled = np.random.default_rng(3).permutation(rows)
    assert of(rows) == of(shuffled)
    assert hash(of(rows)) == hash(of(shuffled))
    rows[0, 2] += 1e-6
    assert of(rows) != of(shuffled)


# What is refused, and how it is said


def turned(rows: np.ndarray, matrix: np.ndarray) -> np.ndarray:
    """Return the rows with currents and fluxes in another frame."""
    return np.hstack([rows[:, :2] @ matrix.T, rows[:, 2:] @ matrix.T])


QUARTER = np.array([[0.0, -1.0], [1.0, 0.0]])


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (lambda rows: np.delete(rows, 40, axis=0), r"has holes: 1 of 169 points .* missing, the first at id = -30 A, iq = -50 A"),
        (lambda rows: np.vstack([rows, rows[5:6]]), r"has 2 points at id = -60 A, iq = -10 A"),
        (lambda rows: rows * np.array([-1.0, -1.0, 1.0, 1.0]), r"fall with the currents .*currents are counted outwards"),
        (lambda rows: rows * np.array([1.0, 1.0, -1.0, -1.0]), r"fall with the currents .*fluxes have the wrong sign"),
        (lambda rows: rows * np.array([1.0, -1.0, 1.0, 1.0]), r"ψq falls with iq .*sign of iq, or of ψq"),
        (lambda rows: rows * np.array([1.0, 1.0, 1.0, -1.0]), r"ψq falls with iq .*sign of iq, or of ψq"),
        (lambda rows: rows[:, [1, 0, 2, 3]], r"two columns are swapped"),
        (lambda rows: rows[:, [0, 1, 3, 2]], r"two columns are swapped"),
        (lambda rows: -rows, r"d lies against the magnet; turn currents and fluxes by 180°"),
        (lambda rows: turned(rows, QUARTER.T), r"magnet lies along q .*ψd = −ψq′, id = −iq′, ψq = ψd′, iq = id′"),
        (lambda rows: turned(rows, QUARTER), r"magnet lies along q .*ψd = ψq′, id = iq′, ψq = −ψd′, iq = −id′"),
        (lambda rows: rows + np.array([0.0, 0.0, 0.0, 0.01]), r"magnet lies \d+\.\d° beside the d axis"),
        (lambda rows: rows - np.array([0.0, 0.0, MADE.flux(np.zeros(1), np.zeros(1))[0][0], 0.0]), r"without magnets"),
        (lambda rows: rows + np.array([61.0, 0.0, 0.0, 0.0]), r"id runs from 1 to 121 A; it must hold 0 A"),
        (lambda rows: rows[np.abs(rows[:, 0]) < 1.0], r"one value of id, 0 A"),
        (lambda rows: rows[np.abs(rows[:, 0]) < 11.0][13:], r"2 values of id; it takes at least 3"),
        (lambda rows: np.vstack([rows[:-1], [60.0, 60.0, np.nan, 0.0]]), r"psi_d_Vs of the flux map's point 169 is nan"),
    ],
)  # fmt: skip
def test_a_table_that_is_no_such_motor(change: object, sentence: str) -> None:
    with pytest.raises(ValueError, match=sentence):
        of(change(points()))  # type: ignore[operator]


def test_a_way_back_of_another_frame_is_the_right_one() -> None:
    # The sentence's own formulas, applied, give the map again.
    rows = turned(points(), QUARTER.T)
    again = np.array([-rows[:, 1], rows[:, 0], -rows[:, 3], rows[:, 2]]).T
    assert of(again) == of(points())


def test_a_wrong_value_is_found_where_it_is() -> None:
    rows = points()
    at = np.flatnonzero((rows[:, 0] == 20.0) & (rows[:, 1] == 30.0))[0]
    rows[at, 3] *= -1.0
    with pytest.raises(ValueError, match="not positive definite near id =") as refusal:
        of(rows)
    found = [
        float(word.split("= ")[1])
        for word in str(refusal.value).split("near ")[1].split(":")[0].replace(" A", "").split(", ")
    ]
    assert abs(found[0] - 20.0) <= 10.0
    assert abs(found[1] - 30.0) <= 10.0


# Files


def written(folder: Path, text: str) -> Path:
    file = folder / "map.csv"
    file.write_text(text, encoding="utf-8")
    return file


def as_text(rows: np.ndarray) -> str:
    return "".join(f"{','.join(map(repr, row))}\n" for row in rows.tolist())


def test_a_file_may_have_comments_and_more_columns(tmp_path: Path) -> None:
    more = "".join(f"{row[3]!r},{row[2]!r},0.001,{row[1]!r},{row[0]!r}\n" for row in points().tolist())
    file = written(tmp_path, "# of a test\npsi_q_Vs, psi_d_Vs, u_psi_d_Vs, iq_A, id_A\n" + more + "\n# the end\n")
    assert FluxTable.from_csv(file) == FluxTable.from_points(*points().T)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", r"map\.csv has no column id_A, iq_A, psi_d_Vs, psi_q_Vs"),
        (
            "id_A,iq_A,psi_d_Vs\n1,2,3\n",
            r"map\.csv has no column psi_q_Vs: its first line must name .* 'id_A,iq_A,psi_d_Vs'",
        ),
        ("id_A,iq_A,psi_d_Vs,psi_q_Vs,id_A\n", r"column id_A more than once"),
        ("id_A,iq_A,psi_d_Vs,psi_q_Vs\n", r"has a heading and no points"),
        ("id_A,iq_A,psi_d_Vs,psi_q_Vs\n1,2,3\n", r"line 2 of map\.csv has 3 values; its heading has 4"),
        ("id_A,iq_A,psi_d_Vs,psi_q_Vs\n1,2,three,4\n", r"psi_d_Vs in line 2 of map\.csv is 'three', no number"),
        ("id_A,iq_A,psi_d_Vs,psi_q_Vs\n1,2,inf,4\n", r"psi_d_Vs of the flux map's point 1 is inf"),
    ],
)
def test_a_file_that_is_none(tmp_path: Path, text: str, sentence: str) -> None:
    with pytest.raises(ValueError, match=sentence):
        FluxMap.from_csv(written(tmp_path, text))


def test_a_file_that_is_no_text(tmp_path: Path) -> None:
    file = tmp_path / "map.csv"
    file.write_bytes(b"id_A,iq_A\xff\xfe")
    with pytest.raises(ValueError, match=r"map\.csv is no text in UTF-8"):
        FluxMap.from_csv(file)


@given(st.text(alphabet="id_Aq,psVn.+-0123456789eE#\n \"'", max_size=400))
@settings(max_examples=25)
def test_no_text_is_a_traceback_of_another_kind(tmp_path_factory: pytest.TempPathFactory, text: str) -> None:
    file = written(tmp_path_factory.getbasetemp(), "id_A,iq_A,psi_d_Vs,psi_q_Vs\n" + text)
    with pytest.raises(ValueError, match=r"map"):
        FluxMap.from_csv(file)
