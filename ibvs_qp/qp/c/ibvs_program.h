/* The program of one tick, min 1/2 x'Px + q'x with lower <= A x <= upper, OSQP's instance, and the answer. */
#ifndef IBVS_PROGRAM_H
#define IBVS_PROGRAM_H

#include <stdbool.h>
#include <stdint.h>

#include "ibvs_program_layout.h"
#include "ibvs_solver_workspace.h"

/* How the thrusts were found. */
typedef enum {
  IBVS_SOLVED = 0,              /* optimal */
  IBVS_INACCURATE_ACCEPTED = 1, /* OSQP stopped early, residuals within bounds */
  IBVS_CAPPED_ACCEPTED = 2,     /* iteration bound, residuals within bounds */
  IBVS_ANALYTIC_FALLBACK = 3,   /* analytic law within the limits */
  IBVS_HOLD = 4,                /* hover by the last inertial data */
  IBVS_REFINED = 5              /* OSQP stopped early; solved on its active set */
} ibvs_outcome;

/* One instance. */
typedef struct {
  ibvs_real p[IBVS_P_NONZEROS], q[IBVS_VARIABLES], a[IBVS_A_NONZEROS], lower[IBVS_ROWS], upper[IBVS_ROWS];
  ibvs_real unlimited[IBVS_VARIABLES]; /* solution without any row, noise at the limits clipped */
  ibvs_solver_workspace solver;
  bool ready, limited;                 /* limited: a row was active at the last solution */
} ibvs_program;

typedef struct {
  ibvs_real thrusts[IBVS_ROTORS];  /* within their bounds [N] */
  ibvs_real x[IBVS_VARIABLES];
  ibvs_real multipliers[IBVS_ROWS];
  ibvs_outcome outcome;
  int32_t iterations;              /* of OSQP; -1 where the data is no program */
  bool limited;                    /* a row is active */
} ibvs_solution;

/* The solution of the program's data; false where the data is no program, or no answer passes the acceptance test. */
bool ibvs_solve(ibvs_program *program, ibvs_solution *solution);

/* The same with OSQP set up anew from an iterate and a step size: continues another instance's solves. */
bool ibvs_solve_from(ibvs_program *program, const ibvs_real *x, const ibvs_real *multipliers, ibvs_real rho,
                     ibvs_solution *solution);

/* Step size of OSQP; 0 before the first solve. */
ibvs_real ibvs_step_size(const ibvs_program *program);

/* The same from arrays elsewhere, p, q, a, lower, upper, unlimited, for callers without this header; start: NULL, or x,
 * multipliers and step size to begin anew from. */
uint32_t ibvs_program_size(void);
bool ibvs_solve_values(ibvs_program *program, const ibvs_real *const values[6], const ibvs_real *start,
                       ibvs_solution *solution);

/* The exact solution by an active set, from multipliers near those of the solution; false where it is not found. */
bool ibvs_active_set(const ibvs_program *program, ibvs_real multipliers[IBVS_ROWS], ibvs_real x[IBVS_VARIABLES]);
/* Drop the iterate and the adapted step size. */
void ibvs_program_reset(ibvs_program *program);

/* Start the next solve from an iterate. */
void ibvs_warm_start(ibvs_program *program, const ibvs_real *x, const ibvs_real *multipliers);

/* Generated (ibvs_program_tables.c, ibvs_solver_workspace.c). */
extern const uint8_t ibvs_p_columns[IBVS_VARIABLES + 1], ibvs_p_rows[IBVS_P_NONZEROS];
extern const uint8_t ibvs_a_columns[IBVS_VARIABLES + 1], ibvs_a_rows[IBVS_A_NONZEROS];
extern const bool ibvs_soft_rows[IBVS_ROWS];
OSQPSolver *ibvs_solver_start(ibvs_solver_workspace *workspace);

#endif
