"""CAN buses and nodes, in process or over a wire."""
