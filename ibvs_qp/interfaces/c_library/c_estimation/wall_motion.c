/* Velocity, odometer and lines in the wall plane, corrected at the time of capture. See
 * ibvs_qp.estimation.tick_history and ibvs_qp.estimation.wall_motion. */
#include "ibvs_estimation_internal.h"

static uint32_t index_of(const ibvs_tick_history *h, uint32_t place) { return (h->first + place) % IBVS_HISTORY; }

static ibvs_real *newest(ibvs_tick_history *h) { return h->rows[index_of(h, h->count - 1)]; }

const ibvs_real *ibvs_motion(const ibvs_flight *f) {
  return f->history.rows[index_of(&f->history, f->history.count - 1)];
}

static void add(ibvs_tick_history *h, int64_t stamp_ns, const ibvs_real *states, ibvs_real dt) {
  if (h->count == IBVS_HISTORY) {
    h->first = index_of(h, 1);
  } else {
    h->count += 1;
  }
  const uint32_t index = index_of(h, h->count - 1);
  memcpy(h->rows[index], states, IBVS_MOTION_STATES * sizeof *states);
  memcpy(&h->rows[index][IBVS_MOTION_STATES], &states[IBVS_STATE_ATTITUDE], 4 * sizeof *states);
  h->stamps[index] = stamp_ns;
  h->lengths[index] = dt;
}

static uint32_t nearest(const ibvs_tick_history *h, int64_t stamp_ns) {
  uint32_t after = h->count;
  while (after > 0 && h->stamps[index_of(h, after - 1)] >= stamp_ns) {
    after -= 1;
  }
  if (after == h->count || (after > 0 && stamp_ns - h->stamps[index_of(h, after - 1)] <=
                                             h->stamps[index_of(h, after)] - stamp_ns)) {
    after -= 1;
  }
  return after;
}

/* Place of the tick nearest to a stamp; -1 outside the remembered time. */
static int32_t find(const ibvs_tick_history *h, int64_t stamp_ns) {
  const bool before = stamp_ns - h->stamps[index_of(h, 0)] < -IBVS_BEFORE_NS;
  return before || stamp_ns - h->stamps[index_of(h, h->count - 1)] > IBVS_AHEAD_NS ? -1
                                                                                     : (int32_t)nearest(h, stamp_ns);
}

/* Add a change of the tick at a place, carried along, to it and to all later ticks. */
static void change(ibvs_tick_history *h, uint32_t place, const ibvs_real *changes) {
  ibvs_real once = 0, twice = 0;
  for (uint32_t later = place; later < h->count; ++later) {
    ibvs_real *row = h->rows[index_of(h, later)];
    if (later > place) {
      const ibvs_real length = h->lengths[index_of(h, later)];
      twice += length * once;
      once += length;
    }
    for (uint32_t i = 0; i < IBVS_MOTION_STATES; ++i) {
      row[i] += changes[i] + once * changes[IBVS_MOTION_STATES + i] + twice * changes[2 * IBVS_MOTION_STATES + i];
    }
  }
}

static void set_entries(ibvs_tick_history *h, uint32_t entry, const ibvs_real values[2]) {
  const ibvs_real first = values[0], second = values[1]; /* they may be those of a row */
  for (uint32_t i = 0; i < IBVS_HISTORY; ++i) {
    h->rows[i][entry] = first;
    h->rows[i][entry + 1] = second;
  }
}

void ibvs_attitude_at(const ibvs_flight *f, int64_t stamp_ns, ibvs_real attitude[4]) {
  const ibvs_tick_history *h = &f->history;
  memcpy(attitude, &h->rows[index_of(h, nearest(h, stamp_ns))][IBVS_MOTION_STATES], 4 * sizeof *attitude);
}

void ibvs_motion_reset(ibvs_flight *f) {
  f->variance[0] = f->variance[1] = IBVS_VELOCITY_STD * IBVS_VELOCITY_STD;
  f->velocity_age_s = INFINITY;
  f->lines_ns = f->refused_ns = f->velocity_ns = f->corrected_ns = f->gap_end_ns = -1;
}

void ibvs_motion_doubt(ibvs_flight *f) {
  f->motion_doubt = true;
  f->variance[0] = f->variance[1] = IBVS_GAP_VELOCITY_STD * IBVS_GAP_VELOCITY_STD;
  if (f->history.count > 0) {
    set_entries(&f->history, IBVS_MOTION_VELOCITY, &newest(&f->history)[IBVS_MOTION_VELOCITY]);
  }
}

void ibvs_evaluate(ibvs_flight *f, ibvs_function *function, const ibvs_real *inputs, ibvs_real *states, uint32_t count,
                   ibvs_real *results) {
  ibvs_real sum;
  const ibvs_real *arguments[] = {inputs, states};
  ibvs_real *outputs[] = {f->next_states, &sum, results};
  function(arguments, outputs);
  if (isfinite(sum)) { /* the states stay where one of the next ones is not finite */
    memcpy(states, f->next_states, count * sizeof *states);
  }
}

void ibvs_remember(ibvs_flight *f, int64_t stamp_ns, ibvs_real dt) {
  ibvs_estimates *now = &f->now;
  uint32_t kept = 0;
  if (f->tick_ns >= 0 && f->tick_ns < stamp_ns - IBVS_GAP_NS) {
    ibvs_motion_doubt(f);
    f->gap_end_ns = stamp_ns;
  }
  add(&f->history, stamp_ns, f->predict_states, dt);
  f->tick_ns = stamp_ns;
  f->density = f->predicted[IBVS_PREDICTED_DENSITY];
  for (uint32_t i = 0; i < now->line_count; ++i) {
    ibvs_tracked_line line = now->lines[i];
    const ibvs_real age = SECONDS(stamp_ns - line.fresh_ns);
    line.offset = newest(&f->history)[IBVS_MOTION_LINES + line.slot];
    line.weight = line.fresh_weight;
    if (age > IBVS_FADE_END_S) {
      continue;
    }
    if (age > IBVS_FADE_START_S) {
      line.weight *= (IBVS_FADE_END_S - age) / (IBVS_FADE_END_S - IBVS_FADE_START_S);
    }
    now->lines[kept] = line;
    kept += 1;
  }
  now->line_count = kept;
  f->velocity_age_s = f->velocity_ns >= 0 ? SECONDS(stamp_ns - f->velocity_ns) : (ibvs_real)INFINITY;
}

/* Correct with the measurement in the inputs, of a time at a place of the history. */
static void evaluate(ibvs_flight *f, uint32_t place, int64_t stamp_ns, const ibvs_real wall[7]) {
  ibvs_real *in = f->correct_inputs;
  in[IBVS_CORRECT_ELAPSED] = f->corrected_ns >= 0 ? SECONDS(f->tick_ns - f->corrected_ns) : 0;
  in[IBVS_CORRECT_DENSITY] = f->density;
  in[IBVS_CORRECT_DOUBT] = f->motion_doubt ? 1 : 0;
  memcpy(&in[IBVS_CORRECT_PAST], f->history.rows[index_of(&f->history, place)], IBVS_MOTION_STATES * sizeof *in);
  in[IBVS_CORRECT_AGE] = SECONDS(f->tick_ns - stamp_ns);
  memcpy(&in[IBVS_CORRECT_NORMAL], wall, 7 * sizeof *in); /* with gravity and distance, which follow it */
  ibvs_evaluate(f, ibvs_correct, in, f->correct_states, IBVS_CORRECT_STATES, f->corrected);
  f->motion_doubt = false;
  f->corrected_ns = f->tick_ns;
  memcpy(f->variance, &f->corrected[IBVS_CORRECTED_VARIANCE], sizeof f->variance);
}

void ibvs_correct_velocity(ibvs_flight *f, const ibvs_features *features, int64_t stamp_ns, int64_t velocity_ns,
                           const ibvs_real wall[7]) {
  const int32_t place = find(&f->history, velocity_ns);
  const ibvs_real *found = f->corrected;
  ibvs_real *in = f->correct_inputs;
  if (place >= 0) {
    memset(in, 0, sizeof f->correct_inputs);
    in[IBVS_CORRECT_VELOCITY_NEW] = 1;
    memcpy(&in[IBVS_CORRECT_VELOCITY], features->velocity, sizeof features->velocity);
    memcpy(&in[IBVS_CORRECT_VELOCITY_COVARIANCE], features->velocity_covariance, sizeof features->velocity_covariance);
    in[IBVS_CORRECT_REFUSED_LONG] = f->refused_ns >= 0 && SECONDS(stamp_ns - f->refused_ns) > IBVS_REFUSAL_S ? 1 : 0;
    evaluate(f, (uint32_t)place, velocity_ns, wall);
    if (found[IBVS_CORRECTED_ACCEPTED] != 0) {
      change(&f->history, (uint32_t)place, &found[IBVS_CORRECTED_CHANGES]);
      f->velocity_ns = stamp_ns;
      f->refused_ns = -1;
      return;
    }
  }
  f->refused_ns = f->refused_ns < 0 ? stamp_ns : f->refused_ns;
  if (place >= 0 && found[IBVS_CORRECTED_RESTART] != 0) {
    set_entries(&f->history, IBVS_MOTION_VELOCITY, &found[IBVS_CORRECTED_SEEN_VELOCITY]);
    set_entries(&f->history, IBVS_MOTION_BIAS, &newest(&f->history)[IBVS_MOTION_BIAS]);
    f->refused_ns = -1;
  }
}

static uint32_t find_line(const ibvs_estimates *now, int64_t track_id) {
  uint32_t index = 0;
  while (index < now->line_count && now->lines[index].track_id != track_id) {
    index += 1;
  }
  return index;
}

static uint32_t free_slot(const ibvs_estimates *now) {
  bool taken[IBVS_TRACKS] = {false};
  uint32_t slot = 0;
  for (uint32_t i = 0; i < now->line_count; ++i) {
    taken[now->lines[i].slot] = true;
  }
  while (taken[slot]) { /* one is free: the caller has checked it */
    slot += 1;
  }
  return slot;
}

void ibvs_correct_line(ibvs_flight *f, const ibvs_line_feature *line, int64_t track_id, int64_t stamp_ns,
                       const ibvs_real wall[7]) {
  ibvs_tick_history *h = &f->history;
  ibvs_estimates *now = &f->now;
  const int32_t place = find(h, stamp_ns);
  const uint32_t index = find_line(now, track_id);
  const bool starts = index == now->line_count;
  if (starts ? now->line_count == IBVS_TRACKS : place < 0) {
    return;
  }
  ibvs_tracked_line *track = &now->lines[index]; /* counted once its first offset is accepted */
  if (starts) {
    *track = (ibvs_tracked_line){.track_id = track_id, .role = line->role, .slot = free_slot(now),
                                 .seen_ns = stamp_ns, .angle_variance = IBVS_FIRST_ANGLE_VARIANCE};
  }
  const ibvs_edge kind = line->kind != IBVS_UNKNOWN_EDGE ? line->kind : track->kind;
  const ibvs_real *found = f->corrected, *rates = &f->corrected[IBVS_CORRECTED_RATES];
  ibvs_real *in = f->correct_inputs;
  memset(in, 0, sizeof f->correct_inputs);
  in[IBVS_CORRECT_LINE_NEW] = 1;
  in[IBVS_CORRECT_SLOT] = (ibvs_real)track->slot;
  in[IBVS_CORRECT_STARTS] = starts ? 1 : 0;
  in[IBVS_CORRECT_SEEN_S] = SECONDS(stamp_ns - track->seen_ns);
  in[IBVS_CORRECT_LINE] = line->rho;
  in[IBVS_CORRECT_LINE + 1] = line->theta;
  in[IBVS_CORRECT_LINE + 2] = line->variance;
  in[IBVS_CORRECT_VERTICAL] = line->role == IBVS_VERTICAL ? 1 : 0;
  in[IBVS_CORRECT_PAINT] = kind == IBVS_PAINT_EDGE ? 1 : 0;
  if (line->has_segment) {
    memcpy(&in[IBVS_CORRECT_ENDS], line->segment, sizeof line->segment);
  }
  evaluate(f, place < 0 ? h->count - 1 : (uint32_t)place, stamp_ns, wall);
  if (found[IBVS_CORRECTED_ACCEPTED] == 0) {
    track->residual = found[IBVS_CORRECTED_RESIDUAL];
    if (found[IBVS_CORRECTED_TRACK_ENDS] != 0) {
      now->line_count -= 1;
      memmove(track, track + 1, (now->line_count - index) * sizeof *track);
    }
    return;
  }
  if (starts) {
    const uint32_t entry = IBVS_MOTION_LINES + track->slot;
    const ibvs_real *origin = place < 0 ? NULL : &h->rows[index_of(h, (uint32_t)place)][IBVS_MOTION_ODOMETER];
    for (uint32_t i = 0; i < IBVS_HISTORY; ++i) { /* the odometer carries the offset from the capture to every tick */
      const ibvs_real *way = &h->rows[i][IBVS_MOTION_ODOMETER];
      const ibvs_real along =
          origin == NULL ? 0 : (way[0] - origin[0]) * rates[0] + (way[1] - origin[1]) * rates[1];
      h->rows[i][entry] = found[IBVS_CORRECTED_OFFSET] + along;
    }
    now->line_count += 1;
    track->offset = newest(h)[entry];
  } else {
    change(h, (uint32_t)place, &found[IBVS_CORRECTED_CHANGES]);
    track->angle_variance = found[IBVS_CORRECTED_ANGLE_VARIANCE];
  }
  memcpy(&f->predict_inputs[IBVS_PREDICT_RATES + 2 * track->slot], rates, 2 * sizeof *rates);
  const bool seen = line->has_segment && found[IBVS_CORRECTED_LENGTH] >= 0;
  track->pictures = (uint32_t)found[IBVS_CORRECTED_FRAMES];
  track->angle = found[IBVS_CORRECTED_ANGLE];
  track->deviation = found[IBVS_CORRECTED_DEVIATION];
  track->residual = found[IBVS_CORRECTED_RESIDUAL];
  track->seen_angle = found[IBVS_CORRECTED_SEEN_ANGLE];
  track->middle = seen ? found[IBVS_CORRECTED_MIDDLE] : (ibvs_real)NAN;
  track->length = seen ? found[IBVS_CORRECTED_LENGTH] : 0;
  track->seen_ns = stamp_ns;
  track->fresh_ns = f->tick_ns;
  track->fresh_weight = r_fmin(1, (ibvs_real)track->pictures / IBVS_FRAMES_TO_TRUST) * line->weight;
  track->surface_side = (int32_t)found[IBVS_CORRECTED_SIGN] * line->surface_side;
  track->kind = kind;
  f->lines_ns = stamp_ns;
}

/* Lines alone may give the velocity; the next prediction begins from the corrected motion. */
void ibvs_end_correction(ibvs_flight *f, int64_t stamp_ns) {
  if (f->lines_ns == stamp_ns && r_fmax(f->variance[0], f->variance[1]) < IBVS_KNOWN_STD * IBVS_KNOWN_STD) {
    f->velocity_ns = stamp_ns;
  }
  memcpy(f->predict_states, ibvs_motion(f), IBVS_MOTION_STATES * sizeof *f->predict_states);
}
