/* Replays the recorded flight in QEMU, as replay.c. */
#include "ibvs_recorded_flight.h"
#include "replay.h"

static ibvs_flight flight;
static ibvs_estimates estimates;
static ibvs_command_result command;

int main(void) {
  start();
  ibvs_flight_init(&flight);
  for (uint32_t tick = 0; tick < IBVS_RECORDED_FLIGHT_TICKS; ++tick) {
    const ibvs_recorded_tick *recorded = &ibvs_recorded_flight[tick];
    const uint32_t begin = TIMER_VALUE;
    ibvs_estimate(&flight, &recorded->frame, recorded->features, &estimates);
    ibvs_command(&flight, &recorded->reference, recorded->followed, recorded->count, &command);
    print_tick(&command, recorded->thrusts, (begin - TIMER_VALUE) & TIMER_MASK);
  }
  print_stack();
  stop(0);
  return 0;
}
