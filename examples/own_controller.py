"""A learned policy as control law: a small network adds to the thrusts of the analytic law; checks and limits stay.

Fly it: ``ibvs-qp paint --controller examples/own_controller.py:ResidualPolicy``; docs/extending.md has the other tools.
"""

from pathlib import Path

import numpy as np

from ibvs_qp import ControllerConfig, Measurement, PaperController, Reference

HIDDEN, SHARE_N = 32, 2.0  # neurons; largest thrust that the policy adds or takes away
FILE = Path(__file__).with_name("policy.npz")


class ResidualPolicy(PaperController):
    """Thrusts of the analytic law plus those of a network of two layers."""

    def __init__(self, config: ControllerConfig, file: Path = FILE) -> None:
        super().__init__(config)
        shapes = {"hidden": (HIDDEN, 10), "output": (config.vehicle.geometry.count, HIDDEN)}
        self.weights = dict(np.load(file)) if file.exists() else {name: np.zeros(shapes[name]) for name in shapes}

    def observe(self, measurement: Measurement) -> np.ndarray:
        """Attitude to the wall [rad], push error [N], angular velocity [rad/s], velocity [m/s], (10,)."""
        law, velocity = self.setpoints, measurement.velocity
        error = law.push_reference - law.contact_push if law.in_contact else 0.0
        rates = measurement.angular_velocity, np.zeros(3) if velocity is None else velocity
        return np.concatenate(((law.roll, law.pitch, law.yaw, error), *rates))

    def thrusts(self, measurement: Measurement, reference: Reference) -> np.ndarray:
        """Thrusts before the limits [N], (n,)."""
        hidden = np.tanh(self.weights["hidden"] @ self.observe(measurement))
        return super().thrusts(measurement, reference) + SHARE_N * np.tanh(self.weights["output"] @ hidden)


if __name__ == "__main__":
    still = {"attitude": np.array([1.0, 0.0, 0.0, 0.0]), "angular_velocity": np.zeros(3), "contact_wrench": np.zeros(6)}
    hover = Measurement(stamp_ns=4_000_000, wrench_stamp_ns=4_000_000, **still)
    print(f"thrusts {np.round(ResidualPolicy(ControllerConfig()).step(hover, Reference()).thrusts, 1).tolist()} N")
