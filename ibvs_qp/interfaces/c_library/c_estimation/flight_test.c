/* Replays the recorded flight in two instances, of which one was reset. Returns 0 where all thrusts are Python's. */
#include <math.h>
#include <stdio.h>

#include "ibvs_recorded_flight.h"

static ibvs_flight one, other;

static double step(ibvs_flight *flight, const ibvs_recorded_tick *recorded) {
  ibvs_estimates estimates;
  ibvs_command_result command;
  double largest = 0;
  ibvs_estimate(flight, &recorded->frame, recorded->features, &estimates);
  ibvs_command(flight, &recorded->reference, recorded->followed, recorded->count, &command);
  for (int i = 0; i < IBVS_ROTORS; ++i) {
    largest = fmax(largest, fabs((double)(command.thrusts[i] - recorded->thrusts[i])));
  }
  return largest;
}

int main(void) {
  double largest = 0;
  ibvs_flight_init(&one);
  ibvs_flight_init(&other);
  (void)step(&other, &ibvs_recorded_flight[IBVS_RECORDED_FLIGHT_TICKS / 2]);
  ibvs_flight_reset(&other);
  for (int tick = 0; tick < IBVS_RECORDED_FLIGHT_TICKS; ++tick) {
    largest = fmax(largest, step(&one, &ibvs_recorded_flight[tick]));
    largest = fmax(largest, step(&other, &ibvs_recorded_flight[tick]));
  }
  const int agrees = largest <= (double)IBVS_RECORDED_FLIGHT_TOLERANCE;
  printf("%s: %d ticks with estimation, largest difference %.3g N of %.3g N\n", agrees ? "passed" : "FAILED",
         IBVS_RECORDED_FLIGHT_TICKS, largest, (double)IBVS_RECORDED_FLIGHT_TOLERANCE);
  return agrees ? 0 : 1;
}
