"""Catalogues of what can be added from outside: drivers, simulated instruments, procedures, exports, outputs for records."""
