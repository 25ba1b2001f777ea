"""Connections made and verified, by what they are made to: what procedures call."""

from procedures.verification.bridge_wiring import BridgeWiring
from procedures.verification.inverter_wiring import InverterWiring
from procedures.verification.shaft_wiring import ShaftWiring
from procedures.verification.shorted_wiring import ShortedWiring
from procedures.verification.supply_wiring import SupplyWiring
from procedures.verification.verifier import ConnectionVerifier


class Wiring:
    """The connections of one procedure. Each is made, verified and recorded; a wrong one is mended or refused."""

    def __init__(self, verifier: ConnectionVerifier) -> None:
        #: To the supply.
        self.supply = SupplyWiring(verifier)
        #: To the LCR meter.
        self.bridge = BridgeWiring(verifier)
        #: To nothing but probes, while the shaft is turned from outside.
        self.shaft = ShaftWiring(verifier)
        #: To each other, while the shaft is turned from outside.
        self.short = ShortedWiring(verifier)
        #: To the inverter or the six-step drive.
        self.inverter = InverterWiring(verifier)
