"""Push force in contact: the paper's impedance force law as one row along the wall normal."""

from __future__ import annotations

import casadi as ca

from ibvs_qp.model.external_wrench import quiet_rate
from ibvs_qp.model.feedforward import moment_lag
from ibvs_qp.model.inputs import LEAST_GAIN, clamp
from ibvs_qp.model.model import Model
from ibvs_qp.model.rows import TaskRow
from ibvs_qp.tasks.task import Task

#: Bound of the force integral as a force [N].
FORCE_INTEGRAL_BOUND = 8.0


class PushTask(Task):
    r"""Net force along n equals the force law in contact [N], weight lambda.

    .. math::
        F = F_{ref} + K_{sp} e_s + K_{sd} (\dot e_s + T \ddot e_s) + K_{fp} (F_{ref} - f) + K_{fi} \int (F_{ref} - f)

    F_ref is the push reference within reach times the ramp after touch, f the measured push, e_s the distance of the
    tip to the wall, T the lead against the motors' lag; `Model.filtered` follows. (Paper, equation 14, with the sign of
    the force feedback corrected.)
    """

    weight_settings = ("weights.push",)

    def rows(self, model: Model) -> list[TaskRow]:
        """One row in newtons, so that the blend with the stand-off row is linear in lambda."""
        return [
            TaskRow(
                name="push",
                unit="N",
                expression=model.force_along_normal,
                target=model.output("push_command", self.force(model)),
                weight=model.config.weights.push * model.contact_weight,
            )
        ]

    def force(self, model: Model) -> ca.SX:
        """The force law [N]."""
        gains, contact = model.gains, model.contact
        reference = model.push_reference * contact.ramp
        error = reference - contact.push
        # On stiff walls the loop gain rises with the stiffness; the proportional gain falls with it.
        softness = ca.fmin(1.0, model.config.contact.full_gain_stiffness_n_m / contact.stiffness)
        proportional = softness * quiet_rate(contact, model.config.contact) * gains.force_kfp
        feedback = proportional * error + gains.force_kfi * self._integral(model, reference)
        target = reference + feedback + self._impedance(model)
        return model.filtered(target, model.force_along_normal, gains.push_filter_s)

    def _integral(self, model: Model, reference: ca.SX) -> ca.SX:
        """Integral of the force error [N s]: zero out of contact; while thrusts are limited it only falls.

        The error is that of the push to expect, lambda times the reference behind motors and force filter: the lag of
        a ramp to 25 N in a second would fill the integral, and the push overshoot by 5 N. An integral that could not
        fall while it alone keeps the thrusts limited would stay for good.
        """
        contact, signals = model.contact, model.signals
        pressing = ca.logic_and(contact.touching, model.target.press)
        expected, old = signals.state("push_expected"), signals.state("force_integral")
        late = 1.0 - ca.exp(-model.body.dt / moment_lag(model.config))
        coming = model.contact_weight * reference
        expected = ca.if_else(pressing, expected + late * (coming - expected), 0.0)
        error = signals.remember("push_expected", expected) - contact.push
        bound = FORCE_INTEGRAL_BOUND / ca.fmax(model.gains.force_kfi, LEAST_GAIN)
        moving = ca.logic_or(model.integrate, error * old < 0.0)
        step = ca.if_else(moving, model.body.dt, 0.0) * model.contact_weight
        moved = clamp(old + step * error, -bound, bound)
        return signals.remember("force_integral", ca.if_else(pressing, moved, 0.0))

    def _impedance(self, model: Model) -> ca.SX:
        """Spring and damper between tip and wall [N]; none in direct force control."""
        config, contact = model.config, model.contact
        if not config.impedance:
            return ca.SX(0.0)
        gains = model.gains
        damping = quiet_rate(contact, config.contact) * gains.force_ksd * predicted_rate(model)
        force = gains.force_ksp * contact.distance + damping
        return ca.if_else(contact.known, force, 0.0)


def predicted_rate(model: Model) -> ca.SX:
    r"""Rate of the distance after the lead, :math:`\dot e_s + T \ddot e_s` [m/s].

    A touch on a stiff wall lasts 80 ms. Damping that comes one motor lag late arrives when the tip already leaves.
    """
    return model.contact.rate + model.gains.push_lead_s * model.contact.acceleration
