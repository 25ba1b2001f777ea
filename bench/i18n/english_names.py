"""English names for the program's short names; other languages have these in their catalogues."""

from collections.abc import Mapping

#: By the name of a procedure its title.
PROCEDURES: Mapping[str, str] = {
    "nameplate": "Data sheet",
    "pole-pairs-static": "Pole pairs by stable positions",
    "stator-resistance": "Stator resistance",
    "stator-resistance-dc": "Stator resistance, four-wire direct current",
    "dq-inductance-extremes": "dq inductance, smallest and largest",
    "dq-inductance-aligned": "dq inductance, aligned bridge",
    "dq-inductance-time-constant": "dq inductance, time constant",
    "pole-pairs-inverter": "Pole pairs by inverter",
    "pole-pairs-back-emf": "Pole pairs by back-EMF",
    "back-emf-constant": "Back-EMF constant",
    "inertia": "Inertia and friction",
    "torque-constant": "Torque constant",
    "equivalent-resistance": "Armature equivalent resistance of a six-step drive",
    "flux-map": "Flux map at constant speed",
    "flux-map-standstill": "Flux map at standstill",
    "open-circuit": "Open circuit over speed",
    "short-circuit": "Short circuit over speed",
    "load-points": "Efficiency at load points",
    "winding-balance": "Balance of the windings",
    "phase-order": "Order of the phases",
    "back-emf-shape": "Shape of the back-EMF",
    "no-load-current": "No-load current",
    "no-load-current-six-step": "No-load current, six-step drive",
    "cogging-torque": "Cogging torque",
    "hall-sensors": "Hall sensors",
    "insulation-resistance": "Insulation resistance",
    "probe-verification": "Verification of the probes",
}
#: Causes and warnings whose name is no English word as it stands.
_CAUSES = """
    asymmetric-map axes-swapped cannot-support channels-differ consistency-pole-pairs consistency-winding currents-outward
    load-point map-holes map-turned no-baseline odd-reading other-d-axis power-balance probe-factor pulse-ends range-not-verified
    repeated-rows repeats-differ residual-variance resistance-left resistances-differ iron-loss friction-drift friction-left rms-for-peak
    second-time-constant sign-reversed speed-differs
    speed-filter speed-trend too-coarse torque-computed torque-differs torque-filter torque-zero-drift turned-180 turning-points
    type-tolerance uneven-speed warm-winding wrong-period
"""
NAMES: Mapping[str, str] = {**{name: name.replace("-", " ") for name in _CAUSES.split()}, **PROCEDURES}
