/* The tick: check, pack, evaluate, solve, fall back, command. */
#include "ibvs_internal.h"

uint32_t ibvs_size(void) { return (uint32_t)sizeof(ibvs_controller); }

void ibvs_init(ibvs_controller *c) {
  memset(c, 0, sizeof *c);
  c->gains = c->gains_in_force = ibvs_default_gains;
  ibvs_reset(c);
}

void ibvs_reset(ibvs_controller *c) {
  const ibvs_gains gains = c->gains, in_force = c->gains_in_force;
  memset(c, 0, sizeof *c);
  c->gains = gains;
  c->gains_in_force = in_force;
  ibvs_clock_reset(&c->clock);
  c->last = ibvs_first_measurement;
  c->reference = ibvs_first_reference;
  c->tick_ns = -1;
  memcpy(c->states, ibvs_start_states, sizeof c->states);
  memcpy(c->next_states, ibvs_start_states, sizeof c->next_states);
  c->inputs[IBVS_IN_GIVEN_NORMAL] = 1;
  c->inputs[IBVS_IN_PLANE + 2] = 1; /* a plane in front of the camera, for the equations */
  c->inputs[IBVS_IN_PLANE + 3] = -1;
  for (uint32_t i = 0; i < IBVS_LINES; ++i) {
    c->pairs[i] = -1;
  }
}

static void evaluate(ibvs_controller *c) {
  const ibvs_real *arguments[] = {c->inputs, c->states};
  ibvs_program *program = &c->program;
  ibvs_real *outputs[] = {c->next_states, c->finite,      c->results,         program->p, program->q,   program->a,
                          program->lower, program->upper, program->unlimited, c->free,    c->line_rows, c->line_targets,
                          c->secondary};
  if (isfinite(c->finite[0])) { /* the states stay where one of the next ones is not finite */
    memcpy(c->states, c->next_states, sizeof c->states);
  }
  ibvs_tick(arguments, outputs);
}

/* Whether the thrusts without limits pass a thrust limit, by noise or by more. */
static bool beyond_limits(const ibvs_controller *c) {
  for (uint32_t i = 0; i < IBVS_ROTORS; ++i) {
    if (c->free[i] < c->program.lower[i] || c->free[i] > c->program.upper[i]) {
      return true;
    }
  }
  return false;
}

static void wrench_of(const ibvs_real u[IBVS_ROTORS], ibvs_real wrench[6]) {
  for (uint32_t i = 0; i < 6; ++i) {
    wrench[i] = 0;
    for (uint32_t k = 0; k < IBVS_ROTORS; ++k) {
      wrench[i] += ibvs_effectiveness[i][k] * u[k];
    }
  }
}

/* Thrusts within the window, and their report. */
static void finish(ibvs_controller *c, const ibvs_real *free, const ibvs_real thrusts[IBVS_ROTORS], bool limited,
                   ibvs_command_result *command) {
  ibvs_real beyond[IBVS_ROTORS];
  c->unallocated = 0;
  for (uint32_t i = 0; i < IBVS_ROTORS; ++i) {
    command->thrusts[i] = thrusts[i];
    beyond[i] = limited ? free[i] - thrusts[i] : 0;
    c->change[i] = c->commanded ? thrusts[i] - c->thrusts[i] : c->change[i];
    c->thrusts[i] = thrusts[i];
  }
  c->commanded = true;
  wrench_of(thrusts, command->wrench);
  wrench_of(beyond, command->unallocated_wrench);
  for (uint32_t i = 0; i < 6; ++i) {
    c->unallocated = r_fmax(c->unallocated, r_fabs(command->unallocated_wrench[i]));
  }
}

/* Hover by the last inertial data within box and rate limit. */
static void hover(ibvs_controller *c, const ibvs_real *lower, const ibvs_real *upper, ibvs_command_result *command) {
  ibvs_real hold[IBVS_ROTORS], thrusts[IBVS_ROTORS];
  ibvs_hold_thrusts(c, hold);
  for (uint32_t i = 0; i < IBVS_ROTORS; ++i) {
    thrusts[i] = r_fmin(r_fmax(hold[i], lower[i]), upper[i]);
  }
  command->outcome = IBVS_HOLD;
  command->mode = IBVS_MODE_HOLD;
  finish(c, hold, thrusts, true, command);
}

/* Window of a tick without a measurement. */
static void pause(ibvs_controller *c, ibvs_command_result *command) {
  ibvs_real lower[IBVS_ROTORS], upper[IBVS_ROTORS];
  for (uint32_t i = 0; i < IBVS_ROTORS; ++i) {
    const ibvs_real floor = ibvs_thrust_floor[i], ceiling = ibvs_thrust_ceiling[i];
    lower[i] = c->commanded ? r_fmin(r_fmax(c->thrusts[i] - IBVS_RATE_STEP, floor), ceiling) : floor;
    upper[i] = c->commanded ? r_fmax(r_fmin(c->thrusts[i] + IBVS_RATE_STEP, ceiling), floor) : ceiling;
  }
  hover(c, lower, upper, command);
}

static void fall_back(ibvs_controller *c, ibvs_command_result *command) {
  const ibvs_real *lower = &c->results[IBVS_OUT_THRUST_LOWER], *upper = &c->results[IBVS_OUT_THRUST_UPPER];
  ibvs_real free[IBVS_ROTORS], thrusts[IBVS_ROTORS];
  if (!ibvs_finite(lower, IBVS_ROTORS) || !ibvs_finite(upper, IBVS_ROTORS)) {
    pause(c, command);
    return;
  }
  ibvs_analytic_thrusts(c, free);
  if (!ibvs_finite(free, IBVS_ROTORS)) {
    hover(c, lower, upper, command);
    return;
  }
  ibvs_allocate(c, free, lower, upper, thrusts);
  command->outcome = IBVS_ANALYTIC_FALLBACK;
  memset(command->multipliers, 0, sizeof command->multipliers);
  finish(c, free, thrusts, true, command);
}

void ibvs_follow(ibvs_controller *c, const ibvs_real *before, const ibvs_real *thrusts,
                 const ibvs_other_solution *other) {
  ibvs_command_result command;
  memcpy(c->thrusts, before, sizeof c->thrusts);
  finish(c, c->free, thrusts, c->unallocated > 0, &command);
  if (other != NULL) {
    ibvs_warm_start(&c->program, other->x, other->multipliers);
  }
}

/* Lines and plane of a turned camera in C. */
static void straighten(ibvs_measurement *m, uint32_t *rejected) {
  uint32_t kept = 0;
  for (uint32_t i = 0; i < m->line_count; ++i) {
    ibvs_line line = m->lines[i];
    if (ibvs_turn_line(&line.rho, &line.theta, &line.variance, line.covariance, line.theta_variance)) {
      m->lines[kept] = line;
      kept += 1;
    }
  }
  *rejected |= kept < m->line_count ? IBVS_REJECT_LINES : 0;
  m->line_count = kept;
  if (m->has_plane && !ibvs_turn_plane(m->plane)) {
    *rejected |= IBVS_REJECT_PLANE;
    m->has_plane = false;
  }
}

void ibvs_step_packed(ibvs_controller *c, ibvs_command_result *command) {
  ibvs_solution solution;
  evaluate(c);
  const bool in_contact = c->results[IBVS_OUT_CONTACT_TOUCHING] != 0;
  const bool press = c->inputs[IBVS_IN_REFERENCE_PRESS] != 0;
  command->mode = in_contact ? IBVS_MODE_CONTACT : (press ? IBVS_MODE_APPROACH : IBVS_MODE_FREE);
  command->wall_known = c->results[IBVS_OUT_CONTACT_KNOWN] != 0;
  command->distance = c->results[IBVS_OUT_CONTACT_DISTANCE];
  command->push = c->results[IBVS_OUT_CONTACT_PUSH];
  command->reach = c->results[IBVS_OUT_REACH];
  const bool solved = ibvs_solve(&c->program, &solution);
  command->iterations = solution.iterations > 0 ? solution.iterations : 0;
  if (!solved) {
    command->rejected |= IBVS_REJECT_PROGRAM;
    c->recovery = IBVS_RECOVERY_TICKS;
    if (solution.iterations >= 0) { /* data that is no program never reached OSQP */
      ibvs_program_reset(&c->program);
    }
  } else if (c->recovery > 0) {
    command->rejected |= IBVS_REJECT_RECOVERING;
    c->recovery -= 1;
  }
  if (solved && c->recovery == 0) {
    command->outcome = solution.outcome;
    for (uint32_t i = 0; i < IBVS_ROWS; ++i) {
      const ibvs_real multiplier = solution.multipliers[i];
      command->multipliers[i] = r_fabs(multiplier) > IBVS_ACTIVE_MULTIPLIER ? multiplier : 0;
    }
    finish(c, c->free, solution.thrusts, solution.limited || beyond_limits(c), command);
    return;
  }
  fall_back(c, command);
}

void ibvs_step(ibvs_controller *c, const ibvs_measurement *measurement, const ibvs_reference *reference,
               ibvs_command_result *command) {
  ibvs_measurement own;
  memset(command, 0, sizeof *command);
  command->stamp_ns = measurement->stamp_ns;
  const bool flown = ibvs_check_measurement(c, measurement, &own, &command->rejected);
  if (!ibvs_check_reference(c, reference)) {
    command->rejected |= IBVS_REJECT_REFERENCE;
  }
  if (!ibvs_check_gains(c)) {
    command->rejected |= IBVS_REJECT_GAINS;
  }
  if (!flown) {
    pause(c, command);
    return;
  }
  if (IBVS_TURNED_CAMERA && c->inputs[IBVS_IN_GIVEN] == 0) { /* those of the estimation are in C */
    straighten(&own, &command->rejected);
  }
  ibvs_pack(c, &own);
  ibvs_step_packed(c, command);
}
