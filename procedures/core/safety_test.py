"""What a procedure proves of a motor's safety, in the order in which this is proved before anything else."""

from enum import IntEnum


class SafetyTest(IntEnum):
    """A safety test; the smaller one comes first, and each before the motor is fed, turned or commutated.

    Source: IEC 60204-1, 18.1: protective bonding, insulation resistance, voltage test, and functional tests after them.
    IEEE 43 has the insulation resistance tell, too, whether a winding may be tested with an overvoltage.
    """

    BONDING = 1
    INSULATION = 2
    VOLTAGE = 3
