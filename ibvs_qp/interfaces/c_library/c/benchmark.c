/* Time of a step over the recorded flight: median, 99th percentile and most. */
#define _POSIX_C_SOURCE 199309L
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include "ibvs_qp.h"
#include "ibvs_recorded_ticks.h"

#define ROUNDS 10

static ibvs_controller controller;
static double times[ROUNDS * IBVS_RECORDED_TICKS];

static double now_us(void) {
  struct timespec now;
  (void)clock_gettime(CLOCK_MONOTONIC, &now);
  return 1e6 * (double)now.tv_sec + 1e-3 * (double)now.tv_nsec;
}

static int rising(const void *one, const void *other) {
  const double a = *(const double *)one, b = *(const double *)other;
  return (a > b) - (a < b);
}

int main(void) {
  ibvs_command_result command;
  uint32_t count = 0, iterations = 0;
  ibvs_init(&controller);
  for (uint32_t round = 0; round < ROUNDS; ++round) {
    ibvs_reset(&controller);
    for (uint32_t tick = 0; tick < IBVS_RECORDED_TICKS; ++tick) {
      const double begin = now_us();
      ibvs_step(&controller, &ibvs_recorded_measurements[tick], &ibvs_recorded_references[tick], &command);
      times[count] = now_us() - begin;
      count += 1;
      iterations += (uint32_t)command.iterations;
    }
  }
  qsort(times, count, sizeof times[0], rising);
  printf("%u steps: median %.1f us, 99th percentile %.1f us, most %.1f us; %.1f iterations of OSQP a step\n", count,
         times[count / 2], times[count * 99 / 100], times[count - 1], (double)iterations / count);
  printf("%.1f kB per instance\n", 1e-3 * (double)sizeof controller);
  return 0;
}
