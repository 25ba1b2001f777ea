"""From what a controller's file says back to λ, R, Ld, Lq, p in SI, by the controllers' own formulas."""

import math
from collections.abc import Callable

Values = dict[str, float]


def vesc(v: Values) -> Values:
    # motor/foc_math.c, foc_precalc_values: p_lq = l + diff/2, p_ld = l - diff/2.
    half = v["foc_motor_ld_lq_diff"] / 2.0
    return {
        "pole_pairs": v["si_motor_poles"] / 2.0,
        "stator_resistance": v["foc_motor_r"],
        "d_axis_inductance": v["foc_motor_l"] - half,
        "q_axis_inductance": v["foc_motor_l"] + half,
        "flux_linkage": v["foc_motor_flux_linkage"],
    }


def odrive(prefix: str) -> Callable[[Values], Values]:
    def back(v: Values) -> Values:
        pairs = v[f"{prefix}.pole_pairs"]
        # Torque per quadrature ampere is 3/2 p λ (docs: λ = 2/3 · k_t / p).
        return {
            "pole_pairs": pairs,
            "stator_resistance": v[f"{prefix}.phase_resistance"],
            "mean_inductance": v[f"{prefix}.phase_inductance"],
            "flux_linkage": 2.0 / 3.0 * v[f"{prefix}.torque_constant"] / pairs,
        }

    return back


def simplefoc(v: Values) -> Values:
    # BLDCMotor::estimateBEMF: U_q = vel / (KV·√3) / _RPM_TO_RADS, and U_q = p·λ·vel.
    flux = 1.0 / (v["KV"] * math.sqrt(3.0) * 0.10471975512) / v["pp"]
    return {
        "pole_pairs": v["pp"],
        "stator_resistance": v["R"],
        "d_axis_inductance": v["Ld"],
        "q_axis_inductance": v["Lq"],
        "flux_linkage": flux,
    }


def moteus(v: Values) -> Values:
    # UpdateDerivedMotorConstants: v_per_hz = 60/√3/Kv, lambda_m = v_per_hz/(π·poles).
    return {
        "pole_pairs": v["motor.poles"] / 2.0,
        "stator_resistance": v["motor.resistance_ohm"],
        "d_axis_inductance": v["motor.inductance_d_H"],
        "q_axis_inductance": v["motor.inductance_q_H"],
        "flux_linkage": 60.0 / math.sqrt(3.0) / v["motor.Kv"] / (math.pi * v["motor.poles"]),
    }


def ti(v: Values) -> Values:
    # user_params: motor_ratedFlux_Wb = RATED_FLUX_VpHz / MATH_TWO_PI.
    return {
        "pole_pairs": v["USER_MOTOR_NUM_POLE_PAIRS"],
        "stator_resistance": v["USER_MOTOR_Rs_Ohm"],
        "d_axis_inductance": v["USER_MOTOR_Ls_d_H"],
        "q_axis_inductance": v["USER_MOTOR_Ls_q_H"],
        "flux_linkage": v["USER_MOTOR_RATED_FLUX_VpHz"] / 6.283185307179586,
    }


def st(v: Values) -> Values:
    # MAX_BEMF_VOLTAGE of the SDK: phase, 0-to-peak = rpm · constant · √2 / (1000 · √3).
    peak_per_rpm = v["MOTOR_VOLTAGE_CONSTANT"] * math.sqrt(2.0) / (1000.0 * math.sqrt(3.0))
    pairs = v["POLE_PAIR_NUM"]
    return {
        "pole_pairs": pairs,
        "stator_resistance": v["RS"],
        "q_axis_inductance": v["LS"],
        "flux_linkage": peak_per_rpm / (pairs * 2.0 * math.pi / 60.0),
    }


def mathworks(v: Values) -> Values:
    # getPMSMParameters: FluxPM = Ke/(sqrt(3)*2*pi*1000*p/60), Kt = (3/2)*p*FluxPM.
    from_ke = v["Ke"] / (math.sqrt(3.0) * 2.0 * math.pi * 1000.0 * v["p"] / 60.0)
    assert math.isclose(from_ke, v["FluxPM"], rel_tol=1e-8)
    assert math.isclose(v["Kt"], 1.5 * v["p"] * v["FluxPM"], rel_tol=1e-8)
    return {
        "pole_pairs": v["p"],
        "stator_resistance": v["Rs"],
        "d_axis_inductance": v["Ld"],
        "q_axis_inductance": v["Lq"],
        "flux_linkage": from_ke,
        "inertia": v["J"],
        "viscous_friction": v["B"],
    }


def named(**names: str) -> Callable[[Values], Values]:
    return lambda v: {parameter: v[name] for parameter, name in names.items()}


DQ = {"d_axis_inductance": "L_d", "q_axis_inductance": "L_q"}
BACK: dict[str, Callable[[Values], Values]] = {
    "vesc": vesc,
    "odrive": odrive("motor.config"),
    "odrive-0.6": odrive("config.motor"),
    "simplefoc": simplefoc,
    "moteus": moteus,
    "ti": ti,
    "st": st,
    "mathworks": mathworks,
    "motulator": named(pole_pairs="n_p", stator_resistance="R_s", flux_linkage="psi_f", **DQ),
    "gym-electric-motor": named(
        pole_pairs="p",
        stator_resistance="r_s",
        d_axis_inductance="l_d",
        q_axis_inductance="l_q",
        flux_linkage="psi_p",
        inertia="j_rotor",
    ),
    "json": lambda v: v,
    "csv": lambda v: v,
    "mdf4": lambda v: v,
    "c-header": named(
        pole_pairs="MOTOR_POLE_PAIRS",
        stator_resistance="MOTOR_STATOR_RESISTANCE",
        d_axis_inductance="MOTOR_D_AXIS_INDUCTANCE",
        q_axis_inductance="MOTOR_Q_AXIS_INDUCTANCE",
        flux_linkage="MOTOR_FLUX_LINKAGE",
        inertia="MOTOR_INERTIA",
        coulomb_friction="MOTOR_COULOMB_FRICTION",
        viscous_friction="MOTOR_VISCOUS_FRICTION",
    ),
}
