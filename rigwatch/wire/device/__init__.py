"""Device formats: serial frames, Modbus registers, and the calibration of channels to SI."""

from rigwatch.wire.device.calibration import Calibration
from rigwatch.wire.device.frame import (
    CRC_SIZE,
    HEAD_SIZE,
    LONGEST,
    VERSION,
    Frame,
    FrameDecoder,
    encode,
)
from rigwatch.wire.device.modbus_map import (
    HEADER_LENGTH,
    Header,
    WordOrder,
    decode_header,
    decode_slots,
    encode_header,
    encode_slot,
)

__all__ = [
    "CRC_SIZE",
    "HEADER_LENGTH",
    "HEAD_SIZE",
    "LONGEST",
    "VERSION",
    "Calibration",
    "Frame",
    "FrameDecoder",
    "Header",
    "WordOrder",
    "decode_header",
    "decode_slots",
    "encode",
    "encode_header",
    "encode_slot",
]
