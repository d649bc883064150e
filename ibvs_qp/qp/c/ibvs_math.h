/* Mathematical functions of the library's precision, and small dense systems. */
#ifndef IBVS_MATH_H
#define IBVS_MATH_H

#include <math.h>
#include <stdbool.h>
#include <stdint.h>

#include "ibvs_program_layout.h"

#if IBVS_FLOAT
#define R(x) x##f
#define r_sqrt sqrtf
#define r_fabs fabsf
#define r_fmax larger
#define r_fmin smaller
#define r_atan2 atan2f
#define r_asin asinf
#define r_sin sinf
#define r_cos cosf
#define r_tan tanf
#define r_acos acosf
#define r_atan atanf
#define r_exp expf
#define r_log logf
#define r_floor floorf
#else
#define R(x) x
#define r_sqrt sqrt
#define r_fabs fabs
#define r_fmax fmax
#define r_fmin fmin
#define r_atan2 atan2
#define r_asin asin
#define r_sin sin
#define r_cos cos
#define r_tan tan
#define r_acos acos
#define r_atan atan
#define r_exp exp
#define r_log log
#define r_floor floor
#endif

#if IBVS_FLOAT /* a third of the instructions of fmaxf, whose answer is a number where one argument is none */
__attribute__((noinline, unused)) static float larger(float x, float y) { return x > y ? x : y; }
__attribute__((noinline, unused)) static float smaller(float x, float y) { return x < y ? x : y; }
#endif

/* Whether all entries are finite. */
bool ibvs_finite(const ibvs_real *values, uint32_t count);

/* Root of a symmetric positive definite matrix, in its place; false where it is none. */
bool ibvs_cholesky(ibvs_real *matrix, uint32_t size);
void ibvs_cholesky_solve(const ibvs_real *root, uint32_t size, ibvs_real *vector);

#endif
