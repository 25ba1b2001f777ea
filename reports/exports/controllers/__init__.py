"""Parameters for motor controllers."""
