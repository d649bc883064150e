"""A process that sends what no bridge can use, to every topic of the bridge and past DDS as well.

Through DDS: NaN, wrong sizes and encodings, far stamps, messages of many megabytes. Cyclone DDS refuses to write bytes
that are no message of the type, so those are injected: RTPS packets in the name of a matched writer with random or
broken payloads, and stray datagrams.

    python dds_garbage.py DOMAIN PACKETS RATE_HZ     prints the packets sent of each kind as one line of JSON
    python dds_garbage.py DOMAIN                     sends as many as each line of standard input says, and prints them
"""

from __future__ import annotations

import json
import random
import socket
import struct
import sys
import time
from typing import Any

import numpy as np

from ibvs_qp.interfaces.px4.config import BridgeConfig
from ibvs_qp.interfaces.px4.dds import Participant, Writer
from ibvs_qp.interfaces.px4.inputs import subscriptions
from ibvs_qp.interfaces.ros import pictures, samples
from ibvs_qp.interfaces.ros.messages import encoded

#: Port of a participant's unicast data (RTPS standard): base, gains per domain and participant, and offset.
BASE, PER_DOMAIN, PER_PARTICIPANT, USER = 7400, 250, 2, 11
PARTICIPANTS = 4
#: Begin of an RTPS packet of Cyclone DDS, and its submessage DATA with a payload in little endian.
RTPS, DATA = b"RTPS\2\1\1\x10", b"\x15\x05"
#: Time between two bursts [s], and one oversized message among so many.
BURST_S, OVERSIZED = 0.01, 5000


class Injector:
    """Sends payloads as if a writer had written them."""

    def __init__(self, domain: int) -> None:
        self._ports = [BASE + PER_DOMAIN * domain + PER_PARTICIPANT * index + USER for index in range(PARTICIPANTS)]
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._number = 1_000_000

    def inject(self, writer: Writer, payload: bytes) -> None:
        self._number += 1
        name = writer._writer.guid.bytes
        place = struct.pack("<HH4s4siI", 0, 16, bytes(4), name[12:], 0, self._number)
        self.stray(RTPS + name[:12] + DATA + struct.pack("<H", len(place) + len(payload)) + place + payload)

    def stray(self, packet: bytes) -> None:
        for port in self._ports:
            self._socket.sendto(packet, ("127.0.0.1", port))


def broken(rng: random.Random) -> bytes:
    """Bytes that are no message of any topic."""
    header = rng.choice((b"\0\1\0\0", b"\0\1\0\0", b"\0\0\0\0", b"\0\7\0\0", rng.randbytes(4)))
    return header + rng.randbytes(rng.choice((0, 1, 5, 12, 19, rng.randrange(1500, 3000))))


def wrong(role: str, rng: random.Random) -> Any:
    """A message of the right type with content of no use; None where a topic has none."""
    now = time.time_ns()
    stamp = rng.choice((0, now - 10**12, now + 10**12, 2**60))
    bad = rng.choice((np.nan, np.inf, -np.inf))
    if role == "wrench":
        value = samples.to_wrench(now, np.full(6, bad), "flu", "tool")
        return rng.choice((value, samples.to_wrench(stamp, np.zeros(6), "flu", "tool")))
    if role in ("color", "depth"):
        image = pictures.from_rgb(np.zeros((4, 6, 3), np.uint8), stamp)
        image.encoding = rng.choice(("rgb8", "16UC1", "yuv422", "", "x" * 500))
        if image.encoding in ("rgb8", "16UC1") and rng.random() < 0.7:
            image.height, image.width = rng.choice(((2**32 - 1, 2**32 - 1), (0, 0), (4, 60_000), (4, 7)))
        return image
    if role == "camera_info":
        info = pictures.from_intrinsics((300.0, 300.0, 1.0, 1.0), (4, 6), now)
        info.k = np.full(9, bad)
        return info
    return None


def oversized() -> Any:
    """A picture of three megabytes without a size."""
    image = pictures.from_rgb(np.zeros((1000, 1000, 3), np.uint8), 0)
    image.width = 0
    return image


class Garbage:
    """Everything of no use, in a random order that is always the same; `sent` counts the packets of each kind."""

    def __init__(self, domain: int) -> None:
        self._rng, part, self._injector = random.Random(0), Participant(domain), Injector(domain)
        topics = subscriptions(BridgeConfig(domain_id=domain))
        # Two writers a topic: a reader takes nothing older than the numbers that are injected in a writer's name.
        self._writers = {
            each.role: (part.writer(*each[1:3]), part.writer(*each[1:3]), each.type_name) for each in topics
        }
        self.sent = {"written": 0, "injected": 0, "stray": 0}
        time.sleep(1.5)  # discovery

    def send(self) -> None:
        """Send one packet."""
        rng, index = self._rng, sum(self.sent.values())
        role = rng.choice([*self._writers, "stray"])
        if role == "stray":
            head = rng.choice((RTPS, RTPS[:4], b""))
            self._injector.stray(head + rng.randbytes(rng.randrange(0, 1400)))
            self.sent["stray"] += 1
            return
        writer, victim, name = self._writers[role]
        value = wrong(role, rng) if rng.random() < 0.5 else None
        value = oversized() if value is not None and index % OVERSIZED == 0 and name.endswith("Image") else value
        if value is None:
            self._injector.inject(victim, broken(rng))
            self.sent["injected"] += 1
        else:
            writer.write_bytes(encoded(value, name))
            self.sent["written"] += 1


def main() -> None:
    garbage = Garbage(int(sys.argv[1]))
    if len(sys.argv) == 2:
        for line in sys.stdin:
            for _ in range(int(line)):
                garbage.send()
            print(json.dumps(garbage.sent), flush=True)
        return
    packets, rate_hz = int(sys.argv[2]), float(sys.argv[3])
    begin = time.monotonic()
    for index in range(packets):
        garbage.send()
        if (early := begin + index / rate_hz - time.monotonic()) > BURST_S:
            time.sleep(early)
    time.sleep(0.5)
    print(json.dumps(garbage.sent))


if __name__ == "__main__":
    main()
