"""Parts of a procedure: bench, steps, actions, settings, parameters, result."""
