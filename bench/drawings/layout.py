"""The connections as the actions done so far leave them."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from procedures.core.actions import (
    Action,
    ChangeSetup,
    Connect,
    ConnectProbes,
    ConnectVoltmeter,
    ConnectVoltmeterToSupply,
    CoupleDynamometer,
    CurrentProbe,
    DisconnectVoltmeter,
    LockRotor,
    MarkRestPositions,
    Node,
    ReleaseRotor,
    SeparateMeterLeads,
    ShortMeterLeads,
    Socket,
    StartTurning,
    StopTurning,
    Terminal,
    TurnToRest,
    UncoupleDynamometer,
    VoltageProbe,
)
from procedures.core.setup import BenchSetup


@dataclass(frozen=True)
class Layout:
    """The bench's connections; `terminals` is None before anything was connected."""

    terminals: Mapping[Terminal, Socket] | None = None
    probes: tuple[VoltageProbe | CurrentProbe, ...] = field(default_factory=tuple)
    voltmeter: tuple[Terminal, Terminal] | None = None
    voltmeter_on_supply: bool = False
    leads_shorted: bool = False
    rotor_locked: bool = False
    dynamometer_coupled: bool = False
    shaft_turned: bool = False

    def _of(self, setup: BenchSetup) -> "Layout":
        high, low = setup.voltmeter or (None, None)
        on_supply = high is Node.SUPPLY_POSITIVE
        metered = None if high is None or low is None or on_supply else (Terminal(high.value), Terminal(low.value))
        return replace(
            self,
            terminals=setup.terminals if setup.known else None,
            probes=setup.probes,
            voltmeter=metered,
            voltmeter_on_supply=on_supply,
            leads_shorted=setup.leads_shorted,
            rotor_locked=setup.rotor_locked is True,
            dynamometer_coupled=setup.coupled is True,
        )

    def after(self, action: Action) -> "Layout":
        """Return what an action makes of it; actions that connect nothing leave it as it is."""
        match action:
            case ChangeSetup(after=after):
                return self._of(after)
            case Connect():
                return replace(self, terminals=action.complete())
            case ConnectProbes(probes=probes):
                return replace(self, probes=probes)
            case ConnectVoltmeter(positive=positive, negative=negative):
                return replace(self, voltmeter=(positive, negative), voltmeter_on_supply=False)
            case ConnectVoltmeterToSupply() | DisconnectVoltmeter():
                return replace(self, voltmeter=None, voltmeter_on_supply=isinstance(action, ConnectVoltmeterToSupply))
            case ShortMeterLeads():
                return replace(self, terminals=self._without_meter(), leads_shorted=True)
            case SeparateMeterLeads():
                return replace(self, leads_shorted=False)
            case LockRotor() | ReleaseRotor():
                return replace(self, rotor_locked=isinstance(action, LockRotor))
            case CoupleDynamometer() | UncoupleDynamometer():
                return replace(self, dynamometer_coupled=isinstance(action, CoupleDynamometer))
            case StartTurning() | StopTurning():
                return replace(self, shaft_turned=isinstance(action, StartTurning))
            case _:
                return self

    def _without_meter(self) -> Mapping[Terminal, Socket] | None:
        meter = (Socket.METER_HIGH, Socket.METER_LOW)
        if self.terminals is None:
            return None
        return {t: Socket.OPEN if socket in meter else socket for t, socket in self.terminals.items()}


def turned_by_hand(action: Action | None) -> bool:
    """Tell whether an action has the shaft turned by hand while it is done."""
    return isinstance(action, TurnToRest | MarkRestPositions | StartTurning)
