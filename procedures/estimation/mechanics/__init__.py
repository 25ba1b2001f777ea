"""Inertia, friction, torque and pole pairs."""
