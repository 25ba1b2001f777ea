"""What readers call the parameters."""

from collections.abc import Mapping

from drivers.interfaces.text import Text, text

PARAMETER_NAMES: Mapping[str, Text] = {
    "pole_pairs": text("Pole pairs"),
    "stator_resistance": text("Stator resistance"),
    "d_axis_inductance": text("d-axis inductance"),
    "q_axis_inductance": text("q-axis inductance"),
    "flux_linkage": text("Flux linkage"),
    "back_emf_constant_mechanical": text("Back-EMF constant, mechanical"),
    "back_emf_constant_v_per_krpm": text("Back-EMF constant per 1000 rpm"),
    "back_emf_constant_v_per_rpm": text("Back-EMF constant per rpm"),
    "torque_constant": text("Torque constant"),
    "inertia": text("Inertia"),
    "line_emf_constant": text("EMF constant between conducting terminals"),
    "switch_resistance": text("Switch resistance"),
    "equivalent_resistance": text("Armature equivalent resistance"),
    "copper_resistance": text("Copper part of it"),
    "commutation_resistance": text("Commutation part of it (no loss)"),
    "coulomb_friction": text("Coulomb friction"),
    "viscous_friction": text("Viscous friction"),
    "electrical_frequency": text("Electrical frequency"),
    "maximum_current": text("Maximum current"),
    "rated_speed": text("Rated speed"),
    "resistance_unbalance": text("Unbalance of the line resistances"),
    "inductance_unbalance": text("Unbalance of the line inductances"),
    "phase_order": text("Order of the phases"),
    "back_emf_unbalance": text("Unbalance of the back-EMF"),
    "back_emf_angle_deviation": text("Deviation of the back-EMF's angles from 120°"),
    "back_emf_thd": text("Total harmonic distortion of the back-EMF"),
    "insulation_resistance": text("Insulation resistance"),
    "no_load_current": text("No-load current"),
    "no_load_bus_current": text("No-load current from the DC source"),
    "cogging_torque": text("Cogging torque, peak to peak"),
    "hall_faults": text("Faults of the Hall sensors' leads"),
    "hall_offset": text("Offset of the Hall sensors"),
    "hall_spacing_deviation": text("Deviation of the Hall sensors' spacing from 120°"),
    "hall_duty_deviation": text("Deviation of the Hall sensors' duty from one half"),
}


ROLE_NAMES: Mapping[str, Text] = {
    "supply": text("DC supply"),
    "lcr_meter": text("LCR meter"),
    "oscilloscope": text("Oscilloscope"),
    "dynamometer": text("Dynamometer"),
    "tachometer": text("Tachometer"),
    "inverter": text("Inverter"),
    "voltmeter": text("Voltmeter"),
    "drive": text("Six-step drive"),
    "insulation_tester": text("Insulation tester"),
    "switch_matrix": text("Switch matrix"),
    "rotor_actuator": text("Rotor actuator"),
}


def role_name(role: str) -> Text:
    """Return what readers call the instrument of a role; one without such a name keeps its own."""
    return ROLE_NAMES.get(role, Text("{role}", {"role": role}))


def section_name(section: str) -> Text:
    """Return a section as readers look it up: `§3.2` of the note, the paper, or a step of this bench's own, as `E9`."""
    if section == "paper":
        return text("paper")
    return Text("§{section}" if section[:1].isdigit() else "{section}", {"section": section})


def parameter_name(name: str) -> Text:
    """Return a parameter's name for readers; one without such a name keeps its own."""
    return PARAMETER_NAMES.get(name, Text("{name}", {"name": name}))


def unit_for_readers(name: str, unit: str) -> str:
    """Return the unit in which readers expect a parameter: flux linkage in webers, which are volt-seconds."""
    return "Wb" if name == "flux_linkage" else unit


def phrase(words: str) -> Text:
    """Return an estimator's or a convention's fixed words as a text that the catalogue may translate."""
    return Text(words.replace("{", "{{").replace("}", "}}"))
