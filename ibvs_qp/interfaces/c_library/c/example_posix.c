/* Control loop at 250 Hz on a POSIX system: wait for the tick, read the sensors, step, write the thrusts.
 *
 * read_sensors and write_thrusts are the vehicle's; these stand for one that hovers. Run it with the scheduling class
 * SCHED_FIFO and locked memory (mlockall) on a real vehicle. */
#define _POSIX_C_SOURCE 200112L
#include <errno.h>
#include <stdio.h>
#include <time.h>

#include "ibvs_qp.h"

#define TICK_NS 4000000L
#define SECOND_NS 1000000000L
#define TICKS 250

static ibvs_controller controller;

static void read_sensors(int64_t now_ns, ibvs_measurement *m) {
  *m = (ibvs_measurement){.stamp_ns = now_ns, .attitude = {1, 0, 0, 0}, .wrench_stamp_ns = now_ns};
}

static void write_thrusts(const ibvs_command_result *command) {
  if (command->rejected != 0) {
    (void)fprintf(stderr, "rejected: 0x%x\n", (unsigned)command->rejected);
  }
}

int main(void) {
  const ibvs_reference reference = {.standoff = 1};
  ibvs_measurement measurement;
  ibvs_command_result command;
  struct timespec next;
  ibvs_init(&controller);
  (void)clock_gettime(CLOCK_MONOTONIC, &next);
  for (int tick = 0; tick < TICKS; ++tick) {
    read_sensors((int64_t)next.tv_sec * SECOND_NS + next.tv_nsec, &measurement);
    ibvs_step(&controller, &measurement, &reference, &command);
    write_thrusts(&command);
    next.tv_nsec += TICK_NS;
    if (next.tv_nsec >= SECOND_NS) {
      next.tv_nsec -= SECOND_NS;
      next.tv_sec += 1;
    }
    while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &next, NULL) == EINTR) {
    }
  }
  printf("%d ticks, last thrusts", TICKS);
  for (int i = 0; i < IBVS_ROTORS; ++i) {
    printf(" %.2f", (double)command.thrusts[i]);
  }
  printf(" N\n");
  return 0;
}
