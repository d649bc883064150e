"""A process that flies the bridge and the stand-in for PX4 in lock-step: no load of the computer changes the flight.

Both share a clock that goes on by one tick when both are done, and DDS within one process delivers at once. Garbage
comes from another process, so many packets a tick.

    python px4_lock_step.py PACKETS '{"domain": 7, "duration_s": 130}'      prints one line of JSON at the end
"""

from __future__ import annotations

import json
import subprocess
import sys
import time
from pathlib import Path

from px4_stand_in import RATE_HZ, Plan, StandIn

from ibvs_qp import preset
from ibvs_qp.interfaces.px4.bridge import Bridge
from ibvs_qp.interfaces.px4.config import BridgeConfig

TICK_NS = round(1e9 / RATE_HZ)


def main() -> None:
    packets, plan = int(sys.argv[1]), Plan(**json.loads(sys.argv[2]))
    command = [sys.executable, str(Path(__file__).with_name("dds_garbage.py")), str(plan.domain)]
    streams = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.DEVNULL}
    with subprocess.Popen(command, text=True, bufsize=1, **streams) as garbage:
        begin, elapsed = time.time_ns(), 0
        stand_in = StandIn(plan, clock=lambda: begin + elapsed)
        bridge = Bridge(BridgeConfig(domain_id=plan.domain), preset("tarot_t960_qp"), clock=lambda: begin + elapsed)
        sent, safety = "{}", ""
        assert garbage.stdin is not None and garbage.stdout is not None
        flying = True
        while flying:
            garbage.stdin.write(f"{packets}\n")
            flying = stand_in.tick(elapsed) and bridge.tick(elapsed)
            sent = garbage.stdout.readline()
            elapsed += TICK_NS
            safety = bridge.status.safety or safety
        garbage.stdin.close()
    status = bridge.status
    report = {"garbage": json.loads(sent), "ignored": status.ignored, "phase": status.phase, "safety": safety}
    print(json.dumps(stand_in.report() | report))


if __name__ == "__main__":
    main()
