"""What flies with hostile inputs: both laws, supervised and not, and pilots.

Recorded sensors do not answer the thrusts. An observer of forces therefore takes thrusts that differ from the recorded
ones for a force of the same size, compensates it, and so keeps the difference; integrals keep theirs. Subjects that
are ``bare`` of both forget within half a second all but what contact and stiffness estimates learnt.
"""

from __future__ import annotations

from hostile_flight import Subject

from ibvs_qp.analytic import PaperController
from ibvs_qp.config import ControllerConfig, Gains, SafetySettings
from ibvs_qp.controller import HybridController
from ibvs_qp.pilot import Pilot
from ibvs_qp.supervision.assured import Assured
from tests.replay.cases import CASES

UNSUPERVISED = SafetySettings(supervise=False)


def bare() -> ControllerConfig:
    """Without integrals."""
    return ControllerConfig(gains=Gains(line_ki=0.0, velocity_ki=0.0, force_kfi=0.0))


#: ``agreed`` [N]: recorded inputs correct nothing, so that integrals stay apart; the force observer follows them, in
#: the wall's plane at up to 10 rad/s and along its normal at up to 30 rad/s. At 1.5 rad/s in the plane the analytic
#: pilot agrees to 6 N; at full speed it winds up to 15 N apart, and comes back to 3 N within another half second. In
#: heavy noise the friction that a stuck tip raises differs as well, by 4 N of feed-forward.
CONTROLLERS = {
    "qp": Subject(HybridController, "rotor_loss", 700, agreed=6.0),
    "qp, bare": Subject(lambda: HybridController(bare()), "rotor_loss", 700, agreed=2.0, bare=True),
    "qp, noise": Subject(HybridController, "heavy_noise", 1500, agreed=13.0),
    "qp, rotor lost": Subject(HybridController, "rotor_loss", 1100),
    "analytic": Subject(PaperController, "paint_paper_law", 800, agreed=6.0),
    "analytic, bare": Subject(lambda: PaperController(bare()), "paint_paper_law", 800, agreed=2.0, bare=True),
    "assured": Subject(lambda: Assured(HybridController()), "rotor_loss", 700),
    "assured, bare": Subject(
        lambda: Assured(HybridController(bare()), UNSUPERVISED), "rotor_loss", 700, agreed=2.0, bare=True
    ),
}
PILOTS = {
    "pilot": Subject(CASES["rotor_loss"].pilot, "rotor_loss", 700, agreed=6.0),
    "analytic pilot": Subject(CASES["paint_paper_law"].pilot, "paint_paper_law", 800, agreed=16.0),
    "supervised pilot": Subject(Pilot, "rotor_loss", 700),
    "pilot with pictures": Subject(CASES["paint_qp"].pilot, "paint_qp", 0),
}
