"""A run's parameters in the names, units and conventions of motor controllers and simulators."""
