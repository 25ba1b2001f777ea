import math
from pathlib import Path

import pytest

from bench.i18n.errors import InputError
from bench.motor.motor_file import load_motor, recorded_motor
from bench.motor.shipped_motors import shipped_motors
from bench.motor.six_step_file import load_drive
from bench.virtual.true_values import true_values
from procedures.core.nameplate import WindingConnection
from procedures.core.parameters import PARAMETERS
from procedures.known_parameters import givers
from sim_instruments.physics.motor.bearing import Bearing
from sim_instruments.physics.motor.hall import SimulatedHallSensors
from sim_instruments.physics.motor.iron import Iron
from sim_instruments.physics.motor.magnets import Magnets
from tests.studies import flux_map_example

LG = (Path(__file__).parents[3] / "bench" / "motors" / "lg-400w.toml").read_text(encoding="utf-8")


def refusal(path: Path, old: str, new: str) -> str:
    assert old in LG
    path.write_text(LG.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(InputError) as error:
        load_motor(str(path))
    return str(error.value)


@pytest.mark.parametrize("name", ["lg-400w", "ipmsm", "ipmsm-map", "outrunner-delta", "gimbal", "drone"])
def test_shipped_motors_are_whole(name: str) -> None:
    motor = load_motor(name)
    assert name in shipped_motors()
    assert motor.virtual_motor().pole_pairs > 0
    assert motor.nameplate.current_bound >= motor.nameplate.rated_current
    # Friction may hold the rotor off alignment by little: at the supply's 10 A or the rated current, whichever is less.
    virtual = motor.virtual_motor()
    current = min(10.0, motor.nameplate.rated_current)
    assert math.degrees(math.asin(virtual.coulomb_friction / (virtual.torque_constant * current))) < 5.0


def test_the_lg_400w_is_the_one_of_the_note() -> None:
    motor = load_motor("lg-400w")
    virtual = motor.virtual_motor()
    assert virtual.phase_resistances == (0.0163, 0.0159, 0.0158)
    assert virtual.back_emf_constant_mechanical == pytest.approx(0.034)
    assert virtual.d_axis_inductance == 73e-6
    assert virtual.q_axis_inductance == 76.5e-6
    assert virtual.pole_pairs == 4
    assert motor.nameplate.wire_colours == {"A": "white", "B": "green", "C": "black"}


EXPECTED = "\n[expected]\nstator_resistance = 0.016\npole_pairs = 4\n"


def test_type_values_are_read_by_parameter_name(tmp_path: Path) -> None:
    path = tmp_path / "motor.toml"
    path.write_text(LG + EXPECTED, encoding="utf-8")
    assert load_motor(str(path)).nameplate.expected == {"stator_resistance": 0.016, "pole_pairs": 4.0}
    assert load_motor("lg-400w").nameplate.expected == {}


def test_every_parameter_that_a_procedure_gives_may_have_a_type_value(tmp_path: Path) -> None:
    path = tmp_path / "motor.toml"
    # As large as its bounds allow, and 1 where they do.
    values = {name: min(1.0, PARAMETERS[name].bounds.high or 1.0) for name in sorted(givers())}
    lines = [f"{name} = {value if value < 1.0 else 1}\n" for name, value in values.items()]
    path.write_text(LG + "\n[expected]\n" + "".join(lines), encoding="utf-8")
    assert load_motor(str(path)).nameplate.expected == values


@pytest.mark.parametrize(
    ("old", "new", "parts"),
    [
        ("stator_resistance", "stator_resistence", ["unknown key expected.stator_resistence", "did you mean stator_"]),
        ("0.016", "-0.016", ["expected.stator_resistance = -0.016", "above 0 ohm", "per phase of the Y-equivalent"]),
        ("0.016", '"16 mΩ"', ["expected.stator_resistance = '16 mΩ' is text", "give a number in ohm"]),
        ("pole_pairs = 4", "pole_pairs = 4.5", ["expected.pole_pairs = 4.5", "a whole number of at least 1"]),
    ],
)
def test_faults_of_type_values_are_named(tmp_path: Path, old: str, new: str, parts: list[str]) -> None:
    path = tmp_path / "motor.toml"
    path.write_text(LG + EXPECTED.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(InputError) as error:
        load_motor(str(path))
    for part in parts:
        assert part in str(error.value)


def test_delta_and_saliency_of_the_others() -> None:
    assert load_motor("outrunner-delta").nameplate.connection is WindingConnection.DELTA
    ipmsm = load_motor("ipmsm").virtual_motor()
    assert ipmsm.q_axis_inductance / ipmsm.d_axis_inductance == pytest.approx(2.0)
    assert (ipmsm.d_axis_saturation_current, ipmsm.q_axis_saturation_current) == (90.0, 60.0)
    assert load_motor("lg-400w").virtual_motor().winding_saturation is None
    assert min(load_motor("gimbal").virtual_motor().phase_resistances) >= 5.0


@pytest.mark.parametrize(
    ("old", "new", "parts"),
    [
        ("rated_current = 29.0", "rated_curent = 29.0", ["nameplate.rated_curent", "did you mean rated_current"]),
        ("rated_current = 29.0", "rated_current = 0", ["nameplate.rated_current = 0", "above 0", "10000 A"]),
        ("rated_current = 29.0", 'rated_current = "29 A"', ["nameplate.rated_current", "give a number in A"]),
        ("rated_current = 29.0", "rated_current = nan", ["nameplate.rated_current = nan"]),
        ("rated_current = 29.0", "rated_current = true", ["nameplate.rated_current = True"]),
        ("rated_current = 29.0", "", ["nameplate.rated_current is missing", "A"]),
        ("[0.0163, 0.0159, 0.0158]", '"16 mOhm"', ["virtual.phase_resistance", "16 mOhm", "give a number in ohm"]),
        ("[0.0163, 0.0159, 0.0158]", "-0.016", ["virtual.phase_resistance = -0.016", "above 0", "ohm"]),
        ("[0.0163, 0.0159, 0.0158]", "[0.016, 0.016, -0.016]", ["virtual.phase_resistance[2] = -0.016", "ohm"]),
        ("[0.0163, 0.0159, 0.0158]", "[0.016, 0.016]", ["virtual.phase_resistance", "list of three"]),
        ("73.0e-6", "73.0", ["virtual.d_axis_inductance = 73.0", "up to 10 H"]),
        ("73.0e-6", "1e-300", ["virtual.d_axis_inductance = 1e-300", "at least 1e-09", "H"]),
        ("inertia = 6.0e-5", "inertia = 1e-30", ["virtual.inertia = 1e-30", "at least 1e-10", "kg·m²"]),
        (
            "inertia =",
            "q_axis_saturation_current = 0.0\ninertia =",
            ["virtual.q_axis_saturation_current = 0.0", "at least 0.001", "100000 A"],
        ),
        ("inertia =", 'd_axis_saturation_current = "inf"\ninertia =', ["give a number in A", "at least 0.001"]),
        ("inertia =", "d_axis_saturation_current = inf\ninertia =", ["virtual.d_axis_saturation_current = inf"]),
        ("pole_pairs = 4", "pole_pairs = 4.5", ["virtual.pole_pairs = 4.5", "whole number"]),
        ('"wye"', '"star"', ["nameplate.connection = 'star'", "'wye' or 'delta'"]),
        ('A = "white"', 'D = "white"', ["nameplate.wire_colours.D", "A, B, C"]),
        ("order = 5", "order = 1", ["virtual.flux_harmonics[0].order = 1"]),
        ("[virtual]", "[virtuel]", ["unknown key virtuel", "did you mean virtual"]),
        ("maximum_current = 80.0", "maximum_current = 8.0", ["maximum_current = 8 A is below rated_current = 29 A"]),
        ("maximum_speed_rpm = 4000.0", "maximum_speed_rpm = 40.0", ["maximum_speed_rpm = 40 is below"]),
        ("[nameplate]", "[nameplate", ["not valid TOML", "line 3"]),
        ("29.0", "29,5", ["not valid TOML: line", "decimals are written with a point, as 29.5"]),
        ("29.0", "29 A", ["not valid TOML: line", "a number has no unit behind it: write 29"]),
        ("29.0", "\u221229.0", ["not valid TOML: line", "the sign '\u2212' (U+2212) cannot stand outside quotes"]),
        ("29.0", "２９", ["not valid TOML: line", "the sign '２' (U+FF12)"]),
        ('"LG-400W"', '"LG\\u001b[2J"', ["nameplate.name", "U+001B"]),
        ("[nameplate]", '[nameplate]\nserial_number = "a\\u0007"', ["nameplate.serial_number", "U+0007"]),
        ("[nameplate]", '[nameplate]\nserial_number = "a\\nb"', ["nameplate.serial_number", "U+000A"]),
        ("[nameplate]", f'[nameplate]\nserial_number = "{65 * "7"}"', ["has 65 characters; up to 64 are allowed"]),
        ("inertia =", "insulation_resistance = 0\ninertia =", ["virtual.insulation_resistance = 0", "above 0", "ohm"]),
        ("inertia =", "frame_capacitance = -1e-9\ninertia =", ["virtual.frame_capacitance = -1e-09", "F"]),
        ("inertia =", "emf_shares = [1.0, 1.0]\ninertia =", ["virtual.emf_shares", "list of three numbers"]),
        ("inertia =", "emf_shares = [1.0, 2.5, 1.0]\ninertia =", ["virtual.emf_shares[1] = 2.5", "0 to 2"]),
        ("inertia =", 'exchanged_terminals = ["B", "D"]\ninertia =', ["virtual.exchanged_terminals[1] = 'D'"]),
        ("inertia =", 'exchanged_terminals = ["B", "B"]\ninertia =', ["virtual", "two different terminals"]),
        ("inertia =", "bearing = { windage = -1 }\ninertia =", ["virtual.bearing.windage = -1", "N·m·s²/rad²"]),
        ("inertia =", "iron = { eddy_coupling = 1.0 }\ninertia =", ["virtual.iron.eddy_coupling = 1.0", "below 1"]),
        (
            "inertia =",
            "iron = { eddy_coupling = 0.3 }\nd_axis_saturation_current = 9.0\ninertia =",
            ["virtual", "eddy currents and saturation together are not simulated"],
        ),
        ("inertia =", "hall = { offset = 4 }\ninertia =", ["virtual.hall.offset = 4", "rad"]),
        ("inertia =", "hall = { order = [1, 1, 3] }\ninertia =", ["virtual.hall", "order", "[1, 1, 3]"]),
        ("inertia =", "hall = { inverted = [4] }\ninertia =", ["virtual.hall.inverted[0] = 4"]),
        ("inertia =", "hall = { stuck_low = [1], stuck_high = [1] }\ninertia =", ["virtual.hall", "stuck_low"]),
        ("inertia =", "hall = { ofset = 0.1 }\ninertia =", ["virtual.hall.ofset", "did you mean offset"]),
    ],
)
def test_each_fault_is_named(tmp_path: Path, old: str, new: str, parts: list[str]) -> None:
    path = tmp_path / "motor.toml"
    said = refusal(path, old, new)
    for part in [str(path), *parts]:
        assert part in said


def test_utf_16_without_its_mark_is_named(tmp_path: Path) -> None:
    path = tmp_path / "motor.toml"
    path.write_bytes('[nameplate]\nname = "m"\n'.encode("utf-16-le"))
    with pytest.raises(InputError, match="the text is UTF-16"):
        load_motor(str(path))


def test_a_scalar_resistance_stands_for_all_three(tmp_path: Path) -> None:
    path = tmp_path / "motor.toml"
    path.write_text(LG.replace("[0.0163, 0.0159, 0.0158]", "0.016"), encoding="utf-8")
    assert load_motor(str(path)).virtual_motor().phase_resistances == (0.016, 0.016, 0.016)


def test_the_file_of_a_six_step_drive_gives_plate_drive_and_the_drives_machine(tmp_path: Path) -> None:
    motor = load_motor("92bl-30-25l")
    assert motor.six_step == load_drive("92bl-30-25l")
    machine = motor.virtual_motor()
    assert machine.phase_resistances == (0.1146, 0.1146, 0.1146)
    assert machine.q_axis_inductance == pytest.approx(0.4353e-3)
    assert machine.zero_sequence_inductance == pytest.approx(0.3654e-3)
    assert machine.back_emf_constant_mechanical == pytest.approx(0.0613 / math.sqrt(3.0))
    assert motor.nameplate.pole_pairs == machine.pole_pairs
    truth = true_values(PARAMETERS, machine, motor.six_step)
    assert truth["line_emf_constant"] == pytest.approx(0.0613 * 3 / math.pi)
    assert truth["switch_resistance"] == 0.03
    assert "switch_resistance" not in true_values(PARAMETERS, machine)
    assert load_motor("lg-400w").six_step is None
    path = tmp_path / "bldc.toml"
    path.write_text(motor.content.replace("[virtual.drive]", "[virtual.driver]"), encoding="utf-8")
    with pytest.raises(InputError, match=r"\[virtual\.drive\] missing"):
        load_motor(str(path))


def test_an_unknown_name_gets_a_hint(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="did you mean lg-400w"):
        load_motor("lg-401w")
    with pytest.raises(InputError, match=r"missing\.toml: there is no such motor file"):
        load_motor(str(tmp_path / "missing.toml"))
    (tmp_path / "latin.toml").write_bytes(b'[nameplate]\nname = "\xe9"')
    with pytest.raises(InputError, match="not UTF-8"):
        load_motor(str(tmp_path / "latin.toml"))


def test_what_is_inside_a_virtual_motor_and_wrong_with_it(tmp_path: Path) -> None:
    path = tmp_path / "motor.toml"
    inside = """cogging_phase = 0.5
emf_shares = [1.0, 0.9, 1.0]
insulation_resistance = 5.0e7
frame_capacitance = 2.0e-9
exchanged_terminals = ["B", "C"]
hall = { offset = 0.1, placements = [0.0, 0.02, 0.0], order = [2, 1, 3], inverted = [3], stuck_low = [1], voltage = 3.3 }
inertia ="""
    path.write_text(LG.replace("inertia =", inside, 1), encoding="utf-8")
    motor = load_motor(str(path)).virtual_motor()
    assert (motor.cogging_phase, motor.emf_shares, motor.exchanged) == (0.5, (1.0, 0.9, 1.0), ("B", "C"))
    assert (motor.insulation_resistance, motor.frame_capacitance) == (5.0e7, 2.0e-9)
    assert motor.halls == SimulatedHallSensors(0.1, (0.0, 0.02, 0.0), (2, 1, 3), (3,), ((1, "low"),), 3.3)
    assert load_motor("lg-400w").virtual_motor().halls is None


def test_bearing_and_iron_of_a_virtual_motor(tmp_path: Path) -> None:
    path = tmp_path / "motor.toml"
    tables = """
[virtual.bearing]
windage = 2.0e-7
stribeck_torque = 0.01
stribeck_speed = 15.0
stribeck_exponent = 2.0
cogging_while_turning = true

[virtual.iron]
eddy_coupling = 0.3
eddy_resistance = 4.0
magnet_rise = 20.0
"""
    path.write_text(LG + tables, encoding="utf-8")
    motor = load_motor(str(path)).virtual_motor()
    assert motor.bearing == Bearing(2.0e-7, 0.01, 15.0, 2.0, cogging_while_turning=True)
    assert motor.iron == Iron(0.3, 4.0, magnet_rise=20.0)
    usual = load_motor("lg-400w").virtual_motor()
    assert (usual.bearing, usual.iron) == (Bearing(), Iron())


def test_a_drives_motor_has_its_sensors_and_may_have_others(tmp_path: Path) -> None:
    path = tmp_path / "drive.toml"
    text = (Path(__file__).parents[3] / "bench" / "motors" / "92bl-30-25l.toml").read_text(encoding="utf-8")
    assert load_motor("92bl-30-25l").virtual_motor().halls == SimulatedHallSensors()
    path.write_text(
        text.replace("[virtual.winding]", "[virtual.hall]\noffset = 0.2\n\n[virtual.winding]"), encoding="utf-8"
    )
    assert load_motor(str(path)).virtual_motor().halls == SimulatedHallSensors(0.2)


def test_a_tolerance_needs_a_type_value_and_is_a_share_of_it(tmp_path: Path) -> None:
    plate = '[nameplate]\nname = "m"\nconnection = "wye"\nrated_current = 1.0\n'
    path = tmp_path / "m.toml"
    path.write_text(f"{plate}[expected]\nstator_resistance = 0.5\n[tolerance]\nstator_resistance = 0.05\n")
    assert load_motor(str(path)).nameplate.tolerance == {"stator_resistance": 0.05}
    for table, said in (
        ("[tolerance]\ninertia = 0.05\n", "is a share of expected.inertia"),
        ("[expected]\ninertia = 1e-5\n[tolerance]\ninertia = 5.0\n", "tolerance.inertia = 5"),
    ):
        path.write_text(plate + table)
        with pytest.raises(InputError, match=said):
            load_motor(str(path))


# On a flux map

MAPPED = (Path(__file__).parents[3] / "bench" / "motors" / "ipmsm-map.toml").read_text(encoding="utf-8")
MAP = (Path(__file__).parents[3] / "bench" / "motors" / "ipmsm-map.csv").read_text(encoding="utf-8")


def mapped(folder: Path, old: str = "", new: str = "", table: str | None = MAP) -> Path:
    """Write the shipped motor on a map and its table, changed, into a folder; return the motor's file."""
    assert old in MAPPED
    path = folder / "motor.toml"
    path.write_text(MAPPED.replace(old, new, 1), encoding="utf-8")
    if table is not None:
        (folder / "ipmsm-map.csv").write_text(table, encoding="utf-8")
    return path


def test_a_motor_on_a_map_has_the_maps_constants(tmp_path: Path) -> None:
    motor = load_motor(str(mapped(tmp_path))).virtual_motor()
    assert motor == load_motor("ipmsm-map").virtual_motor()
    assert motor.flux_map is not None
    assert motor.flux_linkage_y == motor.flux_map.flux_linkage == pytest.approx(16.063e-3, rel=1e-3)
    step = 1e-3
    d_after, d_before = motor.flux_map.flux(step, 0.0)[0], motor.flux_map.flux(-step, 0.0)[0]
    q_after, q_before = motor.flux_map.flux(0.0, step)[1], motor.flux_map.flux(0.0, -step)[1]
    truth = true_values(PARAMETERS, motor)
    assert truth["flux_linkage"] == motor.flux_map.flux(0.0, 0.0)[0]
    assert truth["d_axis_inductance"] == pytest.approx((d_after - d_before) / (2.0 * step), rel=1e-6)
    assert truth["q_axis_inductance"] == pytest.approx((q_after - q_before) / (2.0 * step), rel=1e-6)
    assert truth["torque_constant"] == pytest.approx(1.5 * 4 * motor.flux_linkage_y)
    iron = 1.5 * 4 * 2.0 * motor.flux_linkage_y**2
    assert truth["coulomb_friction"] == pytest.approx(0.03 + iron)
    assert truth["viscous_friction"] == pytest.approx(5e-5 + 1.5 * 16 * 0.004 * motor.flux_linkage_y**2)


def test_the_shipped_map_is_made_by_its_command() -> None:
    assert flux_map_example.table() == MAP


def test_a_delta_on_a_map_has_its_y_equivalents(tmp_path: Path) -> None:
    wye = load_motor("ipmsm-map").virtual_motor()
    delta = load_motor(str(mapped(tmp_path, 'connection = "wye"', 'connection = "delta"'))).virtual_motor()
    assert delta.flux_linkage_y == pytest.approx(wye.flux_linkage_y)
    assert delta.d_axis_inductance_y == pytest.approx(wye.d_axis_inductance_y)
    assert delta.q_axis_inductance == pytest.approx(3.0 * wye.q_axis_inductance)


def test_the_map_holds_at_its_magnets_temperature(tmp_path: Path) -> None:
    path = mapped(tmp_path, "magnet_temperature = 25.0", "magnet_temperature = 75.0")
    warm, cold = load_motor(str(path)).virtual_motor(), load_motor("ipmsm-map").virtual_motor()
    assert warm.flux_linkage_at(75.0) == pytest.approx(cold.flux_linkage * 1.05 * 0.95)
    assert warm.flux_linkage == pytest.approx(cold.flux_linkage * 1.05)
    assert warm.d_axis_inductance != cold.d_axis_inductance


def test_magnets_of_their_own_temperature(tmp_path: Path) -> None:
    path = mapped(
        tmp_path, "[virtual.iron]", "[virtual.magnets]\ntime_constant = 900.0\nwinding_share = 0.7\n[virtual.iron]"
    )
    assert load_motor(str(path)).virtual_motor().magnets == Magnets(900.0, 0.7)
    assert load_motor("ipmsm-map").virtual_motor().magnets == Magnets()


@pytest.mark.parametrize(
    ("old", "new", "table", "parts"),
    [
        ("", "", None, ["virtual.flux_map.file = 'ipmsm-map.csv'", "there is no such file"]),
        ("", "", MAP.replace("psi_q_Vs", "psi_Q"), ["virtual.flux_map.file", "no column psi_q_Vs", "id_A,iq_A,psi_d_Vs"]),
        ("", "", MAP.replace("-75,-75,", "-75,-74,"), ["virtual.flux_map.file", "holes", "first at id = -75 A, iq = -75 A"]),
        ("", "", MAP.replace("id_A,iq_A", "iq_A,id_A"), ["virtual.flux_map.file", "two columns are swapped"]),
        ("pole_pairs = 4", "d_axis_inductance = 1e-4\npole_pairs = 4", MAP,
         ["virtual: d_axis_inductance follows from the table of flux_map", "leave flux_map out"]),
        ("pole_pairs = 4", "q_axis_saturation_current = 60.0\npole_pairs = 4", MAP, ["q_axis_saturation_current follows from"]),
        ('file = "ipmsm-map.csv"', "files = 3", MAP, ["unknown key virtual.flux_map.files; did you mean file?"]),
        ('file = "ipmsm-map.csv"          # beside this file\n', "", MAP, ["virtual.flux_map.file is missing"]),
        ("magnet_temperature = 25.0", "magnet_temperature = 500.0", MAP, ["virtual.flux_map.magnet_temperature = 500.0"]),
        ("eddy_loss = 0.004", "eddy_loss = -1.0", MAP, ["virtual.iron.eddy_loss = -1.0", "1/ohm"]),
        ("hysteresis_loss = 2.0", "hysteresis_loss = 2.0\neddy_coupling = 0.3", MAP, ["virtual", "leave one of them out"]),
        ("[virtual.iron]", "[virtual.magnets]\n[virtual.iron]", MAP, ["virtual.magnets.time_constant is missing"]),
    ],
)  # fmt: skip
def test_faults_of_a_map_are_named(tmp_path: Path, old: str, new: str, table: str | None, parts: list[str]) -> None:
    with pytest.raises(InputError) as error:
        load_motor(str(mapped(tmp_path, old, new, table)))
    for part in ["motor.toml", *parts]:
        assert part in str(error.value)


def test_a_recorded_motor_needs_no_table(tmp_path: Path) -> None:
    content = mapped(tmp_path, table=None).read_text(encoding="utf-8")
    read = recorded_motor(content, "gone/motor.toml")
    assert read.nameplate.name == "IPMSM 1 kW, flux map"
    assert read.virtual is None
