"""Calls of canopen's own CiA 402 master on the drives of the bench: state machine, modes, targets, PDOs with SYNC, guarding."""

import logging
import threading

import canopen
from calls import TASK, Calls, hands
from canopen import objectdictionary as od
from canopen.profiles.p402 import BaseNode402

_KINDS = {"u8": od.UNSIGNED8, "i8": od.INTEGER8, "u16": od.UNSIGNED16, "i16": od.INTEGER16, "u32": od.UNSIGNED32}
_KINDS |= {"i32": od.INTEGER32, "text": od.VISIBLE_STRING}
_SINGLE = {
    0x1000: "u32",
    0x1001: "u8",
    0x1005: "u32",
    0x1008: "text",
    0x100C: "u16",
    0x100D: "u8",
    0x1014: "u32",
    0x1017: "u16",
    0x603F: "u16",
    0x6040: "u16",
    0x6041: "u16",
    0x605A: "i16",
    0x6060: "i8",
    0x6061: "i8",
    0x606C: "i32",
    0x6071: "i16",
    0x6072: "u16",
    0x6073: "u16",
    0x6075: "u32",
    0x6076: "u32",
    0x6077: "i16",
    0x6078: "i16",
    0x6079: "u32",
    0x607E: "u8",
    0x607F: "u32",
    0x6083: "u32",
    0x6084: "u32",
    0x60A9: "u32",
    0x60FF: "i32",
    0x6502: "u32",
}
_RECORDS = {0x1018: "u32", 0x1800: "u32", 0x1801: "u32", 0x1A00: "u32", 0x1A01: "u32"}
#: What a master with PDOs to the drive would have: these drives have none.
_TO_DRIVE = {0x1400: "u32", 0x1600: "u32"}
_SOCKETS = {
    "inverter": ("inverter_u", "inverter_v", "inverter_w"),
    "drive": ("drive_1", "drive_2", "drive_3"),
    "rotor_actuator": (),
}
_MODES = {"inverter": "PROFILED VELOCITY", "rotor_actuator": "PROFILED VELOCITY"}


def _variable(index: int, subindex: int, kind: str) -> od.ODVariable:
    made = od.ODVariable(f"{index:04X} {subindex}", index, subindex)
    made.data_type, made.access_type = _KINDS[kind], "rw"
    return made


def dictionary(records: dict[int, str]) -> od.ObjectDictionary:
    """Return the profile's objects, as an EDS would list them."""
    made = od.ObjectDictionary()
    for index, kind in _SINGLE.items():
        made.add_object(_variable(index, 0, kind))
    for index, kind in records.items():
        record = od.ODRecord(f"{index:04X}", index)
        narrow = (0,) if index == 0x1018 or index & 0xF00 == 0xA00 or index & 0xF00 == 0x600 else (0, 2)
        for subindex in range(3 if index & 0xF00 in (0x800, 0x400) else 5):
            record.add_member(_variable(index, subindex, "u8" if subindex in narrow else kind))
        made.add_object(record)
    return made


def reach(node: BaseNode402, state: str) -> str:
    """Have the state machine go to a state, and return where it is."""
    node.state = state
    return node.state


def drive(role: str) -> None:
    """Everything of one drive."""
    where = TASK["addresses"][role]["can"]
    network = canopen.Network()
    network.connect(interface=where["interface"], channel=where["channel"])
    calls = Calls(f"canopen BaseNode402, {role}", refusal=canopen.SdoAbortedError)
    node = network.add_node(BaseNode402(where["node_id"], dictionary(_RECORDS)))
    node.sdo.RESPONSE_TIMEOUT = 5.0
    for index in (*_SINGLE, 0x1018):
        entry = node.sdo[index] if index in _SINGLE else node.sdo[index][1]
        calls.make(f"sdo[{index:04X}h].raw", lambda entry=entry: entry.raw)
    calls.make("nmt.state = PRE-OPERATIONAL", lambda: setattr(node.nmt, "state", "PRE-OPERATIONAL"))
    node.sdo[0x1017].raw = 100
    calls.make("nmt.wait_for_heartbeat()", lambda: node.nmt.wait_for_heartbeat(2.0), "PRE-OPERATIONAL".__eq__)
    calls.make("setup_402_state_machine()", node.setup_402_state_machine)
    calls.make("nmt.state = OPERATIONAL", lambda: setattr(node.nmt, "state", "OPERATIONAL"))
    calls.make("nmt.wait_for_heartbeat(), again", lambda: node.nmt.wait_for_heartbeat(2.0), "OPERATIONAL".__eq__)
    mode = _MODES.get(role)
    for name in ("PROFILED VELOCITY", "PROFILED TORQUE", "HOMING", "CYCLIC SYNCHRONOUS TORQUE"):
        calls.make(
            f"is_op_mode_supported({name})",
            lambda name=name: node.is_op_mode_supported(name),
            lambda found: isinstance(found, bool),
        )
    if mode is None:
        node.sdo[0x6060].raw = -1
        calls.make("op_mode", lambda: node.op_mode, "OPEN LOOP SCALAR MODE".__eq__)
    else:
        calls.make(f"op_mode = {mode}", lambda: setattr(node, "op_mode", mode))
        calls.make("op_mode", lambda: node.op_mode, mode.__eq__)
    for state in (
        *("READY TO SWITCH ON", "SWITCHED ON", "OPERATION ENABLED", "SWITCHED ON", "OPERATION ENABLED"),
        *("READY TO SWITCH ON", "OPERATION ENABLED", "QUICK STOP ACTIVE", "OPERATION ENABLED", "SWITCH ON DISABLED"),
        *("OPERATION ENABLED", "QUICK STOP ACTIVE", "SWITCH ON DISABLED"),
    ):
        calls.make(f"state = {state}", lambda state=state: reach(node, state), state.__eq__)
    calls.make("is_faulted()", node.is_faulted, lambda found: found is False)
    calls.make("reset_from_fault() without one", node.reset_from_fault)
    if mode is not None:
        velocity = 6000
        calls.make("60FFh = 6000", lambda: setattr(node.sdo[0x60FF], "raw", velocity))
        calls.make("60FFh", lambda: node.sdo[0x60FF].raw, velocity)
        calls.make("_clear_target_values()", node._clear_target_values)
    process_data(network, node, calls)
    node.nmt.state = "PRE-OPERATIONAL"
    master = network.add_node(BaseNode402(where["node_id"], dictionary({**_RECORDS, **_TO_DRIVE})))
    calls.make("rpdo[1].read()", master.rpdo[1].read)
    network.disconnect()


def process_data(network: canopen.Network, node: BaseNode402, calls: Calls) -> None:
    """Map the statusword into a PDO sent with SYNC, and have the state machine follow it."""
    node.nmt.state = "PRE-OPERATIONAL"
    pdo = node.tpdo[1]
    pdo.clear()
    pdo.add_variable(0x6041)
    pdo.add_variable(0x606C)
    pdo.trans_type, pdo.enabled = 1, True
    calls.make("tpdo[1].save()", pdo.save)
    calls.make("tpdo[1].read()", pdo.read)
    calls.make("tpdo[1] maps 6041h, 606Ch", lambda: [one.index for one in pdo], [0x6041, 0x606C].__eq__)
    calls.make("setup_pdos(upload=False)", lambda: node.setup_pdos(upload=False))
    node.nmt.state = "OPERATIONAL"
    network.sync.start(0.02)
    for state in ("OPERATION ENABLED", "QUICK STOP ACTIVE", "SWITCH ON DISABLED"):
        calls.make(f"PDO: state = {state}", lambda state=state: reach(node, state), state.__eq__)
    calls.make(
        "PDO: tpdo[1].wait_for_reception()", lambda: pdo.wait_for_reception(1.0), lambda found: found is not None
    )
    network.sync.stop()
    node.nmt.state = "PRE-OPERATIONAL"
    calls.make("node guarding", lambda: guarded(network, node))
    pdo.enabled = False
    calls.make("tpdo[1].save(), disabled", pdo.save)


def guarded(network: canopen.Network, node: BaseNode402) -> None:
    """Ask for the node's state by remote frames for a while."""
    node.sdo[0x1017].raw = 0
    node.nmt.start_node_guarding(0.05)
    before = node.nmt.timestamp
    threading.Event().wait(0.3)
    node.nmt.stop_node_guarding()
    if node.nmt.timestamp == before:
        raise TimeoutError("no answer to node guarding")


logging.disable(logging.CRITICAL)
for one, sockets in _SOCKETS.items():
    # A drive whose motor is not there trips as soon as it is enabled.
    hands("connect", wiring=dict(zip("ABC", sockets, strict=False)))
    drive(one)
