"""Exports of flux maps in the software that they are for: torque and voltage are those of the map's law."""

import csv
import io
import re
import shutil
import subprocess
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bench.plugins.catalogues import installed
from drivers.interfaces.text import text
from procedures.core.result import Withheld
from reports.exports.checks import ExportRefusedError, UncertaintyBounds
from reports.exports.exported_map import exported_map
from reports.exports.subject import Subject
from reports.exports.target import sheet_for
from tests.reports.exports.map_subject import MAPS, PAIRS, REACH, findings, law
from tests.reports.exports.readers import moteus, vesc
from tests.reports.exports.test_in_simulators import executed

Make = Callable[..., Subject]
POINTS = [(-7.3, 15.1), (0.0, 20.0), (-12.0, -14.2), (6.1, 3.3), (-20.0, 1.0)]


@pytest.fixture
def subject(make_subject: Make) -> Subject:
    return make_subject(flux_map=exported_map("flux-map", findings()))


def written(name: str, subject: Subject) -> str:
    target = installed().exports[name]
    return target.write(sheet_for(target, subject))


def matlab_tables(content: str) -> dict[str, np.ndarray]:
    bare = "\n".join(line.partition("%")[0] for line in content.splitlines())
    found = {}
    for name, body in re.findall(r"pmsm\.(\w+) = (\[[^\]]*\]|[^;\[]+);", bare):
        rows = [row.split() for row in body.strip("[] \n").split(";") if row.strip()]
        found[name] = np.squeeze(np.array(rows, dtype=float))
    return found


@pytest.mark.parametrize(("i_d", "i_q"), POINTS)
def test_motulator_gives_torque_and_voltage_of_the_map(i_d: float, i_q: float, subject: Subject) -> None:
    from motulator.drive import model

    module = executed("motulator-map", subject)
    machine = model.SynchronousMachine(module.par, i_s=module.i_s, psi_s0=module.psi_s0)
    assert machine.state.psi_s == pytest.approx(0.016, rel=1e-6)
    psi_d, psi_q = law(i_d, i_q)
    machine.state.psi_s = complex(psi_d, psi_q)
    assert machine.i_s == pytest.approx(complex(i_d, i_q), abs=1e-3)
    assert machine.tau_M == pytest.approx(1.5 * PAIRS * (psi_d * i_q - psi_q * i_d), abs=1e-4)
    # Steady state: the voltage R·i + jω·ψ leaves the flux linkage as it is.
    speed = 90.0
    voltage = 0.045 * complex(i_d, i_q) + 1j * PAIRS * speed * complex(psi_d, psi_q)
    machine.inp.u_ss, machine.inp.w_M = voltage, speed
    machine.set_outputs(0.0)
    assert abs(machine.rhs()[0]) < 1e-4


def test_motulator_simulates_a_step_of_voltage_on_the_map(subject: Subject) -> None:
    from scipy.integrate import solve_ivp

    module = executed("motulator-map", subject)
    out = solve_ivp(
        lambda _, psi: (lambda u: [u.real, u.imag])(0.4 * 1j - 0.045 * module.i_s(complex(*psi))),
        (0.0, 0.02),
        [module.psi_s0, 0.0],
        rtol=1e-6,
    )
    settled = module.i_s(complex(*out.y[:, -1]))
    # It tends to u/R: 8.9 A, of which 1 − exp(−t·R/L) is reached.
    assert settled.imag == pytest.approx(0.4 / 0.045 * (1.0 - np.exp(-0.02 * 0.045 / 3.9e-4)), rel=0.02)
    with pytest.raises(ValueError, match="beyond the flux map"):
        module.i_s(1.0 + 0.0j)


def test_mathworks_tables_both_ways(subject: Subject) -> None:
    read = matlab_tables(written("mathworks-lut", subject))
    d, q = np.meshgrid(read["idVec"], read["iqVec"], indexing="ij")
    for name, wanted in zip(("FluxD", "FluxQ"), law(d, q), strict=True):
        assert np.allclose(read[name], wanted, rtol=1e-8, atol=1e-12)
    assert (float(read["p"]), float(read["Rs"])) == (4.0, 0.045)
    back = law(read["id"], read["iq"])
    flux_d, flux_q = np.meshgrid(read["flux_d"], read["flux_q"], indexing="ij")
    assert np.max(np.abs(back[0] - flux_d)) < 2e-7
    assert np.max(np.abs(back[1] - flux_q)) < 2e-7
    assert np.all(np.diff(read["flux_d"]) > 0.0)


@pytest.mark.skipif(shutil.which("cc") is None, reason="the machine has no C compiler")
def test_c_tables_compiled(subject: Subject, tmp_path: Path) -> None:
    places = [*POINTS, (-25.0, 25.0), (-40.0, 0.0)]
    rows = c_rows(subject, places, tmp_path)
    psi_d, psi_q = law(*np.clip(np.array(places), -REACH, REACH).T)
    error = rows[0, 6]
    assert 0.0 < error < 1e-4
    assert np.max(np.abs(rows[:-2, 1] - psi_d[:-2])) < error + 1e-8
    assert np.max(np.abs(rows[:-2, 2] - psi_q[:-2])) < error + 1e-8
    # One step of 15 bits each of current and flux linkage.
    assert np.max(np.abs(rows[:, 4:6] - rows[:, 1:3])) < 2.5e-6
    assert rows[:, 0].tolist() == [1, 1, 1, 1, 1, 0, 0]


def c_rows(subject: Subject, places: list[tuple[float, float]], tmp_path: Path) -> np.ndarray:
    """Return what the compiled C tables give at currents (A): inside, both flux linkages, the same in fixed point, the stated error."""
    (tmp_path / "flux_map.h").write_text(written("c-tables", subject), encoding="ascii")
    calls = "\n".join(f"show({d:.6f}f, {q:.6f}f);" for d, q in places)
    (tmp_path / "main.c").write_text(
        '#include <stdio.h>\n#include "flux_map.h"\n'
        "static void show(float d, float q) { float x, y; int16_t a, b; int in = flux_map_psi(d, q, &x, &y);\n"
        "  float s = 32767.0f / FLUX_MAP_Q15_CURRENT;\n"
        "  float e = d < FLUX_MAP_ID_MIN ? FLUX_MAP_ID_MIN : d;\n"
        "  int16_t f = (int16_t)(e * s), g = (int16_t)(q * s);\n"
        "  int fixed = flux_map_psi_q15(f, g, &a, &b);\n"
        '  printf("%d %.9g %.9g %d %.9g %.9g %.9g\\n", in, x, y, fixed, a * FLUX_MAP_Q15_FLUX / 32767, '
        "b * FLUX_MAP_Q15_FLUX / 32767, FLUX_MAP_BILINEAR_ERROR); }\n"
        f"int main(void) {{ {calls} return 0; }}\n",
        encoding="ascii",
    )
    flags = ["-std=c99", "-Wall", "-Wextra", "-Werror"]
    subprocess.run(["cc", *flags, "main.c", "-o", "main"], cwd=tmp_path, check=True, capture_output=True)
    shown = subprocess.run([str(tmp_path / "main")], check=True, capture_output=True, text=True).stdout
    return np.array([[float(word) for word in line.split()] for line in shown.splitlines()])


#: Maps of half the plane: without positive or negative d-axis current; and places in either.
HALVES = {
    "weakening": ((-REACH, 0.0), [(-7.3, 15.1), (-0.01, 20.0), (0.0, -14.2), (-20.0, 1.0)]),
    "strengthening": ((0.0, REACH), [(7.3, 15.1), (0.01, 20.0), (0.0, -14.2), (20.0, 1.0)]),
}


@pytest.mark.parametrize("name", HALVES)
def test_a_map_of_half_the_plane(name: str, make_subject: Make, tmp_path: Path) -> None:
    (low, high), places = HALVES[name]
    subject = make_subject(flux_map=exported_map("flux-map", findings(low=low, high=high)))
    for target in MAPS:
        assert not re.search(r"(?<![\w.])(nan|inf)(?![\w(])", written(target, subject), re.IGNORECASE)
    if shutil.which("cc") is not None:
        outside = (-places[0][0], 5.0)
        rows = c_rows(subject, [*places, outside], tmp_path)
        psi_d, psi_q = law(*np.array(places).T)
        error = rows[0, 6] + 1e-8
        assert np.max(np.abs(rows[:-1, 1] - psi_d)) < error
        assert np.max(np.abs(rows[:-1, 2] - psi_q)) < error
        assert np.max(np.abs(rows[:-1, 4:6] - rows[:-1, 1:3])) < 2.5e-6
        assert rows[:, 0].tolist() == [1, 1, 1, 1, 0]
    read = matlab_tables(written("mathworks-lut", subject))
    d, q = np.meshgrid(read["idVec"], read["iqVec"], indexing="ij")
    for table, wanted in zip(("FluxD", "FluxQ"), law(d, q), strict=True):
        assert np.allclose(read[table], wanted, rtol=1e-8, atol=1e-12)
    back = law(read["id"], read["iq"])
    flux_d, flux_q = np.meshgrid(read["flux_d"], read["flux_q"], indexing="ij")
    assert np.max(np.abs(back[0] - flux_d)) < 2e-7
    assert np.max(np.abs(back[1] - flux_q)) < 2e-7
    module = executed("motulator-map", subject)
    # Its table over flux linkages ends where currents on the edge lie.
    for i_d, i_q in (place for place in places if low < place[0] < high and abs(place[0]) > 1.0):
        assert module.i_s(complex(*law(i_d, i_q))) == pytest.approx(complex(i_d, i_q), abs=1e-3)


@pytest.mark.parametrize("name", HALVES)
def test_controllers_take_a_map_of_half_the_plane(name: str, make_subject: Make, subject: Subject) -> None:
    (low, high), _ = HALVES[name]
    made = findings(low=low, high=high)
    if low == 0.0:
        del made["d_axis_saturation"]
    half = make_subject(flux_map=exported_map("flux-map", made))
    assert vesc(written("vesc", half))["foc_sat_comp"] == pytest.approx(vesc(written("vesc", subject))["foc_sat_comp"])
    sheet = sheet_for(installed().exports["moteus"], half)
    scales = [line for line in sheet.lines if line.name == "motor.inductance_d_scale"]
    assert len(scales) == (low < 0.0)
    assert (low == 0.0) == any("no points on the negative d axis" in str(reason) for reason in sheet.left_out)
    assert written("gym-electric-motor", half) == written("gym-electric-motor", subject)


def test_vesc_of_one_side_of_the_q_axis_rests_on_what_was_measured(make_subject: Make, subject: Subject) -> None:
    made = findings()
    grid = made["grid"]
    beyond = np.array(grid["i_q"]) < 0.0
    grid["measured"] = (np.array(grid["measured"]) & ~beyond).tolist()
    # Carried on beyond the points, a surface may go anywhere.
    grid["psi_q"] = np.where(beyond, 5.0, np.array(grid["psi_q"])).tolist()
    factor = vesc(written("vesc", make_subject(flux_map=exported_map("flux-map", made))))["foc_sat_comp"]
    assert factor == pytest.approx(vesc(written("vesc", subject))["foc_sat_comp"], abs=0.01)


def test_csv_has_both_sides_with_their_uncertainty(subject: Subject) -> None:
    rows = list(csv.DictReader(io.StringIO(written("flux-map-csv", subject), newline="")))
    places = {(round(float(r["id_A"]), 6), round(float(r["iq_A"]), 6)) for r in rows}
    assert len(places) == len(rows)
    assert all((d, round(-q, 6) + 0.0) in places for d, q in places)
    for row in rows:
        psi_d, psi_q = law(float(row["id_A"]), float(row["iq_A"]))
        assert (float(row["psi_d_Vs"]), float(row["psi_q_Vs"])) == pytest.approx((psi_d, psi_q), abs=1e-12)
        assert float(row["u_psi_q_Vs"]) == pytest.approx(2e-5)


def test_moteus_gets_the_slope_of_its_chord(subject: Subject) -> None:
    read = moteus(written("moteus", subject))
    # The firmware: L_d + scale·min(i_d, 0), and λ + L·i_d is the flux linkage. This motor's L_d rises towards −d.
    inductance = 2.5e-4 + read["motor.inductance_d_scale"] * -20.0
    assert 0.016 + inductance * -20.0 == pytest.approx(float(law(-20.0, 0.0)[0]), rel=1e-6)


def test_vescs_observer_finds_the_magnets_at_every_current(subject: Subject) -> None:
    content = written("vesc", subject)
    read = vesc(content)
    assert read["foc_sat_comp_mode"] == 1
    # As the firmware has it, foc_observer_update: the share is of l_current_max, the difference of Ld and Lq stays.
    limit = float(re.search(r"l_current_max = ([\d.]+) A", content)[1])
    assert limit == REACH
    mean, difference = 3.25e-4, 1.5e-4
    i_q = np.linspace(1.0, REACH, 25)
    psi_d, psi_q = law(0.0, i_q)

    def angle(factor: float) -> float:
        inductance = mean * (1.0 - factor * i_q / limit) + difference / 2.0
        return float(np.degrees(np.max(np.abs(np.arctan2(psi_q - inductance * i_q, psi_d)))))

    without, compensated = angle(0.0), angle(read["foc_sat_comp"])
    assert compensated < 0.4 * without
    assert compensated < angle(1.3 * read["foc_sat_comp"])
    assert f"{without:.1f}" in content


def test_a_motor_that_does_not_saturate_gets_no_factor(make_subject: Make) -> None:
    made = findings()
    q = np.array(made["grid"]["i_q"])
    made["grid"]["psi_q"] = (4e-4 * q * (1.0 + (q / 60.0) ** 2) + np.zeros((q.size, 1))).tolist()
    sheet = sheet_for(installed().exports["vesc"], make_subject(flux_map=exported_map("flux-map", made)))
    assert {"allowed is 0 to 1" in str(reason) for reason in sheet.left_out} == {True}
    assert all("sat_comp" not in line.name for line in sheet.lines)


def test_without_a_map_moteus_has_no_scale_and_says_nothing(make_subject: Make) -> None:
    sheet = sheet_for(installed().exports["moteus"], make_subject())
    assert sheet.left_out == ()
    assert all(line.name != "motor.inductance_d_scale" for line in sheet.lines)


def reasons(name: str, subject: Subject, bounds: UncertaintyBounds | None = None) -> str:
    with pytest.raises(ExportRefusedError) as refused:
        sheet_for(installed().exports[name], subject, bounds)
    return "; ".join(str(reason) for reason in refused.value.reasons)


@pytest.mark.parametrize("name", MAPS)
def test_refusals(name: str, make_subject: Make, subject: Subject) -> None:
    assert "a flux map is needed and the run has none; run flux-map" in reasons(name, make_subject())
    cause = Withheld("map_flux_linkage", "flux-map", "M1", "contradiction", text("currents and torque contradict"))
    told = make_subject(withheld={"map_flux_linkage": (cause,)})
    assert "currents and torque contradict" in reasons(name, told)
    wide = replace(subject, flux_map=exported_map("flux-map", findings(uncertainty=2e-3)))
    assert "of its full scale only" in reasons(name, wide)
    assert sheet_for(installed().exports[name], wide, UncertaintyBounds(0.5))
    unsure = replace(subject, pole_pairs_doubt=text("4 or 5"))
    assert "4 or 5" in reasons(name, unsure)


@pytest.mark.parametrize("name", MAPS[:3])
def test_what_was_not_measured_is_marked(name: str, subject: Subject) -> None:
    content = written(name, subject)
    assert "beyond what was measured (measured = 0)" in content
    assert "measured" in content.replace("beyond what was measured (measured = 0)", "")
