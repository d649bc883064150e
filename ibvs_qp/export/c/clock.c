/* Stamps to a time that only increases; see ibvs_qp.validation.clock. */
#include "ibvs_internal.h"

void ibvs_clock_reset(ibvs_controller *c) {
  c->shift_ns = 0;
  c->last_ns = -1;
  c->odd_first = c->odd_last = -1;
  c->odd_count = 0;
}

static bool is_stamp(int64_t stamp) { return stamp >= 0 && stamp < IBVS_STAMP_END; }

bool ibvs_clock_accept(ibvs_controller *c, int64_t stamp) {
  if (!is_stamp(stamp)) {
    return false;
  }
  if (c->last_ns < 0) { /* a first stamp near the end would leave no room for the time after it */
    c->shift_ns = stamp >= IBVS_STAMP_END / 2 ? -stamp : 0;
  }
  const int64_t time = stamp + c->shift_ns;
  if (c->last_ns < 0 || (time > c->last_ns && time - c->last_ns <= IBVS_LEAP_NS)) {
    c->last_ns = time;
    c->odd_count = 0;
    return true;
  }
  const bool ahead = time > c->last_ns;
  if (c->odd_count > 0 && stamp == c->odd_last) {
    return false;
  }
  const bool follows = c->odd_count > 0 && stamp > c->odd_last && stamp - c->odd_last <= IBVS_LEAP_NS;
  if (!follows) {
    c->odd_first = stamp;
    c->odd_count = 0;
  }
  const int64_t step = stamp - c->odd_last, passed = stamp - c->odd_first;
  c->odd_last = stamp;
  c->odd_count += 1;
  if (!follows || !(ahead || (passed >= IBVS_RESTART_NS && c->odd_count >= IBVS_RESTART_STAMPS))) {
    return false;
  }
  c->odd_count = 0;
  c->last_ns += passed + step;
  c->shift_ns = c->last_ns - stamp;
  return true;
}

bool ibvs_sample_time(const ibvs_controller *c, int64_t stamp, int64_t *time_ns) {
  if (!is_stamp(stamp)) {
    return false;
  }
  const int64_t time = stamp + c->shift_ns;
  if (time > c->last_ns + IBVS_LEAD_NS) {
    return false;
  }
  *time_ns = time;
  return true;
}
