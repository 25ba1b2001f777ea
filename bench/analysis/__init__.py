"""Analysis of stored captures: no instrument, the estimators that a run uses."""

from bench.analysis.back_emf import analyze_back_emf
from bench.analysis.coast_down import analyze_coast_down
from bench.analysis.cogging import analyze_cogging
from bench.analysis.four_wire import analyze_four_wire
from bench.analysis.rotor_sweep import analyze_rotor_sweep
from bench.analysis.six_step_loads import analyze_six_step_loads
from bench.analysis.six_step_typed import TypedEmf, TypedWinding
from bench.analysis.statements import Statement, read_statements
from bench.analysis.step_response import analyze_step_response
from bench.analysis.temperature import Temperature

__all__ = [
    "Statement",
    "Temperature",
    "TypedEmf",
    "TypedWinding",
    "analyze_back_emf",
    "analyze_coast_down",
    "analyze_cogging",
    "analyze_four_wire",
    "analyze_rotor_sweep",
    "analyze_six_step_loads",
    "analyze_step_response",
    "read_statements",
]
