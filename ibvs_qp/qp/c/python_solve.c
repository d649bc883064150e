/* One solve from the arrays of Python; not part of the exported library. */
#include <string.h>

#include "ibvs_program.h"

uint32_t ibvs_program_size(void) { return (uint32_t)sizeof(ibvs_program); }

/* Step size; 0 before the first solve. */
ibvs_real ibvs_step_size(const ibvs_program *program) {
  return program->ready ? program->solver.solver.settings->rho : 0;
}

/* values: p, q, a, lower, upper, unlimited; start: NULL, or x, multipliers and step size to begin anew from. */
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
