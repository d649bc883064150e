/* Measurement and reference into the inputs of the tick; see ibvs_qp.model.packing. */
#include "ibvs_internal.h"

#define SECONDS(ns) (R(1e-9) * (ibvs_real)(ns))

/* Entries of one line in the inputs, in the order of ibvs_qp.model.tick.LINE. */
enum { PRESENT, VERTICAL, RHO, THETA, RHO_REFERENCE, THETA_REFERENCE, CONFIDENCE, VARIANCE, AGE, CHANGED };

static ibvs_real *line_inputs(ibvs_controller *c, uint32_t index) {
  return &c->inputs[IBVS_IN_LINE_0_PRESENT + index * IBVS_LINE_ENTRIES];
}

static int32_t key_of(const ibvs_reference *reference, uint32_t place) {
  int32_t order = 0;
  for (uint32_t i = 0; i < place; ++i) {
    order += reference->lines[i].role == reference->lines[place].role ? 1 : 0;
  }
  return (int32_t)reference->lines[place].role * IBVS_LINES + order;
}

static int32_t index_of(const ibvs_controller *c, int32_t key) {
  for (int32_t index = 0; index < IBVS_LINES; ++index) {
    if (c->pairs[index] == key) {
      return index;
    }
  }
  return -1;
}

/* Give every reference its index; an index that changes its reference loses integral and rate. */
static void assign(ibvs_controller *c) {
  const ibvs_reference *reference = &c->reference;
  for (uint32_t index = 0; index < IBVS_LINES; ++index) {
    bool kept = c->pairs[index] < 0;
    for (uint32_t i = 0; i < reference->line_count && !kept; ++i) {
      kept = key_of(reference, i) == c->pairs[index];
    }
    if (!kept) {
      c->pairs[index] = -1;
      line_inputs(c, index)[CHANGED] = 1;
    }
  }
  for (uint32_t i = 0; i < reference->line_count; ++i) {
    const int32_t key = key_of(reference, i);
    if (index_of(c, key) < 0) {
      c->pairs[index_of(c, -1)] = key;
    }
  }
}

static const ibvs_line *measured_line(const ibvs_measurement *m, int32_t key) {
  int32_t order = key % IBVS_LINES;
  for (uint32_t i = 0; i < m->line_count; ++i) {
    if ((int32_t)m->lines[i].role == key / IBVS_LINES) {
      if (order == 0) {
        return &m->lines[i];
      }
      order -= 1;
    }
  }
  return NULL;
}

static void pack_lines(ibvs_controller *c, const ibvs_measurement *m) {
  for (uint32_t index = 0; index < IBVS_LINES; ++index) { /* the other entries stay: finite equations */
    line_inputs(c, index)[PRESENT] = line_inputs(c, index)[CHANGED] = 0;
  }
  assign(c);
  for (uint32_t i = 0; i < c->reference.line_count; ++i) {
    const int32_t key = key_of(&c->reference, i), index = index_of(c, key);
    const ibvs_line *line = measured_line(m, key);
    if (line == NULL || index < 0) {
      continue;
    }
    ibvs_real *inputs = line_inputs(c, (uint32_t)index);
    inputs[PRESENT] = 1;
    inputs[VERTICAL] = line->role == IBVS_VERTICAL ? 1 : 0;
    inputs[RHO] = line->rho;
    inputs[THETA] = line->theta;
    inputs[RHO_REFERENCE] = c->reference.lines[i].rho;
    inputs[THETA_REFERENCE] = c->reference.lines[i].theta;
    inputs[CONFIDENCE] = line->weight;
    inputs[VARIANCE] = line->variance;
    inputs[AGE] = line->stamp_ns == 0 ? 0 : SECONDS(m->stamp_ns - line->stamp_ns);
  }
}

void ibvs_turn_point(const ibvs_real point[3], ibvs_real turned[3]) {
  for (uint32_t i = 0; i < 3; ++i) {
    const ibvs_real *row = ibvs_camera_turn[i];
    turned[i] = row[0] * point[0] + row[1] * point[1] + row[2] * point[2];
  }
}

bool ibvs_turn_plane(ibvs_real plane[4]) {
  const ibvs_real normal[3] = {plane[0], plane[1], plane[2]};
  if (!IBVS_TURNED_CAMERA) {
    return true;
  }
  ibvs_turn_point(normal, plane);
  return !(plane[2] < IBVS_INVERSE_DEPTH_MIN * -plane[3]);
}

/* See ibvs_qp.estimation.turned_camera, of which it has the bits. */
bool ibvs_turn_line(ibvs_real *rho, ibvs_real *theta, ibvs_real *variance, ibvs_real covariance,
                    ibvs_real theta_variance) {
  const ibvs_real cosine = r_cos(*theta), sine = r_sin(*theta);
  const ibvs_real normal[3] = {cosine, sine, -*rho}, points[2][3] = {{0, 0, -1}, {-sine, cosine, 0}};
  ibvs_real turned[3], rate[3], by[2]; /* by: derivatives of the turned rho by rho and theta */
  if (!IBVS_TURNED_CAMERA) {
    return true;
  }
  ibvs_turn_point(normal, turned);
  const ibvs_real x = turned[0], y = turned[1], z = turned[2], length = r_sqrt(x * x + y * y);
  if (!(r_fabs(z) <= IBVS_LINE_BOUND * length && r_fabs(covariance) <= IBVS_VARIANCE_BOUND && theta_variance >= 0 &&
        theta_variance <= IBVS_VARIANCE_BOUND)) {
    return false;
  }
  for (uint32_t i = 0; i < 2; ++i) {
    ibvs_turn_point(points[i], rate);
    by[i] = (z * ((x * rate[0] + y * rate[1]) / (length * length)) - rate[2]) / length;
  }
  const ibvs_real along = by[0] * *variance + by[1] * covariance, across = by[0] * covariance + by[1] * theta_variance;
  *variance = r_fmax(by[0] * along + by[1] * across, 0);
  *rho = -z / length;
  *theta = r_atan2(y, x);
  return true;
}

static void put(ibvs_controller *c, uint32_t place, const ibvs_real *values, uint32_t count, bool known) {
  for (uint32_t i = 0; i < count; ++i) {
    c->inputs[place + i] = known ? values[i] : 0;
  }
}

static void pack_reference(ibvs_controller *c) {
  const ibvs_reference *reference = &c->reference;
  ibvs_real *in = c->inputs;
  in[IBVS_IN_REFERENCE_PUSH] = reference->push_force;
  in[IBVS_IN_REFERENCE_STANDOFF] = reference->standoff;
  in[IBVS_IN_REFERENCE_VELOCITY_RIGHT] = reference->velocity[0];
  in[IBVS_IN_REFERENCE_VELOCITY_DOWN] = reference->velocity[1];
  in[IBVS_IN_REFERENCE_PRESS] = reference->contact ? 1 : 0;
  in[IBVS_IN_REFERENCE_ROLL] = reference->tilt[0];
  in[IBVS_IN_REFERENCE_PITCH] = reference->tilt[1];
  in[IBVS_IN_REFERENCE_TRAVEL_RIGHT] = reference->travel[0];
  in[IBVS_IN_REFERENCE_TRAVEL_DOWN] = reference->travel[1];
  in[IBVS_IN_REFERENCE_TRIM_ROLL] = reference->trim[0];
  in[IBVS_IN_REFERENCE_TRIM_PITCH] = reference->trim[1];
}

static void pack_rotors(ibvs_controller *c, const ibvs_measurement *m) {
  ibvs_real *in = c->inputs, hold[IBVS_ROTORS];
  ibvs_hold_thrusts(c, hold);
  for (uint32_t i = 0; i < IBVS_ROTORS; ++i) {
    const ibvs_real floor = ibvs_thrust_floor[i], ceiling = ibvs_thrust_ceiling[i];
    const ibvs_real low = m->has_thrust_min ? r_fmax(m->thrust_min[i], floor) : floor;
    in[IBVS_IN_THRUST_LAST + i] = c->commanded ? c->thrusts[i] : hold[i];
    in[IBVS_IN_THRUST_CHANGE + i] = c->change[i];
    in[IBVS_IN_THRUST_LOW + i] = low;
    in[IBVS_IN_THRUST_HIGH + i] = m->has_thrust_max ? r_fmax(r_fmin(m->thrust_max[i], ceiling), low) : ceiling;
    in[IBVS_IN_THRUST_FLOOR + i] = floor;
    in[IBVS_IN_THRUST_CEILING + i] = ceiling;
  }
  in[IBVS_IN_COMMANDED] = c->commanded ? 1 : 0;
  in[IBVS_IN_UNALLOCATED] = c->unallocated;
  in[IBVS_IN_THRUST_STEP] = c->commanded ? IBVS_RATE_STEP : IBVS_ANY_STEP;
}

void ibvs_pack(ibvs_controller *c, const ibvs_measurement *m) {
  ibvs_real *in = c->inputs;
  const int64_t elapsed = m->stamp_ns - c->tick_ns;
  in[IBVS_IN_ELAPSED] = c->tick_ns < 0 ? IBVS_TICK_S : SECONDS(elapsed > 0 ? elapsed : 0);
  c->tick_ns = m->stamp_ns;
  put(c, IBVS_IN_ATTITUDE, m->attitude, 4, true);
  put(c, IBVS_IN_ANGULAR_VELOCITY, m->angular_velocity, 3, true);
  put(c, IBVS_IN_CONTACT_WRENCH, m->contact_wrench, 6, true);
  put(c, IBVS_IN_SPECIFIC_FORCE, m->specific_force, 3, m->has_specific_force);
  put(c, IBVS_IN_VELOCITY, m->velocity, 3, m->has_velocity);
  put(c, IBVS_IN_ACCELERATION_BIAS, m->acceleration_bias, 3, m->has_acceleration_bias);
  in[IBVS_IN_SPECIFIC_FORCE_KNOWN] = m->has_specific_force ? 1 : 0;
  in[IBVS_IN_VELOCITY_KNOWN] = m->has_velocity ? 1 : 0;
  in[IBVS_IN_VELOCITY_AGE] =
      m->has_velocity && m->has_velocity_stamp ? SECONDS(m->stamp_ns - m->velocity_stamp_ns) : 0;
  in[IBVS_IN_WRENCH_AGE] = SECONDS(m->stamp_ns - m->wrench_stamp_ns);
  in[IBVS_IN_PLANE_KNOWN] = m->has_plane ? 1 : 0;
  if (m->has_plane) { /* the last one stays: finite equations */
    put(c, IBVS_IN_PLANE, m->plane, 4, true);
    in[IBVS_IN_PLANE_AGE] = SECONDS(m->stamp_ns - m->plane_stamp_ns);
  }
  put(c, IBVS_IN_GAINS, &c->gains_in_force.IBVS_FIRST_GAIN, IBVS_GAINS, true);
  pack_reference(c);
  pack_lines(c, m);
  pack_rotors(c, m);
}
