/* Broken inputs for the tests, and the check of the thrusts that follow. */
#ifndef IBVS_BROKEN_INPUTS_H
#define IBVS_BROKEN_INPUTS_H

#include "ibvs_internal.h"

#define ROUNDING ((ibvs_real)1e-4) /* of the rate limit [N] */

static uint64_t seed = UINT64_C(0x9E3779B97F4A7C15);

static uint32_t below(uint32_t end) { /* xorshift */
  seed ^= seed << 13;
  seed ^= seed >> 7;
  seed ^= seed << 17;
  return (uint32_t)(seed >> 33) % end;
}

static ibvs_real broken_number(ibvs_real value) {
  const ibvs_real numbers[] = {(ibvs_real)NAN, (ibvs_real)INFINITY, -(ibvs_real)INFINITY, (ibvs_real)1e30,
                               (ibvs_real)-1e30, 0, (ibvs_real)1e-40, -value, value * 1000, value + 1};
  return numbers[below(sizeof numbers / sizeof numbers[0])];
}

static int64_t broken_stamp(int64_t value) {
  const int64_t stamps[] = {0, -1, INT64_MIN, INT64_MAX, IBVS_STAMP_END - 1};
  const int64_t steps[] = {500000000, -500000000, INT64_C(5000000000), 1, -1};
  const uint32_t choice = below(10);
  if (choice < 5) {
    return stamps[choice];
  }
  return value > -IBVS_STAMP_END && value < IBVS_STAMP_END ? value + steps[choice - 5] : 0;
}

static void break_entries(ibvs_real *entries, uint32_t count) {
  const uint32_t place = below(count);
  entries[place] = broken_number(entries[place]);
}

static void break_reference(ibvs_reference *r) {
  switch (below(6)) {
    case 0: r->push_force = broken_number(r->push_force); break;
    case 1: r->standoff = broken_number(r->standoff); break;
    case 2: break_entries(r->velocity, 2); break;
    case 3: break_entries(r->tilt, 2); break;
    case 4: r->line_count = below(2) == 0 ? UINT32_MAX : below(IBVS_LINES + 1); break;
    default: r->lines[0].theta = broken_number(r->lines[0].theta); break;
  }
}

/* Whether the thrusts are finite, within their limits and within the rate limit. */
static bool sound(const ibvs_command_result *command, const ibvs_real *before) {
  for (uint32_t i = 0; i < IBVS_ROTORS; ++i) {
    const ibvs_real thrust = command->thrusts[i];
    if (!(thrust >= ibvs_thrust_floor[i] && thrust <= ibvs_thrust_ceiling[i])) {
      return false;
    }
    if (before != NULL && !(r_fabs(thrust - before[i]) <= IBVS_RATE_STEP + ROUNDING)) {
      return false;
    }
  }
  return true;
}

#endif
