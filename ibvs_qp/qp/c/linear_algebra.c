/* Small dense systems. */
#include "ibvs_math.h"

bool ibvs_finite(const ibvs_real *values, uint32_t count) {
  for (uint32_t i = 0; i < count; ++i) {
    if (!isfinite(values[i])) {
      return false;
    }
  }
  return true;
}

bool ibvs_cholesky(ibvs_real *m, uint32_t n) {
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

void ibvs_cholesky_solve(const ibvs_real *root, uint32_t n, ibvs_real *x) {
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
