/* Thrusts without a solution of the program: hover, and the analytic law within the limits. See ibvs_qp.model.hover,
 * ibvs_qp.analytic and allocation.allocators. */
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

#define LINE_ROWS (IBVS_LINES + 1)
#define REGULARISATION (IBVS_FLOAT ? R(1e-6) : R(1e-10)) /* of redundant rotors, of the largest entry */
#define SWEEPS 12 /* of Jacobi's method: 3 x 3 converges in 5 */

/* Jacobi's rotations: a becomes diagonal, the columns of v its eigenvectors. */
static void eigenvectors(ibvs_real a[LINE_ROWS][LINE_ROWS], ibvs_real v[LINE_ROWS][LINE_ROWS]) {
  for (uint32_t i = 0; i < LINE_ROWS; ++i) {
    for (uint32_t j = 0; j < LINE_ROWS; ++j) {
      v[i][j] = i == j ? 1 : 0;
    }
  }
  for (uint32_t sweep = 0; sweep < SWEEPS; ++sweep) {
    for (uint32_t p = 0; p + 1 < LINE_ROWS; ++p) {
      for (uint32_t q = p + 1; q < LINE_ROWS; ++q) {
        if (a[p][q] == 0) {
          continue;
        }
        const ibvs_real ratio = (a[q][q] - a[p][p]) / (2 * a[p][q]);
        const ibvs_real t = (ratio >= 0 ? 1 : -1) / (r_fabs(ratio) + r_sqrt(ratio * ratio + 1));
        const ibvs_real cosine = 1 / r_sqrt(t * t + 1), sine = t * cosine;
        for (uint32_t k = 0; k < LINE_ROWS; ++k) {
          const ibvs_real x = a[k][p], y = a[k][q];
          a[k][p] = cosine * x - sine * y;
          a[k][q] = sine * x + cosine * y;
        }
        for (uint32_t k = 0; k < LINE_ROWS; ++k) {
          const ibvs_real x = a[p][k], y = a[q][k], v_p = v[k][p], v_q = v[k][q];
          a[p][k] = cosine * x - sine * y;
          a[q][k] = sine * x + cosine * y;
          v[k][p] = cosine * v_p - sine * v_q;
          v[k][q] = sine * v_p + cosine * v_q;
        }
      }
    }
  }
}

/* solution += L^+ values by the eigenvalues of L L'; singular values below IBVS_RANK_TOLERANCE of the largest are
 * dropped. */
static void apply_pseudo_inverse(const ibvs_real *rows, const ibvs_real values[LINE_ROWS], ibvs_real solution[6]) {
  ibvs_real square[LINE_ROWS][LINE_ROWS], vectors[LINE_ROWS][LINE_ROWS], largest = 0;
  for (uint32_t i = 0; i < LINE_ROWS; ++i) {
    for (uint32_t j = 0; j < LINE_ROWS; ++j) {
      square[i][j] = 0;
      for (uint32_t k = 0; k < 6; ++k) {
        square[i][j] += rows[6 * i + k] * rows[6 * j + k];
      }
    }
  }
  eigenvectors(square, vectors);
  for (uint32_t i = 0; i < LINE_ROWS; ++i) {
    largest = r_fmax(largest, square[i][i]);
  }
  for (uint32_t mode = 0; mode < LINE_ROWS; ++mode) {
    const ibvs_real least = IBVS_RANK_TOLERANCE * IBVS_RANK_TOLERANCE * largest, value = square[mode][mode];
    if (!(value > least)) {
      continue;
    }
    ibvs_real along = 0;
    for (uint32_t i = 0; i < LINE_ROWS; ++i) {
      along += vectors[i][mode] * values[i];
    }
    for (uint32_t i = 0; i < LINE_ROWS; ++i) {
      for (uint32_t k = 0; k < 6; ++k) {
        solution[k] += rows[6 * i + k] * vectors[i][mode] * along / value;
      }
    }
  }
}

void ibvs_analytic_thrusts(const ibvs_controller *c, ibvs_real thrusts[IBVS_ROTORS]) {
  ibvs_real acceleration[6], error[LINE_ROWS], wrench[6], along = 0;
  memcpy(acceleration, c->secondary, sizeof acceleration);
  for (uint32_t i = 0; i < LINE_ROWS; ++i) {
    error[i] = c->line_targets[i];
    for (uint32_t k = 0; k < 6; ++k) {
      error[i] -= c->line_rows[6 * i + k] * c->secondary[k];
    }
  }
  apply_pseudo_inverse(c->line_rows, error, acceleration);
  for (uint32_t i = 0; i < 6; ++i) {
    wrench[i] = 0;
    for (uint32_t k = 0; k < 6; ++k) {
      wrench[i] += ibvs_mass_matrix[i][k] * acceleration[k];
    }
  }
  const ibvs_real *normal = &c->results[IBVS_OUT_NORMAL], weight = c->results[IBVS_OUT_CONTACT_WEIGHT];
  for (uint32_t i = 0; i < 3; ++i) {
    along += normal[i] * wrench[i] + c->results[IBVS_OUT_TURNING_LEVER + i] * acceleration[3 + i];
  }
  for (uint32_t i = 0; i < 6; ++i) {
    wrench[i] += i < 3 ? normal[i] * weight * (c->results[IBVS_OUT_PUSH_COMMAND] - along) : 0;
    wrench[i] -= c->results[IBVS_OUT_BIAS_WRENCH + i];
  }
  thrusts_of(wrench, thrusts);
}

/* Thrusts within a box whose wrench is nearest to that of `free`, by the program's active set: its cost is that of the
 * wrench, all rows but the thrusts' are far away. */
void ibvs_allocate(ibvs_controller *c, const ibvs_real *free, const ibvs_real *lower, const ibvs_real *upper,
                   ibvs_real thrusts[IBVS_ROTORS]) {
  ibvs_program *program = &c->program;
  ibvs_real x[IBVS_VARIABLES], y[IBVS_ROWS] = {0}, largest = 0;
  for (uint32_t column = 0; column < IBVS_VARIABLES; ++column) {
    const bool thrust = column < IBVS_ROTORS;
    program->unlimited[column] = thrust ? free[column] : 0;
    for (uint32_t k = ibvs_a_columns[column]; k < ibvs_a_columns[column + 1]; ++k) {
      program->a[k] = ibvs_a_rows[k] == column && thrust ? 1 : 0;
    }
    for (uint32_t k = ibvs_p_columns[column]; k < ibvs_p_columns[column + 1]; ++k) {
      program->p[k] = thrust ? 0 : 1;
      for (uint32_t i = 0; thrust && i < 6; ++i) {
        const ibvs_real weight = ibvs_allocation_weights[i] * ibvs_allocation_weights[i];
        program->p[k] += weight * ibvs_effectiveness[i][ibvs_p_rows[k]] * ibvs_effectiveness[i][column];
      }
      largest = r_fmax(largest, program->p[k]);
    }
  }
  for (uint32_t i = 0; i < IBVS_ROTORS; ++i) { /* redundant rotors; the diagonal ends a column of the upper triangle */
    program->p[ibvs_p_columns[i + 1] - 1] += REGULARISATION * largest;
  }
  for (uint32_t i = 0; i < IBVS_ROWS; ++i) {
    program->lower[i] = i < IBVS_ROTORS ? lower[i] : -INFINITY;
    program->upper[i] = i < IBVS_ROTORS ? upper[i] : INFINITY;
  }
  const bool found = ibvs_active_set(program, y, x);
  for (uint32_t i = 0; i < IBVS_ROTORS; ++i) {
    thrusts[i] = r_fmin(r_fmax(found ? x[i] : free[i], lower[i]), upper[i]);
  }
}
