/* A tick of a flight: checks, prediction, correction, measurement and command. See ibvs_qp.estimation.estimator,
 * ibvs_qp.pilot.estimation and ibvs_qp.validation. */
#include "ibvs_estimation_internal.h"

static ibvs_real dot(const ibvs_real *a, const ibvs_real *b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static void cross(const ibvs_real *a, const ibvs_real *b, ibvs_real product[3]) {
  product[0] = a[1] * b[2] - a[2] * b[1];
  product[1] = a[2] * b[0] - a[0] * b[2];
  product[2] = a[0] * b[1] - a[1] * b[0];
}

uint32_t ibvs_flight_size(void) { return (uint32_t)sizeof(ibvs_flight); }

void ibvs_flight_init(ibvs_flight *f) {
  memset(f, 0, sizeof *f);
  ibvs_init(&f->controller);
  ibvs_flight_reset(f);
}

void ibvs_flight_reset(ibvs_flight *f) {
  ibvs_reset(&f->controller);
  memset((char *)f + offsetof(ibvs_flight, clock), 0, sizeof *f - offsetof(ibvs_flight, clock));
  ibvs_clock_reset(&f->clock);
  f->plane[2] = 1; /* a plane in front of the camera, for the equations */
  f->plane[3] = -1;
  f->plane_ns = f->accepted_plane_ns = f->picture_ns = f->wrench_ns = f->tick_ns = -1;
  memcpy(f->predict_states, ibvs_predict_start, sizeof f->predict_states);
  memcpy(f->correct_states, ibvs_correct_start, sizeof f->correct_states);
  ibvs_motion_reset(f);
}

/* Checks. */

/* The frame in the time of the clock, with force and moment in axes of B; false where there are no estimates. */
static bool check_frame(ibvs_flight *f, const ibvs_frame *given, uint32_t *rejected) {
  if (!ibvs_accept_stamp(&f->clock, given->stamp_ns)) {
    *rejected |= IBVS_REJECT_STAMP;
    return false;
  }
  for (uint32_t i = 0; i < IBVS_FRAME_FIELDS; ++i) {
    *rejected |= ibvs_within(given, &ibvs_frame_fields[i]) ? 0 : ibvs_frame_fields[i].rejected;
  }
  if ((*rejected & (IBVS_REJECT_ATTITUDE | IBVS_REJECT_ANGULAR_VELOCITY | IBVS_REJECT_SPECIFIC_FORCE)) != 0) {
    return false;
  }
  const ibvs_frame last = f->frame;
  f->frame = *given;
  f->frame.stamp_ns = f->clock.last_ns;
  const bool in_time = ibvs_sample_time(&f->clock, given->wrench_stamp_ns, &f->frame.wrench_stamp_ns);
  *rejected |= in_time ? 0 : IBVS_REJECT_WRENCH_STAMP;
  if (!in_time || (*rejected & IBVS_REJECT_CONTACT_WRENCH) != 0) { /* an old sample is no new one */
    memcpy(f->frame.wrench, last.wrench, sizeof last.wrench);
    f->frame.wrench_stamp_ns = last.wrench_stamp_ns;
    return true;
  }
  for (uint32_t i = 0; i < 3; ++i) {
    f->frame.wrench[i] = dot(ibvs_force_axes[i], given->wrench);
    f->frame.wrench[3 + i] = dot(ibvs_force_axes[i], &given->wrench[3]);
  }
  return true;
}

/* Capture of a picture, at most that of the tick: no filter has a later state. */
static bool capture_time(const ibvs_flight *f, int64_t stamp_ns, int64_t *time_ns) {
  *time_ns = stamp_ns;
  if (!ibvs_recent(&f->clock, time_ns)) {
    return false;
  }
  *time_ns = *time_ns < f->clock.last_ns ? *time_ns : f->clock.last_ns;
  return true;
}

static bool sound_velocity(const ibvs_features *features) {
  const ibvs_real *c = features->velocity_covariance;
  for (uint32_t i = 0; i < 3; ++i) {
    if (!(r_fabs(features->velocity[i]) <= IBVS_VELOCITY_BOUND && c[4 * i] >= 0 && c[4 * i] <= IBVS_VARIANCE_BOUND)) {
      return false;
    }
    for (uint32_t k = 0; k < i; ++k) {
      const ibvs_real most = r_sqrt(c[4 * i] * c[4 * k]) * (1 + IBVS_ASYMMETRY);
      if (!(r_fabs(c[3 * i + k]) <= most && r_fabs(c[3 * i + k] - c[3 * k + i]) <= IBVS_ASYMMETRY * most)) {
        return false;
      }
    }
  }
  return true;
}

static bool sound_line(const ibvs_line_feature *line) {
  bool segment = true;
  for (uint32_t i = 0; line->has_segment && i < 4; ++i) {
    segment = segment && r_fabs(line->segment[i]) <= IBVS_LINE_BOUND;
  }
  /* The identities of lines without one are negative. */
  return segment && line->track_id >= 0 && r_fabs(line->rho) <= IBVS_LINE_BOUND &&
         r_fabs(line->theta) <= IBVS_LINE_BOUND && line->weight >= 0 && line->weight <= 1 && line->variance >= 0 &&
         line->variance <= IBVS_VARIANCE_BOUND && (line->role == IBVS_HORIZONTAL || line->role == IBVS_VERTICAL) &&
         line->surface_side >= -1 && line->surface_side <= 1;
}

/* A line of a turned camera in C; false where it is out of view there. */
static bool straighten(ibvs_line_feature *line) {
  for (uint32_t i = 0; IBVS_TURNED_CAMERA && i < 4; i += 2) {
    const ibvs_real end[3] = {line->segment[i], line->segment[i + 1], 1};
    ibvs_real turned[3];
    ibvs_turn_point(end, turned);
    line->has_segment = line->has_segment && turned[2] > 0;
    line->segment[i] = turned[0] / turned[2];
    line->segment[i + 1] = turned[1] / turned[2];
  }
  return ibvs_turn_line(&line->rho, &line->theta, &line->variance, line->covariance, line->theta_variance);
}

/* Prediction. */

static void predict(ibvs_flight *f, bool plane_new) {
  const ibvs_frame *frame = &f->frame;
  const int64_t stamp = frame->stamp_ns, last_wrench = f->wrench_ns;
  const ibvs_real elapsed = f->tick_ns < 0 ? IBVS_TICK_S : SECONDS(stamp - f->tick_ns);
  const ibvs_real dt = r_fmin(elapsed, IBVS_LONGEST_TICK);
  const bool sampled = frame->wrench_stamp_ns > last_wrench;
  ibvs_real *in = f->predict_inputs, interval = 0;
  if (sampled) {
    interval = last_wrench < 0 ? IBVS_FIRST_INTERVAL
                               : r_fmin(SECONDS(frame->wrench_stamp_ns - last_wrench), IBVS_LONGEST_INTERVAL);
    f->wrench_ns = frame->wrench_stamp_ns;
  }
  in[IBVS_PREDICT_DT] = dt;
  in[IBVS_PREDICT_ELAPSED] = elapsed;
  memcpy(&in[IBVS_PREDICT_ATTITUDE], frame->attitude, sizeof frame->attitude);
  memcpy(&in[IBVS_PREDICT_RATE], frame->angular_velocity, sizeof frame->angular_velocity);
  memcpy(&in[IBVS_PREDICT_FORCE], frame->specific_force, sizeof frame->specific_force);
  in[IBVS_PREDICT_MEASURED] = in[IBVS_PREDICT_GYRO] = 1;
  for (uint32_t i = 0; i < 6; ++i) {
    in[IBVS_PREDICT_SAMPLE + i] = sampled ? frame->wrench[i] : 0;
  }
  in[IBVS_PREDICT_SAMPLE_INTERVAL] = in[IBVS_PREDICT_INTERVAL] = interval;
  memcpy(&in[IBVS_PREDICT_PLANE], f->plane, sizeof f->plane);
  in[IBVS_PREDICT_PLANE_NEW] = plane_new ? 1 : 0;
  in[IBVS_PREDICT_PLANE_AGE] = plane_new ? SECONDS(stamp - f->plane_ns) : 0;
  in[IBVS_PREDICT_PRESS] = f->controller.reference.contact ? 1 : 0; /* of the tick before */
  in[IBVS_PREDICT_DOUBT] = f->doubt ? 1 : 0;
  memcpy(&in[IBVS_PREDICT_MOTORS_FORCE], &f->controller.results[IBVS_OUT_MOTORS_FORCE], 3 * sizeof *in);
  in[IBVS_PREDICT_VELOCITY_YOUNG] = f->velocity_age_s < IBVS_VELOCITY_LIFE_S ? 1 : 0;
  f->doubt = false;
  ibvs_evaluate(f, ibvs_predict, in, f->predict_states, IBVS_PREDICT_STATES, f->predicted);
  if (f->predicted[IBVS_PREDICTED_PLANE_ACCEPTED] != 0) {
    f->accepted_plane_ns = f->plane_ns;
  }
  ibvs_remember(f, stamp, dt);
}

/* Correction. */

/* A measured plane, moved to the surface that the tip touches. */
static void on_felt_surface(const ibvs_flight *f, ibvs_real plane[4]) {
  const ibvs_real offset = f->predicted[IBVS_PREDICTED_SURFACE_OFFSET];
  memcpy(plane, f->plane, sizeof f->plane);
  if (offset != 0) {
    const ibvs_real ratio = r_fmax(1 - offset * r_sqrt(dot(plane, plane)) / r_fabs(plane[3]), IBVS_LEAST_RATIO);
    for (uint32_t i = 0; i < 3; ++i) {
      plane[i] /= ratio;
    }
  }
}

/* Normal, gravity and distance of the tip at a capture; false without a wall to measure on. */
static bool wall_at(const ibvs_flight *f, int64_t stamp_ns, bool has_plane, ibvs_real wall[7]) {
  const ibvs_real *predicted = f->predicted;
  ibvs_real plane[4], q[4];
  if (has_plane && f->accepted_plane_ns == stamp_ns) {
    on_felt_surface(f, plane);
    const ibvs_real d = plane[3], scaled[3] = {-plane[2] / d, -plane[0] / d, -plane[1] / d}; /* axes of C to B */
    const ibvs_real length = r_sqrt(dot(scaled, scaled));
    for (uint32_t i = 0; i < 3; ++i) {
      wall[i] = scaled[i] / length;
    }
    wall[6] = (1 - dot(scaled, ibvs_tip_from_camera)) / length;
  } else if (predicted[IBVS_PREDICTED_KNOWN] != 0) {
    memcpy(wall, &predicted[IBVS_PREDICTED_NORMAL], 3 * sizeof *wall);
    wall[6] = predicted[IBVS_PREDICTED_DISTANCE];
  } else {
    return false;
  }
  ibvs_attitude_at(f, stamp_ns, q);
  wall[3] = 2 * (q[1] * q[3] - q[0] * q[2]);
  wall[4] = 2 * (q[2] * q[3] + q[0] * q[1]);
  wall[5] = 1 - 2 * (q[1] * q[1] + q[2] * q[2]);
  return true;
}

static void correct(ibvs_flight *f, const ibvs_features *features, int64_t stamp_ns, uint32_t *rejected) {
  const uint32_t count = features->line_count < IBVS_MOST_LINES ? features->line_count : IBVS_MOST_LINES;
  int64_t ids[IBVS_MOST_LINES], next[2] = {-2, -3}, velocity_ns = stamp_ns; /* next: of lines without identity */
  ibvs_real wall[7];
  bool has_velocity = features->has_velocity;
  if (has_velocity && features->velocity_stamp_ns != 0) {
    has_velocity = capture_time(f, features->velocity_stamp_ns, &velocity_ns);
  }
  has_velocity = has_velocity && sound_velocity(features);
  *rejected |= features->has_velocity && !has_velocity ? IBVS_REJECT_VELOCITY : 0;
  *rejected |= features->line_count > count ? IBVS_REJECT_LINES : 0;
  if (!wall_at(f, stamp_ns, features->has_plane && (*rejected & IBVS_REJECT_PLANE) == 0, wall)) {
    *rejected |= count > 0 ? IBVS_REJECT_LINES : 0;
    return;
  }
  const ibvs_real *curvature = features->curvature;
  bool sound_curvature = true;
  for (uint32_t i = 0; i < 3; ++i) {
    sound_curvature = sound_curvature && r_fabs(curvature[i]) <= IBVS_CURVATURE_BOUND;
  }
  *rejected |= sound_curvature ? 0 : IBVS_REJECT_PLANE;
  for (uint32_t i = 0; i < 3; ++i) {
    f->predict_inputs[IBVS_PREDICT_CURVATURE + i] = sound_curvature ? curvature[i] : 0;
  }
  if (stamp_ns < f->gap_end_ns) { /* the state at a capture before a gap is not known */
    return;
  }
  if (has_velocity) {
    ibvs_correct_velocity(f, features, stamp_ns, velocity_ns, wall);
  }
  for (uint32_t i = 0; i < count; ++i) {
    ibvs_line_feature line = features->lines[i];
    bool sound = sound_line(&line) && straighten(&line);
    ids[i] = sound ? line.track_id : 0;
    if (sound && ids[i] == 0) {
      ids[i] = next[line.role];
      next[line.role] -= 2;
    }
    for (uint32_t k = 0; k < i; ++k) {
      sound = sound && ids[k] != ids[i];
    }
    if (sound) {
      ibvs_correct_line(f, &line, ids[i], stamp_ns, wall);
    } else {
      *rejected |= IBVS_REJECT_LINES;
    }
  }
  ibvs_end_correction(f, stamp_ns);
}

static void report(ibvs_flight *f) {
  ibvs_estimates *now = &f->now;
  const ibvs_real *predicted = f->predicted, *motion = ibvs_motion(f);
  now->wall_known = predicted[IBVS_PREDICTED_KNOWN] != 0;
  now->in_contact = predicted[IBVS_PREDICTED_IN_CONTACT] != 0;
  now->stiffness_known = predicted[IBVS_PREDICTED_STIFFNESS_KNOWN] != 0;
  now->tared = predicted[IBVS_PREDICTED_TARED] != 0;
  now->velocity_known = f->velocity_age_s < IBVS_VELOCITY_LIFE_S;
  now->distance = predicted[IBVS_PREDICTED_DISTANCE];
  now->distance_rate = predicted[IBVS_PREDICTED_RATE];
  now->push = predicted[IBVS_PREDICTED_PUSH];
  now->push_noise = predicted[IBVS_PREDICTED_PUSH_NOISE];
  now->push_reference = f->controller.results[IBVS_OUT_PUSH_REFERENCE];
  now->time_in_contact = predicted[IBVS_PREDICTED_TIME_SINCE_TOUCH];
  now->stiffness = predicted[IBVS_PREDICTED_STIFFNESS];
  memcpy(now->normal, &predicted[IBVS_PREDICTED_NORMAL], sizeof now->normal);
  memcpy(now->wrench, &predicted[IBVS_PREDICTED_WRENCH], sizeof now->wrench);
  memcpy(now->velocity, &motion[IBVS_MOTION_VELOCITY], sizeof now->velocity);
  memcpy(now->odometer, &motion[IBVS_MOTION_ODOMETER], sizeof now->odometer);
  memcpy(now->attitude, &f->predict_states[IBVS_STATE_ATTITUDE], sizeof now->attitude);
  memcpy(now->angular_velocity, &f->predict_states[IBVS_STATE_RATE], sizeof now->angular_velocity);
}

void ibvs_estimate(ibvs_flight *f, const ibvs_frame *frame, const ibvs_features *features,
                   ibvs_estimates *estimates) {
  int64_t capture_ns = -1;
  uint32_t rejected = 0;
  f->now.valid = check_frame(f, frame, &rejected);
  f->now.stamp_ns = frame->stamp_ns;
  if (f->now.valid) {
    if (f->jumps != f->clock.jumps) { /* or the loop stood still for an unknown time */
      f->jumps = f->clock.jumps;
      f->doubt = true;
      ibvs_motion_doubt(f);
    }
    if (features != NULL && !(capture_time(f, features->stamp_ns, &capture_ns) && capture_ns > f->picture_ns)) {
      rejected |= IBVS_REJECT_FEATURES;
      features = NULL;
    }
    bool plane_new = features != NULL && features->has_plane;
    if (plane_new) {
      ibvs_real plane[4];
      memcpy(plane, features->plane, sizeof plane);
      plane_new = ibvs_good_plane(plane) && ibvs_turn_plane(plane);
      rejected |= plane_new ? 0 : IBVS_REJECT_PLANE;
      if (plane_new) {
        memcpy(f->plane, plane, sizeof f->plane);
        f->plane_ns = capture_ns;
      }
    }
    predict(f, plane_new);
    if (features != NULL) {
      f->picture_ns = capture_ns;
      correct(f, features, capture_ns, &rejected);
    }
    report(f);
  } else if (features != NULL) {
    rejected |= IBVS_REJECT_FEATURES;
  }
  f->now.rejected = rejected;
  *estimates = f->now;
}

/* Measurement and command. */

/* A tracked line in the image now. */
static ibvs_line image_line(const ibvs_flight *f, const ibvs_tracked_line *line, ibvs_real distance) {
  const ibvs_real *predicted = f->predicted, *n = &predicted[IBVS_PREDICTED_NORMAL];
  const ibvs_real *right = &predicted[IBVS_PREDICTED_AXIS_RIGHT], *down = &predicted[IBVS_PREDICTED_AXIS_DOWN];
  const ibvs_real c = r_cos(line->angle), s = r_sin(line->angle);
  ibvs_real foot[3], normal[3], point[3], along[3], h[3]; /* h: normal of the interpretation plane */
  for (uint32_t i = 0; i < 3; ++i) {
    foot[i] = ibvs_tip_from_camera[i] + distance * n[i];
    normal[i] = c * right[i] + s * down[i];
    point[i] = foot[i] + line->offset * normal[i];
  }
  cross(n, normal, along);
  cross(point, along, h);
  ibvs_real length = r_sqrt(h[1] * h[1] + h[2] * h[2]);
  length = h[1] * normal[1] + h[2] * normal[2] < 0 ? -length : length;
  const ibvs_real depth = dot(foot, n);
  const ibvs_real variance = r_fmax(f->variance[IBVS_MOTION_LINES + line->slot], IBVS_LEAST_VARIANCE);
  return (ibvs_line){.rho = -h[0] / length, .theta = r_atan2(h[2] / length, h[1] / length), .weight = line->weight,
                     .variance = variance / (depth * depth), .stamp_ns = f->frame.stamp_ns, .role = line->role};
}

/* Measured lines in the places of the reference's. A line that is gone, or has another role, keeps its place with
 * weight 0: the law pairs lines by role and order. */
static uint32_t add_lines(const ibvs_flight *f, const ibvs_reference *reference, const int64_t *followed,
                          uint32_t count, ibvs_measurement *m) {
  const ibvs_estimates *now = &f->now;
  const ibvs_real distance = now->wall_known ? now->distance : IBVS_ASSUMED_DISTANCE;
  const uint32_t lines = reference->line_count < IBVS_LINES ? reference->line_count : IBVS_LINES;
  count = followed == NULL ? 0 : count;
  uint32_t rejected = count != reference->line_count ? IBVS_REJECT_LINES : 0;
  for (m->line_count = 0; m->line_count < lines; ++m->line_count) {
    const uint32_t i = m->line_count;
    const ibvs_line_reference *target = &reference->lines[i];
    const ibvs_tracked_line *found = NULL;
    for (uint32_t k = 0; k < now->line_count && i < count; ++k) {
      const bool same = now->lines[k].track_id == followed[i] && now->lines[k].role == target->role;
      found = same ? &now->lines[k] : found;
    }
    if (found != NULL) {
      m->lines[i] = image_line(f, found, distance);
    } else {
      m->lines[i] = (ibvs_line){.rho = target->rho, .theta = target->theta, .stamp_ns = f->frame.stamp_ns,
                                .role = target->role};
      rejected = IBVS_REJECT_LINES;
    }
  }
  return rejected;
}

static void measure(const ibvs_flight *f, ibvs_measurement *m) {
  const ibvs_frame *frame = &f->frame;
  const ibvs_estimates *now = &f->now;
  const ibvs_real *velocity = &ibvs_motion(f)[IBVS_MOTION_VELOCITY], *bias = &ibvs_motion(f)[IBVS_MOTION_BIAS];
  const ibvs_real *right = &f->predicted[IBVS_PREDICTED_AXIS_RIGHT], *down = &f->predicted[IBVS_PREDICTED_AXIS_DOWN];
  m->stamp_ns = frame->stamp_ns;
  memcpy(m->attitude, now->attitude, sizeof m->attitude);
  memcpy(m->angular_velocity, now->angular_velocity, sizeof m->angular_velocity);
  m->has_specific_force = true;
  memcpy(m->specific_force, frame->specific_force, sizeof m->specific_force);
  memcpy(m->contact_wrench, now->wrench, sizeof m->contact_wrench);
  m->wrench_stamp_ns = frame->wrench_stamp_ns;
  m->has_plane = f->plane_ns >= 0;
  on_felt_surface(f, m->plane);
  m->plane_stamp_ns = f->plane_ns;
  m->has_velocity = now->velocity_known;
  m->has_acceleration_bias = true;
  for (uint32_t i = 0; i < 3; ++i) {
    m->velocity[i] = right[i] * velocity[0] + down[i] * velocity[1] - now->normal[i] * now->distance_rate;
    m->acceleration_bias[i] = bias[0] * right[i] + bias[1] * down[i];
  }
  m->has_thrust_min = frame->has_thrust_min;
  m->has_thrust_max = frame->has_thrust_max;
  memcpy(m->thrust_min, frame->thrust_min, sizeof m->thrust_min);
  memcpy(m->thrust_max, frame->thrust_max, sizeof m->thrust_max);
}

void ibvs_command(ibvs_flight *f, const ibvs_reference *reference, const int64_t *followed, uint32_t count,
                  ibvs_command_result *command) {
  ibvs_measurement m;
  uint32_t rejected = f->now.rejected;
  memset(&m, 0, sizeof m);
  m.stamp_ns = -1; /* of no tick: the controller holds */
  if (f->now.valid) {
    measure(f, &m);
    rejected |= add_lines(f, reference, followed, count, &m);
    f->controller.inputs[IBVS_IN_GIVEN] = 1;
    for (uint32_t i = 0; i < IBVS_GIVEN_ENTRIES; ++i) {
      f->controller.inputs[ibvs_given_places[i][0]] = f->predicted[ibvs_given_places[i][1]];
    }
  }
  ibvs_step(&f->controller, &m, reference, command);
  command->stamp_ns = f->now.stamp_ns;
  command->rejected = (f->now.valid ? command->rejected : command->rejected & ~(uint32_t)IBVS_REJECT_STAMP) | rejected;
}

ibvs_line_reference ibvs_line_target(const ibvs_estimates *estimates, const ibvs_tracked_line *line, ibvs_real offset) {
  const bool vertical = line->role == IBVS_VERTICAL;
  const ibvs_real depth = IBVS_TIP_AHEAD + (estimates->wall_known ? estimates->distance : IBVS_ASSUMED_DISTANCE);
  return (ibvs_line_reference){.rho = (offset + (vertical ? IBVS_TIP_RIGHT : IBVS_TIP_BELOW)) / depth,
                               .theta = vertical ? 0 : IBVS_QUARTER_TURN,
                               .role = line->role};
}
