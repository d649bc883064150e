"""Time from inertial data to the command that answers them, over DDS on the loopback interface; one line of JSON.

Run as ``python benchmarks/bridge.py --seconds 60`` on an otherwise idle computer. The bridge, a stand-in for PX4 with
its camera, and a process that sends garbage run beside each other. No command should answer data older than 20 ms
(``imu_age_s``), at which the supervisor calls them stale. ``tests/ibvs_qp/interfaces/px4/test_loopback.py`` flies the
same beside other tests, and so allows it one command in a thousand. Needs the extras ``dds`` and ``test``.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "support"))

import dds_loopback

#: Garbage packets per second.
GARBAGE_HZ = 1700.0


def main() -> None:
    """Fly and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=60.0, help="time in Offboard mode [s] (default 60)")
    seconds = parser.parse_args().seconds
    garbage = round(seconds * GARBAGE_HZ), GARBAGE_HZ
    with tempfile.TemporaryDirectory() as folder:
        domain = dds_loopback.domain("benchmark")
        seen = dds_loopback.fly(Path(folder), domain, garbage=garbage, as_json=True, duration_s=seconds).seen
    if not seen["offboard"]:
        raise SystemExit("the bridge was not ready in time: Offboard mode was not reached")
    names = ("median", "99 %", "99.9 %", "largest")
    spreads = {name: dict(zip(names, seen[name], strict=True)) for name in ("age_ms", "gap_ms")}
    print(json.dumps({"commands": seen["commands"], **spreads}))


if __name__ == "__main__":
    main()
