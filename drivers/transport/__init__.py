"""Ways to an instrument: VISA, Modbus, CAN, serial lines, and this very process."""
