/* Thrusts within a box whose wrench is nearest, by an active set; see allocation.least_squares. */
#include "ibvs_internal.h"

#define N IBVS_ROTORS
#define STEPS (8 * N)          /* of the active set; each adds or drops one rotor */
#define REGULARISATION (IBVS_FLOAT ? R(1e-6) : R(1e-10)) /* of redundant rotors, of the largest diagonal entry */

void ibvs_wrench(const ibvs_real u[N], ibvs_real wrench[6]) {
  for (uint32_t i = 0; i < 6; ++i) {
    wrench[i] = 0;
    for (uint32_t k = 0; k < N; ++k) {
      wrench[i] += ibvs_effectiveness[i][k] * u[k];
    }
  }
}

/* Gradient of 1/2 |W B (u - free)|^2. */
static void gradient(const ibvs_real hessian[N][N], const ibvs_real u[N], const ibvs_real free[N], ibvs_real g[N]) {
  for (uint32_t i = 0; i < N; ++i) {
    g[i] = 0;
    for (uint32_t k = 0; k < N; ++k) {
      g[i] += hessian[i][k] * (u[k] - free[k]);
    }
  }
}

/* Newton step of the rotors that are free to move. */
static bool newton(const ibvs_real hessian[N][N], const bool moves[N], const ibvs_real g[N], ibvs_real step[N]) {
  ibvs_real matrix[N * N], vector[N];
  uint32_t places[N], n = 0;
  for (uint32_t i = 0; i < N; ++i) {
    step[i] = 0;
    if (moves[i]) {
      places[n] = i;
      n += 1;
    }
  }
  for (uint32_t i = 0; i < n; ++i) {
    vector[i] = -g[places[i]];
    for (uint32_t j = 0; j < n; ++j) {
      matrix[i * n + j] = hessian[places[i]][places[j]];
    }
  }
  if (n == 0 || !ibvs_cholesky(matrix, n)) {
    return false;
  }
  ibvs_cholesky_solve(matrix, n, vector);
  for (uint32_t i = 0; i < n; ++i) {
    step[places[i]] = vector[i];
  }
  return true;
}

void ibvs_allocate(const ibvs_real free[N], const ibvs_real *lower, const ibvs_real *upper, ibvs_real u[N]) {
  ibvs_real hessian[N][N], g[N], step[N], largest = 0;
  bool moves[N], clipped = false;
  for (uint32_t i = 0; i < N; ++i) {
    for (uint32_t k = 0; k < N; ++k) {
      hessian[i][k] = 0;
      for (uint32_t row = 0; row < 6; ++row) {
        const ibvs_real weight = ibvs_allocation_weights[row] * ibvs_allocation_weights[row];
        hessian[i][k] += weight * ibvs_effectiveness[row][i] * ibvs_effectiveness[row][k];
      }
    }
    largest = r_fmax(largest, hessian[i][i]);
    u[i] = r_fmin(r_fmax(free[i], lower[i]), upper[i]);
    moves[i] = u[i] == free[i];
    clipped = clipped || !moves[i];
  }
  for (uint32_t i = 0; i < N; ++i) {
    hessian[i][i] += REGULARISATION * largest;
  }
  for (uint32_t k = 0; clipped && k < STEPS; ++k) {
    gradient(hessian, u, free, g);
    ibvs_real share = 1;
    uint32_t blocked = N;
    if (newton(hessian, moves, g, step)) {
      for (uint32_t i = 0; i < N; ++i) {
        const ibvs_real end = u[i] + step[i], bound = step[i] > 0 ? upper[i] : lower[i];
        if (moves[i] && (step[i] > 0 ? end > bound : end < bound) && (bound - u[i]) / step[i] < share) {
          share = (bound - u[i]) / step[i];
          blocked = i;
        }
      }
      for (uint32_t i = 0; i < N; ++i) {
        u[i] = r_fmin(r_fmax(u[i] + share * step[i], lower[i]), upper[i]);
      }
    }
    if (blocked < N) {
      u[blocked] = step[blocked] > 0 ? upper[blocked] : lower[blocked]; /* without rounding */
      moves[blocked] = false;
      continue;
    }
    gradient(hessian, u, free, g);
    ibvs_real most = REGULARISATION * largest;
    for (uint32_t i = 0; i < N; ++i) { /* the bound that holds back the most */
      const ibvs_real pull = u[i] <= lower[i] ? -g[i] : g[i];
      if (!moves[i] && pull > most) {
        most = pull;
        blocked = i;
      }
    }
    if (blocked == N) {
      return;
    }
    moves[blocked] = true;
  }
}
