/* Control loop at 250 Hz without an operating system: the system timer's interrupt starts a step.
 *
 * read_sensors and write_thrusts are the vehicle's; these stand for one that hovers. */
#include "ibvs_qp.h"

#define CLOCK_HZ 25000000U /* of the processor */
#define TICK_NS 4000000
#define TIMER_CONTROL (*(volatile uint32_t *)0xE000E010U)
#define TIMER_RELOAD (*(volatile uint32_t *)0xE000E014U)
#define TIMER_VALUE (*(volatile uint32_t *)0xE000E018U)
#define TIMER_ON 7U /* processor clock, interrupt, enabled */

void tick_interrupt(void);
extern volatile ibvs_real motor_commands[IBVS_ROTORS];

static ibvs_controller controller;
static volatile uint32_t ticks;
volatile ibvs_real motor_commands[IBVS_ROTORS]; /* [N]; read by the motors' timers */

void tick_interrupt(void) { ticks += 1; }

static void read_sensors(int64_t now_ns, ibvs_measurement *m) {
  *m = (ibvs_measurement){.stamp_ns = now_ns, .attitude = {1, 0, 0, 0}, .wrench_stamp_ns = now_ns};
}

static void write_thrusts(const ibvs_command_result *command) {
  for (int i = 0; i < IBVS_ROTORS; ++i) {
    motor_commands[i] = command->thrusts[i];
  }
}

int main(void) {
  static ibvs_measurement measurement;
  static ibvs_command_result command;
  const ibvs_reference reference = {.standoff = 1};
  uint32_t done = 0;
  ibvs_init(&controller);
  TIMER_RELOAD = CLOCK_HZ / 250 - 1;
  TIMER_VALUE = 0;
  TIMER_CONTROL = TIMER_ON;
  for (;;) {
    while (done == ticks) {
      __asm volatile("wfi");
    }
    done = ticks; /* a late step skips ticks: its stamp gives the time that has passed */
    read_sensors((int64_t)done * TICK_NS, &measurement);
    ibvs_step(&controller, &measurement, &reference, &command);
    write_thrusts(&command);
  }
}
