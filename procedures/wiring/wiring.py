"""Connections made and proved, by what they are made to: what procedures call."""

from procedures.wiring.bridge_wiring import BridgeWiring
from procedures.wiring.proof import Proof
from procedures.wiring.supply_wiring import SupplyWiring


class Wiring:
    """The connections of one procedure. Each is made, verified and recorded; a wrong one is mended or refused."""

    def __init__(self, proof: Proof) -> None:
        #: To the supply.
        self.supply = SupplyWiring(proof)
        #: To the LCR meter.
        self.bridge = BridgeWiring(proof)
