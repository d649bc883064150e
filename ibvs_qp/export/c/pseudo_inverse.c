/* A truncated pseudo-inverse by the eigenvalues of L L'. */
#include "ibvs_internal.h"

#define LINE_ROWS (IBVS_LINES + 1)
#define SWEEPS 12 /* of Jacobi's method: 3 x 3 converges in 5 */

/* Jacobi's rotations: a becomes diagonal, the columns of v its eigenvectors. */
static void eigenvectors(ibvs_real a[LINE_ROWS][LINE_ROWS], ibvs_real v[LINE_ROWS][LINE_ROWS], uint32_t n) {
  for (uint32_t i = 0; i < n; ++i) {
    for (uint32_t j = 0; j < n; ++j) {
      v[i][j] = i == j ? 1 : 0;
    }
  }
  for (uint32_t sweep = 0; sweep < SWEEPS; ++sweep) {
    for (uint32_t p = 0; p + 1 < n; ++p) {
      for (uint32_t q = p + 1; q < n; ++q) {
        if (a[p][q] == 0) {
          continue;
        }
        const ibvs_real ratio = (a[q][q] - a[p][p]) / (2 * a[p][q]);
        const ibvs_real t = (ratio >= 0 ? 1 : -1) / (r_fabs(ratio) + r_sqrt(ratio * ratio + 1));
        const ibvs_real cosine = 1 / r_sqrt(t * t + 1), sine = t * cosine;
        for (uint32_t k = 0; k < n; ++k) {
          const ibvs_real x = a[k][p], y = a[k][q];
          a[k][p] = cosine * x - sine * y;
          a[k][q] = sine * x + cosine * y;
        }
        for (uint32_t k = 0; k < n; ++k) {
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

/* solution += L^+ values, with singular values below IBVS_RANK_TOLERANCE of the largest dropped. */
void ibvs_apply_pseudo_inverse(const ibvs_real *rows, uint32_t count, ibvs_real *values, ibvs_real solution[6]) {
  ibvs_real square[LINE_ROWS][LINE_ROWS], vectors[LINE_ROWS][LINE_ROWS], largest = 0;
  for (uint32_t i = 0; i < count; ++i) {
    for (uint32_t j = 0; j < count; ++j) {
      square[i][j] = 0;
      for (uint32_t k = 0; k < 6; ++k) {
        square[i][j] += rows[6 * i + k] * rows[6 * j + k];
      }
    }
  }
  eigenvectors(square, vectors, count);
  for (uint32_t i = 0; i < count; ++i) {
    largest = r_fmax(largest, square[i][i]);
  }
  for (uint32_t mode = 0; mode < count; ++mode) {
    const ibvs_real least = IBVS_RANK_TOLERANCE * IBVS_RANK_TOLERANCE * largest, value = square[mode][mode];
    if (!(value > least)) {
      continue;
    }
    ibvs_real along = 0;
    for (uint32_t i = 0; i < count; ++i) {
      along += vectors[i][mode] * values[i];
    }
    for (uint32_t i = 0; i < count; ++i) {
      for (uint32_t k = 0; k < 6; ++k) {
        solution[k] += rows[6 * i + k] * vectors[i][mode] * along / value;
      }
    }
  }
}
