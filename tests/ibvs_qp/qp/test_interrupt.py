"""Ctrl-C while OSQP solves, and after two solves that overlapped."""

from __future__ import annotations

import os
import select
import signal
import subprocess
import sys
import time

_SOLVING = """
import os, signal, sys, numpy as np
from controller_scenes import pack, random_tick
from ibvs_qp.controller import HybridController
signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background job ignores it
controller, caught = HybridController(), 0
pack(controller, *random_tick(np.random.default_rng(0), 2))
data, solver = controller.engine.data, controller.engine.solver
while caught < 4:
    try:
        print("solving", file=sys.stderr, flush=True)
        while True:
            data.q[:] = -data.q  # far from the last solution: nearly all the time is spent in OSQP
            solver.solve(data.p, data.q, data.a, data.lower, data.upper)
    except KeyboardInterrupt:
        caught += 1
os._exit(0)
"""


#: Signals that may be lost: one that arrives during the last iteration of a solve, after OSQP's last look at it. One
#: that was not answered for so long is lost [s].
LOST, PATIENCE_S = 3, 2.0
#: Until the process is in OSQP, where it spends 97 % of its time, on a loaded machine as well [s].
SOLVING_S = 0.1


def test_ctrl_c_during_a_solve_arrives() -> None:
    """OSQP 1.1 handles SIGINT itself while it solves: it prints "Solver interrupted" to stdout and drops the signal."""
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    command = [sys.executable, "-c", _SOLVING]
    process = subprocess.Popen(command, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, bufsize=0)
    assert process.stderr is not None
    try:
        assert process.stderr.readline() == b"solving\n"
        lost = 0
        while process.poll() is None and lost <= LOST:
            time.sleep(SOLVING_S)
            process.send_signal(signal.SIGINT)
            if select.select([process.stderr], [], [], PATIENCE_S)[0]:
                process.stderr.readline()
            else:
                lost += 1
        assert process.wait(timeout=10) == 0
    finally:
        process.kill()


_OVERLAPPING = """
import os, signal, threading, time, numpy as np
from controller_scenes import pack, random_tick
from ibvs_qp.controller import HybridController
signal.signal(signal.SIGINT, signal.default_int_handler)
def solve(controller):
    data, solver = controller.engine.data, controller.engine.solver
    for _ in range(300):
        data.q[:] = -data.q
        solver.solve(data.p, data.q, data.a, data.lower, data.upper)
controllers = [HybridController() for _ in range(2)]
for controller in controllers:
    pack(controller, *random_tick(np.random.default_rng(0), 2))
threads = [threading.Thread(target=solve, args=(each,)) for each in controllers]
for thread in threads:
    thread.start()
for thread in threads:
    thread.join()
try:
    os.kill(os.getpid(), signal.SIGINT)
    time.sleep(30.0)
except KeyboardInterrupt:
    os._exit(7)
"""


def test_ctrl_c_arrives_after_controllers_were_stepped_in_two_threads() -> None:
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    done = subprocess.run([sys.executable, "-c", _OVERLAPPING], env=environment, timeout=120, capture_output=True)
    assert done.returncode == 7, done.stderr.decode()
