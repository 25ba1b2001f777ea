"""Circuits and motion of a motor whose fluxes follow a law of both currents."""
