"""The shaft: driven, coasting, its torque and its speed."""
