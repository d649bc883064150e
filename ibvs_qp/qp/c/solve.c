/* OSQP at every tick, and the acceptance test of its answer; see ibvs_qp.qp.solvers.osqp and ibvs_qp.qp.accept. */
#include <string.h>

#include "ibvs_math.h"
#include "ibvs_program.h"

#define BLOCK_TRIES 2 /* changes of all wrong rows that may leave their number as it is */

bool ibvs_finite(const ibvs_real *values, uint32_t count) {
  for (uint32_t i = 0; i < count; ++i) {
    if (!isfinite(values[i])) {
      return false;
    }
  }
  return true;
}

/* Root of a symmetric positive definite matrix, in its place; false where it is none. */
static bool cholesky(ibvs_real *m, uint32_t n) {
  for (uint32_t j = 0; j < n; ++j) {
    for (uint32_t i = j; i < n; ++i) {
      ibvs_real sum = m[i * n + j];
      for (uint32_t k = 0; k < j; ++k) {
        sum -= m[i * n + k] * m[j * n + k];
      }
      if (i == j) {
        if (!(sum > 0)) {
          return false;
        }
        m[i * n + j] = r_sqrt(sum);
      } else {
        m[i * n + j] = sum / m[j * n + j];
      }
    }
  }
  return true;
}

static void cholesky_solve(const ibvs_real *root, uint32_t n, ibvs_real *x) {
  for (uint32_t i = 0; i < n; ++i) {
    for (uint32_t k = 0; k < i; ++k) {
      x[i] -= root[i * n + k] * x[k];
    }
    x[i] /= root[i * n + i];
  }
  for (uint32_t i = n; i-- > 0;) {
    for (uint32_t k = i + 1; k < n; ++k) {
      x[i] -= root[k * n + i] * x[k];
    }
    x[i] /= root[i * n + i];
  }
}

static bool good_data(const ibvs_program *program) {
  if (!ibvs_finite(program->p, IBVS_P_NONZEROS) || !ibvs_finite(program->q, IBVS_VARIABLES) ||
      !ibvs_finite(program->a, IBVS_A_NONZEROS) || !ibvs_finite(program->lower, IBVS_ROWS) || !ibvs_finite(program->upper, IBVS_ROWS)) {
    return false; /* one NaN would stay in the warm start */
  }
  for (uint32_t i = 0; i < IBVS_ROWS; ++i) {
    if (program->lower[i] > program->upper[i]) {
      return false; /* such an update would be dropped silently */
    }
  }
  return true;
}

static void fill_hessian(const ibvs_program *program, ibvs_real matrix[IBVS_VARIABLES * IBVS_VARIABLES]) {
  memset(matrix, 0, IBVS_VARIABLES * IBVS_VARIABLES * sizeof *matrix);
  for (uint32_t column = 0; column < IBVS_VARIABLES; ++column) {
    for (uint32_t k = ibvs_p_columns[column]; k < ibvs_p_columns[column + 1]; ++k) {
      matrix[ibvs_p_rows[k] * IBVS_VARIABLES + column] = matrix[column * IBVS_VARIABLES + ibvs_p_rows[k]] = program->p[k];
    }
  }
}

static void fill_row(const ibvs_program *program, uint32_t row, ibvs_real values[IBVS_VARIABLES]) {
  for (uint32_t column = 0; column < IBVS_VARIABLES; ++column) {
    values[column] = 0;
    for (uint32_t k = ibvs_a_columns[column]; k < ibvs_a_columns[column + 1]; ++k) {
      values[column] += ibvs_a_rows[k] == row ? program->a[k] : 0;
    }
  }
}

/* A x. */
static void row_values(const ibvs_program *program, const ibvs_real x[IBVS_VARIABLES], ibvs_real at[IBVS_ROWS]) {
  memset(at, 0, IBVS_ROWS * sizeof *at);
  for (uint32_t column = 0; column < IBVS_VARIABLES; ++column) {
    for (uint32_t k = ibvs_a_columns[column]; k < ibvs_a_columns[column + 1]; ++k) {
      at[ibvs_a_rows[k]] += program->a[k] * x[column];
    }
  }
}

/* Length of every row of A, 1 for one without entries, of its first `variables` columns. */
static void row_lengths(const ibvs_program *program, uint32_t variables, ibvs_real length[IBVS_ROWS]) {
  memset(length, 0, IBVS_ROWS * sizeof *length);
  for (uint32_t k = 0; k < ibvs_a_columns[variables]; ++k) {
    length[ibvs_a_rows[k]] += program->a[k] * program->a[k];
  }
  for (uint32_t i = 0; i < IBVS_ROWS; ++i) {
    length[i] = length[i] > 0 ? r_sqrt(length[i]) : 1;
  }
}

/* The minimiser with the rows of `side` at their bounds, by Cholesky factors of P. With x_0 the solution without limits
 * and S the active rows at their bounds b,
 *   (A_S P^-1 A_S') y = A_S x_0 - b,  x = x_0 - P^-1 A_S' y.
 * along: P^-1 A_i' of every row that was active so far, across: A P^-1 A_i'; known: for which rows they are there. */
static bool solve_active(const ibvs_program *program, const ibvs_real *root, const int8_t side[IBVS_ROWS],
                         ibvs_real along[IBVS_ROWS][IBVS_VARIABLES], ibvs_real across[IBVS_ROWS][IBVS_ROWS],
                         bool known[IBVS_ROWS], ibvs_real x[IBVS_VARIABLES], ibvs_real y[IBVS_ROWS]) {
  ibvs_real square[IBVS_VARIABLES * IBVS_VARIABLES], at[IBVS_ROWS], level[IBVS_VARIABLES];
  uint32_t active[IBVS_VARIABLES], count = 0;
  for (uint32_t i = 0; i < IBVS_ROWS; ++i) {
    y[i] = 0;
    if (side[i] == 0) {
      continue;
    }
    if (count == IBVS_VARIABLES) {
      return false;
    }
    if (!known[i]) {
      fill_row(program, i, along[i]);
      cholesky_solve(root, IBVS_VARIABLES, along[i]);
      row_values(program, along[i], across[i]);
      known[i] = true;
    }
    active[count] = i;
    count += 1;
  }
  memcpy(x, program->unlimited, IBVS_VARIABLES * sizeof *x);
  row_values(program, x, at);
  for (uint32_t i = 0; i < count; ++i) {
    level[i] = at[active[i]] - (side[active[i]] > 0 ? program->upper[active[i]] : program->lower[active[i]]);
  }
  for (uint32_t j = 0; j < count; ++j) {
    for (uint32_t i = 0; i < count; ++i) {
      square[i * count + j] = across[active[j]][active[i]];
    }
  }
  if (!cholesky(square, count)) {
    return false;
  }
  cholesky_solve(square, count, level);
  for (uint32_t i = 0; i < count; ++i) {
    y[active[i]] = level[i];
    for (uint32_t k = 0; k < IBVS_VARIABLES; ++k) {
      x[k] -= along[active[i]][k] * level[i];
    }
  }
  return true;
}

static bool any_side(const int8_t side[IBVS_ROWS]) {
  bool any = false;
  for (uint32_t i = 0; i < IBVS_ROWS; ++i) {
    any = any || side[i] != 0;
  }
  return any;
}

/* Where a row belongs: its side unless its multiplier has the wrong sign, or the side on which it is violated. */
static int8_t side_of(const ibvs_program *program, uint32_t row, int8_t side, ibvs_real at, ibvs_real multiplier,
                      ibvs_real slip) {
  if (side != 0) {
    return multiplier * side < 0 ? 0 : side;
  }
  return at > program->upper[row] + slip ? 1 : (at < program->lower[row] - slip ? -1 : 0);
}

/* The exact solution, from multipliers near it, by block principal pivoting (Judice and Pires, 1994): all rows that are
 * on the wrong side change it at once; where that does not reduce their number, only the last of them, which ends for
 * every positive definite program. Where the iteration stopped early it takes OSQP's place; in single precision it
 * leaves a tenth of the rounding errors. False where IBVS_PASSES do not suffice. */
bool ibvs_active_set(const ibvs_program *program, ibvs_real y[IBVS_ROWS], ibvs_real x[IBVS_VARIABLES]) {
  ibvs_real root[IBVS_VARIABLES * IBVS_VARIABLES], along[IBVS_ROWS][IBVS_VARIABLES], across[IBVS_ROWS][IBVS_ROWS];
  ibvs_real at[IBVS_ROWS], length[IBVS_ROWS];
  bool known[IBVS_ROWS] = {false}, factored = false;
  int8_t side[IBVS_ROWS], next[IBVS_ROWS];
  uint32_t fewest = IBVS_ROWS + 1, tries = BLOCK_TRIES;
  for (uint32_t i = 0; i < IBVS_ROWS; ++i) {
    side[i] = r_fabs(y[i]) > IBVS_ACTIVE_MULTIPLIER ? (y[i] > 0 ? 1 : -1) : 0;
  }
  row_lengths(program, IBVS_VARIABLES, length);
  fill_hessian(program, root);
  for (uint32_t pass = 0; pass < IBVS_PASSES; ++pass) {
    const bool needed = any_side(side);
    if ((needed && !factored && !cholesky(root, IBVS_VARIABLES)) ||
        !solve_active(program, root, side, along, across, known, x, y)) {
      return false;
    }
    factored = factored || needed;
    row_values(program, x, at);
    uint32_t wrong = 0, last = 0;
    for (uint32_t i = 0; i < IBVS_ROWS; ++i) {
      next[i] = side_of(program, i, side[i], at[i], y[i], IBVS_REFINED_SLIP * length[i]);
      if (next[i] != side[i]) {
        wrong += 1;
        last = i;
      }
    }
    if (wrong == 0) {
      return true;
    }
    if (wrong < fewest) {
      fewest = wrong;
      tries = BLOCK_TRIES;
    }
    if (tries > 0) {
      tries -= 1;
      memcpy(side, next, sizeof side);
    } else {
      side[last] = next[last];
    }
  }
  return false;
}

/* Largest violation of a hard row [N of thrust]. */
static ibvs_real primal_residual(const ibvs_program *program, const ibvs_real *x) {
  ibvs_real at[IBVS_ROWS], length[IBVS_ROWS], slip = 0;
  row_values(program, x, at);
  row_lengths(program, IBVS_ROTORS, length);
  for (uint32_t i = 0; i < IBVS_ROWS; ++i) {
    if (!ibvs_soft_rows[i]) {
      slip = r_fmax(slip, r_fmax(program->lower[i] - at[i], at[i] - program->upper[i]) / length[i]);
    }
  }
  return slip;
}

/* Largest entry of x + P^-1 (q + A' y) [N]. */
static ibvs_real dual_residual(const ibvs_program *program, const ibvs_real *x, const ibvs_real *y) {
  ibvs_real matrix[IBVS_VARIABLES * IBVS_VARIABLES], vector[IBVS_VARIABLES], largest = 0;
  fill_hessian(program, matrix);
  for (uint32_t column = 0; column < IBVS_VARIABLES; ++column) {
    vector[column] = program->q[column];
    for (uint32_t k = ibvs_a_columns[column]; k < ibvs_a_columns[column + 1]; ++k) {
      vector[column] += program->a[k] * y[ibvs_a_rows[k]];
    }
  }
  if (!cholesky(matrix, IBVS_VARIABLES)) {
    return INFINITY;
  }
  cholesky_solve(matrix, IBVS_VARIABLES, vector);
  for (uint32_t i = 0; i < IBVS_VARIABLES; ++i) {
    largest = r_fmax(largest, r_fabs(x[i] + vector[i]));
  }
  return largest;
}

static bool accepted(const ibvs_program *program, const OSQPSolver *solver, ibvs_outcome *outcome) {
  const ibvs_real *x = solver->solution->x, *y = solver->solution->y;
  switch (solver->info->status_val) { /* first: the iterate of an infeasible program is a finite number */
    case OSQP_SOLVED:
      *outcome = IBVS_SOLVED;
      break;
    case OSQP_SOLVED_INACCURATE:
      *outcome = IBVS_INACCURATE_ACCEPTED;
      break;
    case OSQP_MAX_ITER_REACHED:
      *outcome = IBVS_CAPPED_ACCEPTED;
      break;
    default:
      return false;
  }
  if (!ibvs_finite(x, IBVS_VARIABLES) || !ibvs_finite(y, IBVS_ROWS)) {
    return false;
  }
  const ibvs_real slip = primal_residual(program, x);
  if (*outcome == IBVS_SOLVED) {
    return slip <= IBVS_BOUND_SLIP;
  }
  return slip <= IBVS_ACCEPT_RESIDUAL && dual_residual(program, x, y) <= IBVS_ACCEPT_RESIDUAL;
}

/* Whether the status means that there is an iterate. */
static bool has_iterate(const OSQPSolver *solver) {
  const OSQPInt status = solver->info->status_val;
  return status == OSQP_SOLVED || status == OSQP_SOLVED_INACCURATE || status == OSQP_MAX_ITER_REACHED;
}

static bool any_active(const ibvs_real multipliers[IBVS_ROWS]) {
  bool active = false;
  for (uint32_t i = 0; i < IBVS_ROWS; ++i) {
    active = active || r_fabs(multipliers[i]) > IBVS_ACTIVE_MULTIPLIER;
  }
  return active;
}

void ibvs_warm_start(ibvs_program *program, const ibvs_real *x, const ibvs_real *multipliers) {
  (void)osqp_warm_start(&program->solver.solver, x, multipliers);
  program->limited = any_active(multipliers);
}

void ibvs_program_reset(ibvs_program *program) { program->ready = program->limited = false; }

/* The program's data into OSQP; false where it is no program. */
static bool load(ibvs_program *program) {
  if (!good_data(program)) {
    return false;
  }
  OSQPSolver *solver = &program->solver.solver;
  if (!program->ready) {
    (void)ibvs_solver_start(&program->solver);
    program->ready = true;
  }
  if (osqp_update_data_vec(solver, program->q, program->lower, program->upper) != 0 ||
      osqp_update_data_mat(solver, program->p, NULL, IBVS_P_NONZEROS, program->a, NULL, IBVS_A_NONZEROS) != 0) {
    ibvs_program_reset(program);
    return false;
  }
  return true;
}

static bool solve_loaded(ibvs_program *program, ibvs_solution *solution) {
  const ibvs_real no_multipliers[IBVS_ROWS] = {0};
  OSQPSolver *solver = &program->solver.solver;
  if (!program->limited && ibvs_finite(program->unlimited, IBVS_VARIABLES)) {
    (void)osqp_warm_start(solver, program->unlimited, no_multipliers);
  }
  (void)osqp_solve(solver);
  solution->iterations = (int32_t)solver->info->iter;
  const ibvs_real *x = solver->solution->x, *y = solver->solution->y;
  const bool good = accepted(program, solver, &solution->outcome);
  const bool sound = ibvs_finite(y, IBVS_ROWS) && has_iterate(solver);
  memcpy(solution->multipliers, y, sizeof solution->multipliers);
  if (sound && (IBVS_FLOAT || !good) && ibvs_active_set(program, solution->multipliers, solution->x)) {
    solution->outcome = good ? solution->outcome : IBVS_REFINED;
    if (!good) { /* OSQP continues from the exact solution, as in Python */
      ibvs_warm_start(program, solution->x, solution->multipliers);
    }
  } else if (good) {
    memcpy(solution->multipliers, y, sizeof solution->multipliers);
    memcpy(solution->x, x, sizeof solution->x);
  } else {
    return false;
  }
  program->limited = solution->limited = any_active(solution->multipliers);
  for (uint32_t i = 0; i < IBVS_ROTORS; ++i) {
    solution->thrusts[i] = r_fmin(r_fmax(solution->x[i], program->lower[i]), program->upper[i]);
  }
  return true;
}

bool ibvs_solve(ibvs_program *program, ibvs_solution *solution) {
  solution->iterations = -1;
  return load(program) && solve_loaded(program, solution);
}

bool ibvs_solve_from(ibvs_program *program, const ibvs_real *x, const ibvs_real *multipliers, ibvs_real rho,
                     ibvs_solution *solution) {
  solution->iterations = -1;
  ibvs_program_reset(program);
  if (!load(program)) {
    return false;
  }
  (void)osqp_update_rho(&program->solver.solver, rho);
  ibvs_warm_start(program, x, multipliers);
  return solve_loaded(program, solution);
}

uint32_t ibvs_program_size(void) { return (uint32_t)sizeof(ibvs_program); }

ibvs_real ibvs_step_size(const ibvs_program *program) {
  return program->ready ? program->solver.solver.settings->rho : 0;
}

bool ibvs_solve_values(ibvs_program *program, const ibvs_real *const values[6], const ibvs_real *start,
                       ibvs_solution *solution) {
  memcpy(program->p, values[0], sizeof program->p);
  memcpy(program->q, values[1], sizeof program->q);
  memcpy(program->a, values[2], sizeof program->a);
  memcpy(program->lower, values[3], sizeof program->lower);
  memcpy(program->upper, values[4], sizeof program->upper);
  memcpy(program->unlimited, values[5], sizeof program->unlimited);
  if (start != NULL) {
    const ibvs_real *multipliers = start + IBVS_VARIABLES;
    return ibvs_solve_from(program, start, multipliers, multipliers[IBVS_ROWS], solution);
  }
  return ibvs_solve(program, solution);
}
