/* Stamps to a time that only increases, and checks of all inputs: a refused one is replaced by its last accepted value.
 * See ibvs_qp.validation. */
#include "ibvs_internal.h"

void ibvs_clock_reset(ibvs_clock *c) {
  c->shift_ns = 0;
  c->last_ns = -1;
  c->odd_first = c->odd_last = -1;
  c->odd_count = c->jumps = 0;
}

static bool is_stamp(int64_t stamp) { return stamp >= 0 && stamp < IBVS_STAMP_END; }

bool ibvs_accept_stamp(ibvs_clock *c, int64_t stamp) {
  if (!is_stamp(stamp)) {
    return false;
  }
  if (c->last_ns < 0) { /* a first stamp near the end would leave no room for the time after it */
    c->shift_ns = stamp >= IBVS_STAMP_END / 2 ? -stamp : 0;
  }
  const int64_t time = stamp + c->shift_ns;
  if (c->last_ns < 0 || (time > c->last_ns && time - c->last_ns <= IBVS_JUMP_NS)) {
    c->last_ns = time;
    c->odd_count = 0;
    return true;
  }
  const bool ahead = time > c->last_ns;
  if (c->odd_count > 0 && stamp == c->odd_last) {
    return false;
  }
  const bool follows = c->odd_count > 0 && stamp > c->odd_last && stamp - c->odd_last <= IBVS_JUMP_NS;
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
  c->jumps += 1;
  c->last_ns += passed + step;
  c->shift_ns = c->last_ns - stamp;
  return true;
}

bool ibvs_sample_time(const ibvs_clock *c, int64_t stamp, int64_t *time_ns) {
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

static ibvs_real *entries(void *structure, const ibvs_field *field) {
  return (ibvs_real *)(void *)((char *)structure + field->value);
}

static const ibvs_real *const_entries(const void *structure, const ibvs_field *field) {
  return (const ibvs_real *)(const void *)((const char *)structure + field->value);
}

static bool *flag_of(void *structure, const ibvs_field *field) {
  return (bool *)((char *)structure + field->flag);
}

bool ibvs_within(const void *structure, const ibvs_field *field) {
  const ibvs_real *values = const_entries(structure, field);
  if (field->unit_length) {
    ibvs_real square = 0;
    for (uint32_t i = 0; i < field->size; ++i) {
      square += values[i] * values[i];
    }
    return r_fabs(square - 1) <= IBVS_UNIT_TOLERANCE;
  }
  for (uint32_t i = 0; i < field->size; ++i) {
    if (!(values[i] >= field->low && values[i] <= field->high)) {
      return false;
    }
  }
  return true;
}

/* Entries in force: accepted, or the last ones where they are held, or none. */
static void check_fields(const ibvs_controller *c, ibvs_measurement *own, uint32_t *rejected) {
  for (uint32_t i = 0; i < IBVS_MEASUREMENT_FIELDS; ++i) {
    const ibvs_field *field = &ibvs_measurement_fields[i];
    const bool optional = field->flag != IBVS_NO_FLAG;
    if ((optional && !*flag_of(own, field)) || ibvs_within(own, field)) {
      continue;
    }
    *rejected |= field->rejected;
    memcpy(entries(own, field), const_entries(&c->last, field), field->size * sizeof(ibvs_real));
    if (optional) {
      *flag_of(own, field) = field->held && *(const bool *)((const char *)&c->last + field->flag);
    }
  }
}

static void check_limit_order(const ibvs_controller *c, ibvs_measurement *own, uint32_t *rejected) {
  bool crossed = false;
  for (uint32_t i = 0; i < IBVS_ROTORS; ++i) {
    crossed = crossed || own->thrust_min[i] > own->thrust_max[i];
  }
  if (!own->has_thrust_min || !own->has_thrust_max || !crossed) {
    return;
  }
  *rejected |= IBVS_REJECT_THRUST_ORDER;
  own->has_thrust_min = c->last.has_thrust_min;
  own->has_thrust_max = c->last.has_thrust_max;
  memcpy(own->thrust_min, c->last.thrust_min, sizeof own->thrust_min);
  memcpy(own->thrust_max, c->last.thrust_max, sizeof own->thrust_max);
}

bool ibvs_good_plane(const ibvs_real plane[4]) {
  const ibvs_real d = plane[3];
  return ibvs_finite(plane, 4) && d != 0 && r_fabs(plane[0] / d) < IBVS_INVERSE_DEPTH_BOUND &&
         r_fabs(plane[1] / d) < IBVS_INVERSE_DEPTH_BOUND && -plane[2] / d > IBVS_INVERSE_DEPTH_MIN &&
         -plane[2] / d < IBVS_INVERSE_DEPTH_BOUND;
}

static void check_plane(const ibvs_controller *c, ibvs_measurement *own, uint32_t *rejected) {
  if (!own->has_plane) {
    return;
  }
  if (!ibvs_good_plane(own->plane) || !ibvs_sample_time(&c->clock, own->plane_stamp_ns, &own->plane_stamp_ns)) {
    *rejected |= IBVS_REJECT_PLANE;
    own->has_plane = false;
  }
}

/* A sample's stamp in the clock's time, unless the sample is too old. */
bool ibvs_recent(const ibvs_clock *c, int64_t *stamp_ns) {
  return ibvs_sample_time(c, *stamp_ns, stamp_ns) && c->last_ns - *stamp_ns <= IBVS_OLDEST_LINE_NS;
}

static bool good_line(const ibvs_line *line) {
  return r_fabs(line->rho) <= IBVS_LINE_BOUND && r_fabs(line->theta) <= IBVS_LINE_BOUND && line->weight >= 0 &&
         line->weight <= 1 && line->variance >= 0 && line->variance <= IBVS_VARIANCE_BOUND &&
         (line->role == IBVS_HORIZONTAL || line->role == IBVS_VERTICAL);
}

static void check_lines(const ibvs_controller *c, ibvs_measurement *own, uint32_t *rejected) {
  uint32_t count = own->line_count, kept = 0;
  if (count > IBVS_MOST_LINES) {
    *rejected |= IBVS_REJECT_LINES;
    count = IBVS_MOST_LINES;
  }
  for (uint32_t i = 0; i < count; ++i) {
    ibvs_line line = own->lines[i];
    if (good_line(&line) && (line.stamp_ns == 0 || ibvs_recent(&c->clock, &line.stamp_ns))) {
      own->lines[kept] = line;
      kept += 1;
    } else {
      *rejected |= IBVS_REJECT_LINES;
    }
  }
  own->line_count = kept;
}

bool ibvs_check_measurement(ibvs_controller *c, const ibvs_measurement *given, ibvs_measurement *own,
                            uint32_t *rejected) {
  if (!ibvs_accept_stamp(&c->clock, given->stamp_ns)) {
    *rejected |= IBVS_REJECT_STAMP;
    return false;
  }
  *own = *given;
  own->stamp_ns = c->clock.last_ns;
  check_fields(c, own, rejected);
  const bool in_time = ibvs_sample_time(&c->clock, given->wrench_stamp_ns, &own->wrench_stamp_ns);
  if (!in_time) {
    *rejected |= IBVS_REJECT_WRENCH_STAMP;
  }
  if (!in_time || (*rejected & IBVS_REJECT_CONTACT_WRENCH) != 0) { /* an old wrench is no new sample */
    memcpy(own->contact_wrench, c->last.contact_wrench, sizeof own->contact_wrench);
    own->wrench_stamp_ns = c->last.wrench_stamp_ns;
  }
  check_plane(c, own, rejected);
  check_lines(c, own, rejected);
  if (own->has_velocity && own->has_velocity_stamp && !ibvs_recent(&c->clock, &own->velocity_stamp_ns)) {
    *rejected |= IBVS_REJECT_VELOCITY_STAMP;
    own->has_velocity = false;
  }
  check_limit_order(c, own, rejected);
  if ((*rejected & IBVS_REJECT_ATTITUDE) != 0 && !c->measured) { /* time begins with the first attitude */
    ibvs_clock_reset(&c->clock);
    c->last = ibvs_first_measurement;
    return false;
  }
  c->last = *own;
  c->measured = true;
  return true;
}

bool ibvs_check_reference(ibvs_controller *c, const ibvs_reference *given) {
  ibvs_reference own = *given;
  if (own.line_count > IBVS_LINES) {
    own.line_count = IBVS_LINES;
  }
  for (uint32_t i = 0; i < IBVS_REFERENCE_FIELDS; ++i) {
    if (!ibvs_within(&own, &ibvs_reference_fields[i])) {
      return false;
    }
  }
  for (uint32_t i = 0; i < own.line_count; ++i) {
    const ibvs_line_reference *line = &own.lines[i];
    if (!(r_fabs(line->rho) <= IBVS_LINE_BOUND && r_fabs(line->theta) <= IBVS_LINE_BOUND) ||
        !(line->role == IBVS_HORIZONTAL || line->role == IBVS_VERTICAL)) {
      return false;
    }
  }
  c->reference = own;
  return given->line_count <= IBVS_LINES;
}

bool ibvs_check_gains(ibvs_controller *c) {
  const ibvs_real *gains = &c->gains.IBVS_FIRST_GAIN, *least = &ibvs_least_gains.IBVS_FIRST_GAIN;
  const ibvs_real *largest = &ibvs_largest_gains.IBVS_FIRST_GAIN;
  for (uint32_t i = 0; i < IBVS_GAINS; ++i) {
    if (!(gains[i] >= least[i] && gains[i] <= largest[i])) {
      return false;
    }
  }
  c->gains_in_force = c->gains;
  return true;
}
