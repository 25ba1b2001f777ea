"""PyVISA without NumPy, which it imports where it can and needs for arrays only: a guardian reads single figures."""

import sys


def load_visa() -> None:
    """Import PyVISA, and NumPy not with it; both stay as they are where they have been imported already."""
    if "pyvisa" in sys.modules or "numpy" in sys.modules:
        return
    # What stands for nothing is not found, and PyVISA goes without.
    sys.modules["numpy"] = None  # type: ignore[assignment]
    try:
        import pyvisa  # noqa: F401
    finally:
        del sys.modules["numpy"]


def give_arrays() -> None:
    """Enable PyVISA's arrays if a driver has imported NumPy since."""
    visa, arrays = sys.modules.get("pyvisa.util"), sys.modules.get("numpy")
    if visa is not None and arrays is not None:
        visa.np = arrays  # type: ignore[attr-defined]
