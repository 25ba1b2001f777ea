"""The parameters: one row each, from which names, units, labels, conventions, type values and exports derive."""

from drivers.interfaces.text import text
from procedures.core.parameter_definition import (
    NOT_NEGATIVE,
    Bounds,
    FactorErrors,
    ParameterDefinition,
    ParameterTable,
)

_PER_PHASE = "per phase of the Y-equivalent"
_EMF = "peak phase voltage over mechanical speed, at 25 °C"
_UNBALANCE, _DEVIATION = Bounds(0.0, 200.0), Bounds(0.0, 180.0)
_LARGEST_LOAD = "at the largest load"
_BETWEEN_LINES = "between lines; the bridge's gain and zero are common to the three readings and cancel"

_SHOWN = "shown over true, in the verified range where it is known best"

# A current loop tuned on L and R keeps its phase margin within about 10 % of them; the flux linkage scales torque and speed;
# friction only feeds forward.
# fmt: off
PARAMETERS = ParameterTable(
    (
        ParameterDefinition("pole_pairs", "p", "1", text("Pole pairs"), "pole pairs, half the number of poles", bounds=Bounds(1, 200),
                            whole=True, true_value="motor.pole_pairs"),
        ParameterDefinition("stator_resistance", "R_s", "Ω", text("Stator resistance"), "per phase of the Y-equivalent, at 25 °C",
                            factor_errors=FactorErrors.IMPEDANCE, controller_uncertainty=0.10, true_value="motor.stator_resistance_y"),
        ParameterDefinition("d_axis_inductance", "L_d", "H", text("d-axis inductance"), _PER_PHASE, factor_errors=FactorErrors.IMPEDANCE,
                            controller_uncertainty=0.10, true_value="motor.d_axis_inductance_y"),
        ParameterDefinition("q_axis_inductance", "L_q", "H", text("q-axis inductance"), _PER_PHASE, factor_errors=FactorErrors.IMPEDANCE,
                            controller_uncertainty=0.10, true_value="motor.q_axis_inductance_y"),
        ParameterDefinition("flux_linkage", "λ", "V·s/rad", text("Flux linkage"),
                            "peak, per phase of the Y-equivalent, per electrical radian, at 25 °C", reader_unit="Wb",
                            factor_errors=FactorErrors.FLUX, controller_uncertainty=0.05, true_value="motor.flux_linkage_y"),
        ParameterDefinition("back_emf_constant_mechanical", "K_e", "V·s/rad", text("Back-EMF constant, mechanical"), _EMF,
                            factor_errors=FactorErrors.FLUX, true_value="motor.back_emf_constant_mechanical", restates="flux_linkage"),
        ParameterDefinition("back_emf_constant_v_per_krpm", "K_e", "V/krpm", text("Back-EMF constant per 1000 rpm"), _EMF,
                            true_value="back_emf_constant_v_per_krpm", restates="flux_linkage"),
        ParameterDefinition("back_emf_constant_v_per_rpm", "K_e", "V/rpm", text("Back-EMF constant per rpm"), _EMF,
                            true_value="back_emf_constant_v_per_rpm", restates="flux_linkage"),
        ParameterDefinition("torque_constant", "K_t", "N·m/A", text("Torque constant"),
                            "per peak phase ampere, amplitude-invariant, at 25 °C", factor_errors=FactorErrors.TORQUE,
                            true_value="motor.torque_constant"),
        ParameterDefinition("inertia", "J", "kg·m²", text("Inertia"), "motor alone", controller_uncertainty=0.10,
                            true_value="motor.inertia"),
        ParameterDefinition("inertia_with_load", "J_Σ", "kg·m²", text("Inertia of rotor and load together"),
                            "at the motor's shaft; the load is the one stated, else the dynamometer's machine"),
        ParameterDefinition("coulomb_friction", "T_C", "N·m", text("Coulomb friction"), "motor alone, at the measured temperature",
                            controller_uncertainty=0.50, true_value="motor.coulomb_friction"),
        ParameterDefinition("viscous_friction", "B", "N·m·s/rad", text("Viscous friction"), "motor alone, at the measured temperature",
                            controller_uncertainty=0.50, true_value="motor.viscous_friction"),
        ParameterDefinition("maximum_current", "I_max", "A", text("Maximum current"), "phase, peak"),
        ParameterDefinition("rated_speed", "n_N", "rpm", text("Rated speed"), "mechanical"),
        ParameterDefinition("line_emf_constant", "k_e", "V·s/rad", text("EMF constant between conducting terminals"),
                            "mean EMF between the conducting terminals over mechanical speed, at 25 °C", true_value="line_emf_constant"),
        ParameterDefinition("switch_resistance", "R_t", "Ω", text("Switch resistance"), "one switch, R_t",
                            true_value="drive.switch_resistance"),
        ParameterDefinition("equivalent_resistance", "R_eq", "Ω", text("Armature equivalent resistance"), _LARGEST_LOAD),
        ParameterDefinition("commutation_resistance", "R_c", "Ω", text("Commutation part of it (no loss)"),
                            "at the largest load; exchanged energy, no loss"),
        ParameterDefinition("commutation_resistance_slope", "", "Ω·s/rad", text("Slope of the commutation part over speed"),
                            "straight line over mechanical speed", bounds=Bounds(-1e3, 1e3)),
        ParameterDefinition("commutation_resistance_offset", "", "Ω", text("Commutation part carried on to standstill"),
                            "straight line over mechanical speed; extrapolated", bounds=Bounds(-1e3, 1e3)),
        ParameterDefinition("copper_resistance", "R_Cu", "Ω", text("Copper part of it"), _LARGEST_LOAD),
        ParameterDefinition("resistance_unbalance", "", "%", text("Unbalance of the line resistances"), _BETWEEN_LINES,
                            bounds=_UNBALANCE, true_value="resistance_unbalance"),
        ParameterDefinition("inductance_unbalance", "", "%", text("Unbalance of the line inductances"), _BETWEEN_LINES,
                            bounds=_UNBALANCE),
        ParameterDefinition("phase_order", "", "1", text("Order of the phases"),
                            "+1 for A, B, C with the dynamometer turning forwards, −1 for A, C, B", bounds=Bounds(-1.0, 1.0),
                            true_value="phase_order"),
        ParameterDefinition("back_emf_unbalance", "", "%", text("Unbalance of the back-EMF"), "phases against an artificial star point",
                            bounds=_UNBALANCE, true_value="back_emf_unbalance"),
        ParameterDefinition("back_emf_angle_deviation", "", "°", text("Deviation of the back-EMF's angles from 120°"),
                            "electrical degrees", bounds=_DEVIATION, true_value="back_emf_angle_deviation"),
        ParameterDefinition("back_emf_thd", "THD", "%", text("Total harmonic distortion of the back-EMF"),
                            "largest of three phases against an artificial star point: without the orders divisible by three",
                            bounds=Bounds(0.0, 1000.0), true_value="back_emf_thd"),
        ParameterDefinition("insulation_resistance", "R_iso", "Ω", text("Insulation resistance"),
                            "winding to frame, terminals joined, at the winding's temperature", true_value="motor.insulation_resistance"),
        ParameterDefinition("no_load_current", "I_0", "A", text("No-load current"),
                            "phase, peak, torque-producing, at the speed of the test", bounds=NOT_NEGATIVE),
        ParameterDefinition("no_load_bus_current", "I_0", "A", text("No-load current from the DC source"),
                            "from the DC source, at full voltage", bounds=NOT_NEGATIVE),
        ParameterDefinition("cogging_torque", "T_cog", "N·m", text("Cogging torque, peak to peak"),
                            "peak to peak over a turn, terminals open", bounds=NOT_NEGATIVE),
        ParameterDefinition("hall_faults", "", "1", text("Faults of the Hall sensors' leads"),
                            "number of leads; 0 where order and polarity are as told", bounds=Bounds(0.0, 3.0)),
        ParameterDefinition("hall_offset", "", "°", text("Offset of the Hall sensors"),
                            "electrical degrees, positive where the sensors switch late", bounds=Bounds(-180.0, 180.0)),
        ParameterDefinition("hall_spacing_deviation", "", "°", text("Deviation of the Hall sensors' spacing from 120°"),
                            "electrical degrees", bounds=_DEVIATION),
        ParameterDefinition("hall_duty_deviation", "", "%", text("Deviation of the Hall sensors' duty from one half"),
                            "per cent of an electrical turn", bounds=Bounds(0.0, 50.0)),
        # Of the bench, not of the motor.
        ParameterDefinition("channel_1_gain", "", "1", text("Gain of channel 1 with its probe"), _SHOWN),
        ParameterDefinition("channel_2_gain", "", "1", text("Gain of channel 2 with its probe"), _SHOWN),
        ParameterDefinition("channel_3_gain", "", "1", text("Gain of channel 3 with its probe"), _SHOWN),
        ParameterDefinition("channel_4_gain", "", "1", text("Gain of channel 4 with its probe"), _SHOWN),
        # What only the analysis of a stored capture gives.
        ParameterDefinition("electrical_frequency", "f", "Hz", text("Electrical frequency"), type_value=False),
        ParameterDefinition("loop_resistance", "R", "Ω", text("Loop resistance"), type_value=False),
        ParameterDefinition("loop_inductance", "L", "H", text("Loop inductance"), type_value=False),
        ParameterDefinition("inductance", "L", "H", text("Inductance as the rotor stood"), _PER_PHASE, type_value=False),
        ParameterDefinition("coulomb_deceleration", "", "rad/s²", text("Coulomb friction over inertia"), type_value=False),
        ParameterDefinition("viscous_rate", "", "1/s", text("Viscous friction over inertia"), type_value=False),
    )
)
# fmt: on
