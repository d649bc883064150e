/* Mathematical functions of the library's precision. */
#ifndef IBVS_MATH_H
#define IBVS_MATH_H

#include <math.h>
#include <stdbool.h>
#include <stdint.h>

#include "ibvs_program_layout.h"

#if IBVS_FLOAT
#define R(x) x##f
#define OF_REAL(function) function##f
#define r_fmax larger
#define r_fmin smaller
#else
#define R(x) x
#define OF_REAL(function) function
#define r_fmax fmax
#define r_fmin fmin
#endif
#define r_sqrt OF_REAL(sqrt)
#define r_fabs OF_REAL(fabs)
#define r_atan2 OF_REAL(atan2)
#define r_asin OF_REAL(asin)
#define r_sin OF_REAL(sin)
#define r_cos OF_REAL(cos)
#define r_tan OF_REAL(tan)
#define r_acos OF_REAL(acos)
#define r_atan OF_REAL(atan)
#define r_exp OF_REAL(exp)
#define r_log OF_REAL(log)
#define r_pow OF_REAL(pow)
#define r_floor OF_REAL(floor)

#if IBVS_FLOAT /* a third of the instructions of fmaxf, whose answer is a number where one argument is none */
__attribute__((noinline, unused)) static float larger(float x, float y) { return x > y ? x : y; }
__attribute__((noinline, unused)) static float smaller(float x, float y) { return x < y ? x : y; }
#endif

/* Whether all entries are finite. */
bool ibvs_finite(const ibvs_real *values, uint32_t count);

#endif
