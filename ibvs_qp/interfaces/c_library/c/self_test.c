/* Replays the recorded flight in two instances, then flies it again with broken inputs.
 *
 * self_test [COUNT]: so many ticks with broken inputs, 20,000 without. Returns 0 where all holds. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "broken_inputs.h"
#include "ibvs_recorded_ticks.h"
#include "recorded_comparison.h"

#define DEFAULT_BROKEN 20000

static ibvs_controller one, other;

/* The second instance is reset half way and must not matter. */
static comparison replay(void) {
  ibvs_command_result command, second;
  const ibvs_other_solution *other_solution = ibvs_recorded_others;
  comparison all = {0};
  ibvs_init(&one);
  ibvs_init(&other);
  for (uint32_t tick = 0; tick < IBVS_RECORDED_TICKS; ++tick) {
    ibvs_step(&one, &ibvs_recorded_measurements[tick], &ibvs_recorded_references[tick], &command);
    if (tick == IBVS_RECORDED_TICKS / 2) {
      ibvs_reset(&other);
    }
    ibvs_step(&other, &ibvs_recorded_measurements[tick], &ibvs_recorded_references[tick], &second);
    compare(&all, &one, &command, ibvs_recorded_thrusts[tick], (double)IBVS_RECORDED_TOLERANCE);
    const bool others = other_solution->tick == tick;
    if (tick > 0) {
      ibvs_follow(&one, ibvs_recorded_thrusts[tick - 1], ibvs_recorded_thrusts[tick], others ? other_solution : NULL);
    }
    other_solution += others ? 1 : 0;
  }
  return all;
}

static void break_measurement(ibvs_measurement *m) {
  switch (below(16)) {
    case 0: m->stamp_ns = broken_stamp(m->stamp_ns); break;
    case 1: break_entries(m->attitude, 4); break;
    case 2: break_entries(m->angular_velocity, 3); break;
    case 3: break_entries(m->specific_force, 3); break;
    case 4: break_entries(m->contact_wrench, 6); break;
    case 5: m->wrench_stamp_ns = broken_stamp(m->wrench_stamp_ns); break;
    case 6: break_entries(m->velocity, 3); break;
    case 7: m->velocity_stamp_ns = broken_stamp(m->velocity_stamp_ns); m->has_velocity_stamp = true; break;
    case 8: break_entries(m->plane, 4); break;
    case 9: m->plane_stamp_ns = broken_stamp(m->plane_stamp_ns); break;
    case 10: m->has_thrust_max = true; break_entries(m->thrust_max, IBVS_ROTORS); break;
    case 11: m->has_thrust_min = true; break_entries(m->thrust_min, IBVS_ROTORS); break;
    case 12: m->line_count = below(3) == 0 ? UINT32_MAX : below(IBVS_MOST_LINES + 2); break;
    case 13: m->lines[0].rho = broken_number(m->lines[0].rho); break;
    case 14: m->lines[0].stamp_ns = broken_stamp(m->lines[0].stamp_ns); break;
    default: m->has_specific_force = m->has_velocity = m->has_plane = false; break;
  }
}

static uint32_t fly_broken(uint32_t count) {
  ibvs_command_result command;
  ibvs_real before[IBVS_ROTORS];
  uint32_t unsound = 0;
  bool commanded = false;
  for (uint32_t k = 0; k < count; ++k) {
    const uint32_t tick = k % IBVS_RECORDED_TICKS;
    if (tick == 0) {
      ibvs_reset(&one);
      commanded = false;
    }
    ibvs_measurement m = ibvs_recorded_measurements[tick];
    ibvs_reference r = ibvs_recorded_references[tick];
    while (below(3) != 0) {
      break_measurement(&m);
    }
    if (below(3) == 0) {
      break_reference(&r);
    }
    if (below(50) == 0) {
      one.gains.attitude_kp = broken_number(one.gains.attitude_kp);
    }
    ibvs_step(&one, &m, &r, &command);
    unsound += sound(&command, commanded ? before : NULL) ? 0 : 1;
    memcpy(before, command.thrusts, sizeof before);
    commanded = true;
  }
  return unsound;
}

int main(int count, char **words) {
  const comparison all = replay();
  const bool good = agrees(&all, "recorded ticks", (double)IBVS_RECORDED_TOLERANCE);
  const uint32_t broken = count > 1 ? (uint32_t)strtoul(words[1], NULL, 10) : DEFAULT_BROKEN;
  const uint32_t unsound = fly_broken(broken);
  printf("%s: %u ticks with broken inputs, %u unsound commands\n", unsound == 0 ? "passed" : "FAILED",
         (unsigned)broken, (unsigned)unsound);
  return good && unsound == 0 ? 0 : 1;
}
