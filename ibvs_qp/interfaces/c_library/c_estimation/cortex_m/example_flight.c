/* Control loop at 250 Hz with estimation and without an operating system: the system timer's interrupt starts a tick.
 *
 * read_sensors, read_features and write_thrusts are the vehicle's; these stand for one that hovers. */
#include "ibvs_estimation.h"

#define CLOCK_HZ 25000000U /* of the processor */
#define TICK_NS 4000000
#define TIMER_CONTROL (*(volatile uint32_t *)0xE000E010U)
#define TIMER_RELOAD (*(volatile uint32_t *)0xE000E014U)
#define TIMER_VALUE (*(volatile uint32_t *)0xE000E018U)
#define TIMER_ON 7U /* processor clock, interrupt, enabled */

void tick_interrupt(void);
extern volatile ibvs_real motor_commands[IBVS_ROTORS];

static ibvs_flight flight;
static volatile uint32_t ticks;
volatile ibvs_real motor_commands[IBVS_ROTORS]; /* [N]; read by the motors' timers */

void tick_interrupt(void) { ticks += 1; }

static void read_sensors(int64_t now_ns, ibvs_frame *frame) {
  *frame = (ibvs_frame){.stamp_ns = now_ns, .attitude = {1, 0, 0, 0}, .specific_force = {0, 0, -IBVS_GRAVITY},
                        .wrench_stamp_ns = now_ns};
}

/* Features of a picture that has come since the last tick, or NULL. */
static const ibvs_features *read_features(void) { return NULL; }

static void write_thrusts(const ibvs_command_result *command) {
  for (int i = 0; i < IBVS_ROTORS; ++i) {
    motor_commands[i] = command->thrusts[i];
  }
}

/* Keeps the stand-off, and follows the first tracked line. */
static uint32_t plan(const ibvs_estimates *estimates, ibvs_reference *reference, int64_t *followed) {
  *reference = (ibvs_reference){.standoff = 1};
  if (estimates->line_count == 0) {
    return 0;
  }
  reference->lines[0] = ibvs_line_target(estimates, &estimates->lines[0], 0);
  reference->line_count = 1;
  *followed = estimates->lines[0].track_id;
  return 1;
}

int main(void) {
  static ibvs_frame frame;
  static ibvs_estimates estimates;
  static ibvs_reference reference;
  static ibvs_command_result command;
  int64_t followed = 0;
  uint32_t done = 0;
  ibvs_flight_init(&flight);
  TIMER_RELOAD = CLOCK_HZ / 250 - 1;
  TIMER_VALUE = 0;
  TIMER_CONTROL = TIMER_ON;
  for (;;) {
    while (done == ticks) {
      __asm volatile("wfi");
    }
    done = ticks; /* a late tick skips others: its stamp gives the time that has passed */
    read_sensors((int64_t)done * TICK_NS, &frame);
    ibvs_estimate(&flight, &frame, read_features(), &estimates);
    const uint32_t count = plan(&estimates, &reference, &followed);
    ibvs_command(&flight, &reference, &followed, count, &command);
    write_thrusts(&command);
  }
}
