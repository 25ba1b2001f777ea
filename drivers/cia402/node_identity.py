"""A CANopen node's identity object (CiA 301): only its vendor is mandatory."""

from drivers.interfaces import Identity
from drivers.transport.can.objects import NodeObjects

DEVICE_NAME, IDENTITY = 0x1008, 0x1018


def read_identity(objects: NodeObjects) -> Identity:
    """Return vendor, name or product, serial number and revision, each as far as the node tells it.

    Raises ReportedError where it tells no vendor, CommunicationError for no reply.
    """
    vendor = objects.read(IDENTITY, 1, 4)
    product, revision, serial = (objects.read_optional(IDENTITY, subindex, 4) for subindex in (2, 3, 4))
    name = objects.read_optional_text(DEVICE_NAME, 0)
    return Identity(
        f"vendor 0x{vendor:08X}",
        name or ("" if product is None else f"product 0x{product:08X}"),
        "" if serial is None else str(serial),
        "" if revision is None else f"{revision:X}",
    )
