#!/usr/bin/env python3
"""The frames of protocol/src/golden.rs and docs/protocol.md, from docs/protocol.md and without the Rust code."""
import struct
import zlib

VERSION, SEQUENCE = 6, 0x1234


def stuffed(content):
    """COBS; no content here has 254 bytes without a zero."""
    blocks = content.split(b"\0")
    assert all(len(block) < 254 for block in blocks)
    return b"".join(bytes([len(block) + 1]) + block for block in blocks)


def frame(direction, *pieces, sequence=SEQUENCE):
    head = struct.pack("<BH", VERSION | direction << 7, sequence)
    content = head + b"".join(pieces)
    return b"\0" + stuffed(content + struct.pack("<I", zlib.crc32(content))) + b"\0"


u8 = lambda *values: struct.pack(f"<{len(values)}B", *values)
u16 = lambda *values: struct.pack(f"<{len(values)}H", *values)
u32 = lambda *values: struct.pack(f"<{len(values)}I", *values)
u64 = lambda *values: struct.pack(f"<{len(values)}Q", *values)
f32 = lambda *values: struct.pack(f"<{len(values)}f", *values)
f64 = lambda *values: struct.pack(f"<{len(values)}d", *values)
NONE, SOME = u8(0), u8(1)
SESSION, GENERATION, FINGERPRINT = 0x01020304, 3, 0xA1B2C3D4
ARM = [164.0, 0.5, -0.25, 0.0, 0.125, 260.75, 0.5, 480.5]
GEAR = [0.0078125, 0.0, -0.5, 0.25, 0.0]
REQUEST, RESPONSE = 0, 1


def frames(name, T):
    control = u32(1000, 850, 851, 25_000_000, 0, 0, 1, FINGERPRINT, 1000, 900) + u8(3) + T(1.5, -2.5, -450.0) + T(0.5, 0.25, -0.125)
    geometry = T(*ARM * 3)
    yield "identify", REQUEST, [u8(0)]
    yield "parameters", REQUEST, [u8(1), u8(1)]
    yield f"begin_{name}", REQUEST, [
        u8(2), u32(SESSION), SOME, T(0.5, 0.0078125), SOME, T(0.125), SOME, T(0.0625, 0.0625, 0.125), T(0.0), u8(1), u8(0),
        SOME, T(20.0)]
    yield f"sample_{name}", REQUEST, [u8(3), u32(SESSION, 7), T(0.5, 0.25, -0.125), T(1.5, -2.5, -450.0)]
    yield "solve", REQUEST, [u8(4), u32(SESSION, 40)]
    yield "status", REQUEST, [u8(5)]
    yield "outcome", REQUEST, [u8(6), u32(SESSION), u8(2)]
    yield "apply", REQUEST, [u8(7), u32(SESSION, FINGERPRINT, GENERATION)]
    yield "revert", REQUEST, [u8(8), u32(GENERATION), u8(1)]
    yield "counters", REQUEST, [u8(9)]
    yield f"adopt_{name}", REQUEST, [u8(10), u32(GENERATION), geometry, SOME, T(*GEAR * 3)]
    yield "resume", REQUEST, [u8(11), u32(900)]
    yield "fault_out_of_order", RESPONSE, [u8(0), u8(4), u32(5)]
    yield "fault_sample", RESPONSE, [u8(0), u8(5), u8(52), u8(1)]
    yield "fault_geometry", RESPONSE, [u8(0), u8(11), u8(31), u8(7)]
    yield "identity", RESPONSE, [u8(1), u16(0, 1, 2), u8(0), u32(0x410FC241), u32(FINGERPRINT)]
    yield f"parameters_{name}", RESPONSE, [u8(2), u8(2), u32(GENERATION), geometry, NONE]
    yield "taken", RESPONSE, [u8(3), u32(SESSION, 8)]
    yield f"solved_{name}", RESPONSE, [u8(4), u32(SESSION), u8(3), u32(40, FINGERPRINT), NONE, control]
    yield f"refused_{name}", RESPONSE, [
        u8(4), u32(SESSION), u8(4), u32(40), u8(71), u8(0), u8(7), f32(2048.0),
        SOME, u64(38, 8, 2), SOME, u8(92), u64(50), control]
    yield f"outcome_{name}", RESPONSE, [
        u8(5), u8(2), T(*ARM), NONE, SOME, T(*[0.015625] * 8), T(0.03125), NONE, T(96.0), u64(40), u16(5), u8(0), u8(0),
        T(9.0), T(*[0.25] * 8)]
    yield "counted", RESPONSE, [u8(6), u32(1, 2, 3, 4, 5, 6, 7, 8)]


shown = set()
for name, T in (("f32", f32), ("f64", f64)):
    for key, direction, pieces in frames(name, T):
        if key not in shown:
            shown.add(key)
            print(f"{key}: {frame(direction, *pieces).hex()}")
