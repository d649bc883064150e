/* Replays the recorded ticks in QEMU; one line a tick: iterations, whether a limit is active, instructions,
 * outcome, and the largest difference from the thrusts of Python [nN]. Then the deepest stack [bytes]. */
#include "ibvs_recorded_ticks.h"
#include "replay.h"

static ibvs_controller controller;
static ibvs_command_result command;

int main(void) {
  start();
  ibvs_init(&controller);
  for (uint32_t tick = 0; tick < IBVS_RECORDED_TICKS; ++tick) {
    const uint32_t begin = TIMER_VALUE;
    ibvs_step(&controller, &ibvs_recorded_measurements[tick], &ibvs_recorded_references[tick], &command);
    print_tick(&command, ibvs_recorded_thrusts[tick], (begin - TIMER_VALUE) & TIMER_MASK);
  }
  print_stack();
  stop(0);
  return 0;
}
