"""The virtual bench as a run uses it, in this process or served by another one."""
