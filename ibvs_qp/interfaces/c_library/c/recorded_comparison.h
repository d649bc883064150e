/* Recorded ticks compared with Python: by thrusts where they are unique, else by wrench and cost. */
#ifndef IBVS_RECORDED_COMPARISON_H
#define IBVS_RECORDED_COMPARISON_H

#include <math.h>
#include <stdio.h>

#include "ibvs_internal.h"

#define WRENCH_TOLERANCE 1e-6 /* [N], [N m] */
#define COST_TOLERANCE 1e-9   /* of the cost [-] */
#define EARLY_TOLERANCE 2e-3  /* of thrusts where OSQP stopped early and the acceptance test took its answer [N] */
#define EARLY_SHARE 1e-3      /* ticks with such a difference, of all [-] */

typedef struct {
  uint32_t ticks, wrong, early, apart; /* wrong: beyond its tolerance; early: stopped early; apart: those beyond it */
  double thrust, wrench, cost, apart_thrust; /* largest differences */
} comparison;

/* Cost of thrusts with the least slacks. */
static double cost_of(const ibvs_program *program, const ibvs_real thrusts[IBVS_ROTORS]) {
  double x[IBVS_VARIABLES], at[IBVS_ROWS] = {0}, cost = 0;
  for (uint32_t column = 0; column < IBVS_VARIABLES; ++column) {
    const uint32_t row = ibvs_a_rows[ibvs_a_columns[column]]; /* of a slack: its only one */
    const double above = at[row] - (double)program->upper[row], below = at[row] - (double)program->lower[row];
    x[column] = column < IBVS_ROTORS ? (double)thrusts[column] : fmax(above, 0) + fmin(below, 0);
    for (uint32_t k = ibvs_a_columns[column]; column < IBVS_ROTORS && k < ibvs_a_columns[column + 1]; ++k) {
      at[ibvs_a_rows[k]] += (double)program->a[k] * x[column];
    }
    cost += (double)program->q[column] * x[column];
    for (uint32_t k = ibvs_p_columns[column]; k < ibvs_p_columns[column + 1]; ++k) {
      cost += (ibvs_p_rows[k] == column ? 0.5 : 1.0) * (double)program->p[k] * x[ibvs_p_rows[k]] * x[column];
    }
  }
  return cost;
}

static void compare(comparison *all, const ibvs_controller *c, const ibvs_command_result *command,
                    const ibvs_real python[IBVS_ROTORS], double tolerance) {
  const double expected = cost_of(&c->program, python);
  const double cost = fabs(cost_of(&c->program, command->thrusts) - expected) / fabs(expected);
  double thrust = 0, wrench = 0;
  for (uint32_t k = 0; k < IBVS_ROTORS; ++k) {
    thrust = fmax(thrust, fabs((double)(command->thrusts[k] - python[k])));
  }
  for (uint32_t i = 0; i < 6; ++i) {
    double sum = 0;
    for (uint32_t k = 0; k < IBVS_ROTORS; ++k) {
      sum += (double)ibvs_effectiveness[i][k] * (double)(command->thrusts[k] - python[k]);
    }
    wrench = fmax(wrench, fabs(sum));
  }
  const bool close = IBVS_UNIQUE_THRUSTS ? thrust <= tolerance : wrench <= WRENCH_TOLERANCE && cost <= COST_TOLERANCE;
  const bool early = command->outcome == IBVS_INACCURATE_ACCEPTED || command->outcome == IBVS_CAPPED_ACCEPTED;
  all->ticks += 1;
  all->early += early ? 1 : 0;
  if (early && !close) {
    all->apart += 1;
    all->apart_thrust = fmax(all->apart_thrust, thrust);
  } else { /* fmax leaves out NaN */
    all->wrong += close && ibvs_finite(command->thrusts, IBVS_ROTORS) ? 0 : 1;
    all->thrust = fmax(all->thrust, thrust);
    all->wrench = fmax(all->wrench, wrench);
    all->cost = fmax(all->cost, cost);
  }
}

/* Whether the ticks agree; prints them. */
static bool agrees(const comparison *all, const char *kind, double tolerance) {
  const double early = (double)all->early / all->ticks, apart = (double)all->apart / all->ticks;
  const bool good = all->wrong == 0 && apart < EARLY_SHARE && all->apart_thrust <= EARLY_TOLERANCE;
  printf("%s: %u %s, %u beyond their tolerance\n", good ? "passed" : "FAILED", (unsigned)all->ticks, kind,
         (unsigned)all->wrong);
  if (IBVS_UNIQUE_THRUSTS) {
    printf("  thrusts within %.3g N of %.3g N\n", all->thrust, tolerance);
  } else {
    printf("  wrench within %.3g of %.3g N and N m, cost within %.3g of %.3g; thrusts share a wrench, within %.3g N\n",
           all->wrench, WRENCH_TOLERANCE, all->cost, COST_TOLERANCE, all->thrust);
  }
  printf("  OSQP stopped early in %u (%.2g %%); %u (%.2g %% of less than %.2g %%) farther apart, within %.3g of %.3g N\n",
         (unsigned)all->early, 100 * early, (unsigned)all->apart, 100 * apart, 100 * EARLY_SHARE, all->apart_thrust,
         EARLY_TOLERANCE);
  return good;
}

#endif
