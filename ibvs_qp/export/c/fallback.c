/* Hover and the analytic law; see ibvs_qp.safety.hover and ibvs_qp.analytic. */
#include "ibvs_internal.h"

static void thrusts_of(const ibvs_real wrench[6], ibvs_real thrusts[IBVS_ROTORS]) {
  for (uint32_t i = 0; i < IBVS_ROTORS; ++i) {
    thrusts[i] = 0;
    for (uint32_t k = 0; k < 6; ++k) {
      thrusts[i] += ibvs_inverse[i][k] * wrench[k];
    }
  }
}

void ibvs_hold_thrusts(const ibvs_controller *c, ibvs_real thrusts[IBVS_ROTORS]) {
  const ibvs_real weight = IBVS_MASS_KG * IBVS_GRAVITY;
  ibvs_real wrench[6] = {0, 0, -weight, 0, 0, 0};
  if (c->measured) {
    const ibvs_real *rate = c->last.angular_velocity, *quaternion = c->last.attitude;
    const ibvs_real w = quaternion[0], x = quaternion[1], y = quaternion[2], z = quaternion[3];
    const ibvs_real down[3] = {2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)};
    const ibvs_real roll = r_atan2(down[1], down[2]), pitch = -r_asin(r_fmax(-1, r_fmin(1, down[0])));
    const ibvs_real angular[3] = {-IBVS_HOVER_KP * roll - IBVS_HOVER_KD * rate[0],
                                  -IBVS_HOVER_KP * pitch - IBVS_HOVER_KD * rate[1],
                                  -IBVS_HOVER_KD * rate[2]};
    for (uint32_t i = 0; i < 3; ++i) {
      wrench[i] = -weight * down[i];
      wrench[3 + i] = 0;
      for (uint32_t k = 0; k < 3; ++k) {
        wrench[3 + i] += ibvs_mass_matrix[3 + i][3 + k] * angular[k];
      }
    }
  }
  thrusts_of(wrench, thrusts);
  for (uint32_t i = 0; i < IBVS_ROTORS; ++i) {
    thrusts[i] = r_fmin(r_fmax(thrusts[i], ibvs_thrust_floor[i]), ibvs_thrust_ceiling[i]);
  }
}

void ibvs_analytic_thrusts(const ibvs_controller *c, ibvs_real thrusts[IBVS_ROTORS]) {
  ibvs_real acceleration[6], error[IBVS_LINES + 1], wrench[6], along = 0;
  memcpy(acceleration, c->secondary, sizeof acceleration);
  for (uint32_t i = 0; i < IBVS_LINES + 1; ++i) {
    error[i] = c->line_targets[i];
    for (uint32_t k = 0; k < 6; ++k) {
      error[i] -= c->line_rows[6 * i + k] * c->secondary[k];
    }
  }
  ibvs_apply_pseudo_inverse(c->line_rows, IBVS_LINES + 1, error, acceleration);
  for (uint32_t i = 0; i < 6; ++i) {
    wrench[i] = 0;
    for (uint32_t k = 0; k < 6; ++k) {
      wrench[i] += ibvs_mass_matrix[i][k] * acceleration[k];
    }
  }
  const ibvs_real *normal = &c->results[IBVS_OUT_NORMAL], weight = c->results[IBVS_OUT_CONTACT_WEIGHT];
  for (uint32_t i = 0; i < 3; ++i) {
    along += normal[i] * wrench[i];
  }
  for (uint32_t i = 0; i < 6; ++i) {
    wrench[i] += i < 3 ? normal[i] * weight * (c->results[IBVS_OUT_PUSH_COMMAND] - along) : 0;
    wrench[i] -= c->results[IBVS_OUT_BIAS_WRENCH + i];
  }
  thrusts_of(wrench, thrusts);
}
