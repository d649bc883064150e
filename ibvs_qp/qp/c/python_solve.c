/* One solve from the arrays of Python; not part of the exported library. */
#include <string.h>

#include "ibvs_program.h"

uint32_t ibvs_program_size(void) { return (uint32_t)sizeof(ibvs_program); }

/* values: p, q, a, lower, upper, unlimited. */
bool ibvs_solve_values(ibvs_program *program, const ibvs_real *const values[6], ibvs_solution *solution) {
  memcpy(program->p, values[0], sizeof program->p);
  memcpy(program->q, values[1], sizeof program->q);
  memcpy(program->a, values[2], sizeof program->a);
  memcpy(program->lower, values[3], sizeof program->lower);
  memcpy(program->upper, values[4], sizeof program->upper);
  memcpy(program->unlimited, values[5], sizeof program->unlimited);
  return ibvs_solve(program, solution);
}
