#!/usr/bin/env python3
"""A second driver, from docs/protocol.md alone: python3 driver.py HOST:PORT golden.txt samples.csv

Checks the golden frames, then calibrates, applies and reverts a controller, with repeated, late and stale requests.
samples.csv: q1, q2, q3 in degrees, x, y, z in mm, after a line of names and comments.
"""
import csv
import math
import socket
import struct
import sys
import time
import zlib

VERSION = 6


def stuff(content):
    """COBS."""
    out, block = bytearray(), bytearray()
    for byte in content + b"\0":
        if byte:
            block.append(byte)
        if not byte or len(block) == 254:
            out += bytes([len(block) + 1]) + block
            block = bytearray()
    return bytes(out)


def unstuff(bytes_):
    out, at = bytearray(), 0
    while at < len(bytes_):
        length = bytes_[at]
        out += bytes_[at + 1 : at + length]
        at += length
        if length < 255 and at < len(bytes_):
            out.append(0)
    return bytes(out)


def frame(direction, sequence, message):
    content = struct.pack("<BH", VERSION | direction << 7, sequence) + message
    return b"\0" + stuff(content + struct.pack("<I", zlib.crc32(content))) + b"\0"


def parse(content):
    """Direction, sequence number, message."""
    content, crc = content[:-4], content[-4:]
    assert struct.unpack("<I", crc)[0] == zlib.crc32(content), "checksum"
    first, sequence = struct.unpack("<BH", content[:3])
    assert first & 127 == VERSION
    return first >> 7, sequence, content[3:]


class Message:
    """Reads fields, or with `pack` writes them."""

    def __init__(self, body, T):
        self.body, self.T = body, T

    def get(self, form):
        form = "<" + form.replace("T", self.T)
        values = struct.unpack_from(form, self.body)
        self.body = self.body[struct.calcsize(form) :]
        return values if len(values) > 1 else values[0]

    def optional(self, form):
        return self.get(form) if self.get("B") else None


def identify():
    return b"\0"


def parameters(nominal):
    return struct.pack("<BB", 1, nominal)


def begin(T, session, tolerance, joint_zero, noise, estimator, gate, forgetting):
    def optional(values):
        return b"\0" if values is None else struct.pack(f"<B{len(values)}{T}", 1, *values)

    numbers = optional(tolerance) + optional(joint_zero) + optional(noise)
    return struct.pack("<BI", 2, session) + numbers + struct.pack("<BB", estimator, gate) + optional(forgetting)


def sample(T, session, index, joints, position):
    return struct.pack(f"<BII6{T}", 3, session, index, *joints, *position)


def request(number, *words):
    return struct.pack(f"<B{len(words)}I", number, *words)


def revert(generation, nominal):
    return request(8, generation) + bytes([nominal])


def check_golden(path):
    frames = dict(line.split(": ") for line in open(path).read().splitlines())
    session, fingerprint = 0x01020304, 0xA1B2C3D4
    half = (2.0**-4, 2.0**-4, 2.0**-3, 0.0)
    own = {
        "identify": identify(),
        "solve": request(4, session, 40),
        "status": request(5),
        "apply": request(7, session, fingerprint, 3),
        "revert": revert(3, 1),
        "counters": request(9),
        "resume": request(11, 900),
    }
    for name, T in (("f32", "f"), ("f64", "d")):
        own[f"begin_{name}"] = begin(T, session, (0.5, 2.0**-7), (2.0**-3,), half, 1, 0, (20.0,))
        own[f"sample_{name}"] = sample(T, session, 7, (0.5, 0.25, -0.125), (1.5, -2.5, -450.0))
    for name, message in own.items():
        assert frame(0, 0x1234, message).hex() == frames[name], name
    for name, text in frames.items():
        direction, sequence, message = parse(unstuff(bytes.fromhex(text)[1:-1]))
        assert frame(direction, sequence, message).hex() == text, name
    return len(frames)


class Controller:
    def __init__(self, address):
        host, port = address.rsplit(":", 1)
        self.link = socket.create_connection((host, int(port)), timeout=0.5)
        self.sequence, self.T = 1, "f"

    def ask(self, message):
        """The number of the answer, and the rest of it."""
        self.sequence = self.sequence % 0xFFFF + 1
        for _ in range(8):
            self.link.sendall(frame(0, self.sequence, message))
            received = b""
            try:
                while True:
                    received += self.link.recv(512)
                    for part in received.split(b"\0")[:-1]:
                        direction, sequence, body = parse(unstuff(part)) if part else (0, 0, b"")
                        if (direction, sequence) == (1, self.sequence):
                            answer = Message(body, self.T)
                            return answer.get("B"), answer
            except TimeoutError:
                pass
        raise SystemExit("no answer")

    def expect(self, number, message):
        answered, rest = self.ask(message)
        assert answered == number, (answered, rest.body)
        return rest

    def fault(self, message):
        return self.expect(0, message).get("B")

    def parameters(self, nominal=0):
        """Origin, generation, geometry."""
        answer = self.expect(2, parameters(nominal))
        return answer.get("B"), answer.get("I"), answer.get("24T")

    def status(self):
        """Phase, its fingerprint, and of the control loop the fingerprint and the motion."""
        answer = self.expect(4, request(5))
        answer.get("I")
        phase, result = answer.get("B"), None
        if phase == 1:
            answer.get("I")
        elif phase == 3:
            result = answer.get("II")[1]
        assert phase < 4, "refused"
        assert answer.get("B") == 0, "no gate was asked for"
        loop = answer.get("10I")
        return phase, result, loop[7], answer.get("B")

    def uses(self, fingerprint):
        while self.status()[2] != fingerprint:
            time.sleep(0.02)


def crc(geometry):
    return zlib.crc32(struct.pack(f"<{len(geometry)}d", *geometry))


def main(address, golden, samples):
    print(check_golden(golden), "golden frames")
    there = Controller(address)
    identity = there.expect(1, identify())
    _firmware, scalar, _processor, nominal = identity.get("3H"), identity.get("B"), identity.get("I"), identity.get("I")
    there.T = "fd"[scalar]
    assert crc(there.parameters(1)[2]) == nominal
    generation = there.parameters()[1]

    lines = [line for line in open(samples) if not line.startswith("#")]
    rows = [[float(cell) for cell in row] for row in list(csv.reader(lines))[1:]]
    rows = [([math.radians(q) for q in row[:3]], row[3:6]) for row in rows]
    session = 0x5EED
    opened = begin(there.T, session, (0.5, 0.0035), None, (0.02, 0.02, 0.02, 0.0), 1, 0, None)
    assert there.expect(3, opened).get("II") == (session, 0)
    for index, (joints, position) in enumerate(rows):
        message = sample(there.T, session, index, joints, position)
        # Each is sent twice, and the first again as it would come late.
        for sent in (message, message, sample(there.T, session, 0, *rows[0])):
            assert there.expect(3, sent).get("II") == (session, index + 1)
    assert there.fault(sample(there.T, session, len(rows) + 1, *rows[0])) == 4
    assert there.expect(3, opened).get("II") == (session, len(rows)), "the same Begin goes on"
    there.expect(4, request(4, session, len(rows)))
    while there.status()[0] != 3:
        time.sleep(0.02)
    result = there.status()[1]
    geometry = []
    for arm in range(3):
        outcome = there.expect(5, request(6, session) + bytes([arm]))
        assert outcome.get("B") == arm
        geometry += outcome.get("8T")
    assert crc(geometry) == result
    assert there.fault(request(7, session, result, generation + 1)) == 9, "a stale generation"
    assert there.fault(request(7, session, result ^ 1, generation)) == 9, "another result"
    for _ in range(2):
        there.expect(2, request(7, session, result, generation))
    there.uses(result)
    origin, applied, now = there.parameters()
    assert (origin, crc(now)) == (2, result) and applied != generation
    assert there.fault(revert(generation, 1)) == 9, "a stale generation"
    assert there.expect(4, request(11, 0)), "no stop: nothing happens"
    there.expect(2, revert(applied, 0))
    there.uses(nominal)
    assert there.parameters()[0] == 0 and there.status()[3] == 1
    received, _damaged, _version, unknown, repeated = there.expect(6, request(9)).get("5I")
    assert received > 3 * len(rows) and unknown == 0 and repeated == 0
    print("calibrated, applied and reverted")


if __name__ == "__main__":
    main(*sys.argv[1:])
