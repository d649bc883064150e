/* Replays the recorded flight in two instances, of which one was reset, then flies it again with broken inputs.
 *
 * flight_test [COUNT]: so many ticks with broken inputs, 20,000 without. Returns 0 where all holds. */
#include <stdio.h>
#include <stdlib.h>

#include "broken_inputs.h"
#include "ibvs_recorded_flight.h"
#include "recorded_comparison.h"

#define DEFAULT_BROKEN 20000

static ibvs_flight one, other;

static void step(ibvs_flight *flight, uint32_t tick, comparison *all) {
  const ibvs_recorded_tick *recorded = &ibvs_recorded_flight[tick];
  ibvs_estimates estimates;
  ibvs_command_result command;
  ibvs_estimate(flight, &recorded->frame, recorded->features, &estimates);
  ibvs_command(flight, &recorded->reference, recorded->followed, recorded->count, &command);
  compare(all, &flight->controller, &command, recorded->thrusts, (double)IBVS_RECORDED_FLIGHT_TOLERANCE);
}

static comparison replay(void) {
  const ibvs_other_solution *other_solution = ibvs_flight_others;
  comparison all = {0};
  ibvs_flight_init(&one);
  ibvs_flight_init(&other);
  step(&other, IBVS_RECORDED_FLIGHT_TICKS / 2, &(comparison){0});
  ibvs_flight_reset(&other);
  for (uint32_t tick = 0; tick < IBVS_RECORDED_FLIGHT_TICKS; ++tick) {
    const ibvs_recorded_tick *recorded = &ibvs_recorded_flight[tick];
    step(&one, tick, &all);
    step(&other, tick, &all);
    const bool others = other_solution->tick == tick;
    if (tick > 0) {
      const ibvs_real *before = ibvs_recorded_flight[tick - 1].thrusts;
      ibvs_follow(&one.controller, before, recorded->thrusts, others ? other_solution : NULL);
      ibvs_follow(&other.controller, before, recorded->thrusts, others ? other_solution : NULL);
    }
    other_solution += others ? 1 : 0;
  }
  return all;
}

static void break_frame(ibvs_frame *frame) {
  switch (below(40)) { /* inertial sensors fail seldom: the other ticks have estimates */
    case 0: frame->stamp_ns = broken_stamp(frame->stamp_ns); break;
    case 1: break_entries(frame->attitude, 4); break;
    case 2: break_entries(frame->angular_velocity, 3); break;
    case 3: break_entries(frame->specific_force, 3); break;
    case 4: case 5: case 6: break_entries(frame->wrench, 6); break;
    case 7: case 8: frame->wrench_stamp_ns = broken_stamp(frame->wrench_stamp_ns); break;
    case 9: frame->has_thrust_max = true; break_entries(frame->thrust_max, IBVS_ROTORS); break;
    default: break;
  }
}

static void break_features(ibvs_features *features) {
  ibvs_line_feature *line = &features->lines[below(IBVS_MOST_LINES)];
  switch (below(12)) {
    case 0: features->stamp_ns = broken_stamp(features->stamp_ns); break;
    case 1: break_entries(features->plane, 4); break;
    case 2: features->has_plane = features->has_velocity = false; break;
    case 3: break_entries(features->velocity, 3); break;
    case 4: break_entries(features->velocity_covariance, 9); break;
    case 5: features->velocity_stamp_ns = broken_stamp(features->velocity_stamp_ns); break;
    case 6: features->line_count = below(3) == 0 ? UINT32_MAX : below(IBVS_MOST_LINES + 2); break;
    case 7: line->rho = broken_number(line->rho); break;
    case 8: line->variance = broken_number(line->variance); break;
    case 9: line->has_segment = true; break_entries(line->segment, 4); break;
    case 10: line->track_id = (int64_t)below(IBVS_TRACKS + 4) - 2; break;
    default: line->surface_side = (int32_t)below(5) - 2; break;
  }
}

static uint32_t fly_broken(uint32_t count) {
  ibvs_estimates estimates;
  ibvs_command_result command;
  ibvs_real before[IBVS_ROTORS];
  uint32_t unsound = 0;
  for (uint32_t k = 0; k < count; ++k) {
    const uint32_t tick = k % IBVS_RECORDED_FLIGHT_TICKS;
    const ibvs_recorded_tick *recorded = &ibvs_recorded_flight[tick];
    if (tick == 0) {
      ibvs_flight_reset(&one);
    }
    ibvs_frame frame = recorded->frame;
    ibvs_features features = {0};
    ibvs_reference reference = recorded->reference;
    int64_t followed[IBVS_LINES];
    memcpy(followed, recorded->followed, sizeof followed);
    break_frame(&frame);
    if (recorded->features != NULL) {
      features = *recorded->features;
      while (below(3) != 0) {
        break_features(&features);
      }
    }
    if (below(3) == 0) {
      break_reference(&reference);
      followed[0] = below(IBVS_TRACKS);
    }
    ibvs_estimate(&one, &frame, recorded->features == NULL ? NULL : &features, &estimates);
    ibvs_command(&one, &reference, followed, recorded->count, &command);
    const bool finite = ibvs_finite(estimates.normal, 3) && ibvs_finite(estimates.velocity, 2) &&
                        ibvs_finite(estimates.odometer, 2) && ibvs_finite(estimates.wrench, 6);
    unsound += finite && sound(&command, tick > 0 ? before : NULL) ? 0 : 1;
    memcpy(before, command.thrusts, sizeof before);
  }
  return unsound;
}

int main(int count, char **words) {
  const comparison all = replay();
  const bool good = agrees(&all, "ticks with estimation, in two instances", (double)IBVS_RECORDED_FLIGHT_TOLERANCE);
  const uint32_t broken = count > 1 ? (uint32_t)strtoul(words[1], NULL, 10) : DEFAULT_BROKEN;
  const uint32_t unsound = fly_broken(broken);
  printf("%s: %u ticks of estimation with broken inputs, %u unsound\n", unsound == 0 ? "passed" : "FAILED",
         (unsigned)broken, (unsigned)unsound);
  return good && unsound == 0 ? 0 : 1;
}
