"""What a run loads only once it needs it, loaded: processes forked from one that has imported this are spared it."""

import pkgutil
from importlib import import_module

import drivers
import procedures
import sim_instruments

_FURTHER = ("bench.virtual.fault_file", "h5py", "pydantic.dataclasses", "pymodbus.client", "rich.console", "serial")
_OURS = [
    module.name
    for package in (drivers, procedures, sim_instruments)
    for module in pkgutil.walk_packages(package.__path__, f"{package.__name__}.")
]
LOADED = [import_module(name) for name in (*_FURTHER, *_OURS)]
