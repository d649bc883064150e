/* Report of a replay in QEMU: instructions of a tick, thrusts, stack.
 *
 * With -icount shift=0 an instruction takes a nanosecond of the machine's time, and its timer counts every 40. */
#ifndef IBVS_REPLAY_H
#define IBVS_REPLAY_H

#include "ibvs_internal.h"

#define TIMER_CONTROL (*(volatile uint32_t *)0xE000E010U)
#define TIMER_RELOAD (*(volatile uint32_t *)0xE000E014U)
#define TIMER_VALUE (*(volatile uint32_t *)0xE000E018U)
#define TIMER_ON 5U             /* processor clock, enabled */
#define TIMER_MASK 0xFFFFFFU
#define INSTRUCTIONS_A_COUNT 40U /* of a timer at 25 MHz */
#define STACK_BYTES 65536U
#define UNTOUCHED 0xA5A5A5A5U

void fault(void);
extern uint32_t stack_top;

static void semihost(uint32_t operation, const void *argument) {
  register uint32_t r0 __asm("r0") = operation;
  register const void *r1 __asm("r1") = argument;
  __asm volatile("bkpt 0xAB" : "+r"(r0) : "r"(r1) : "memory");
}

static void print(const char *text) { semihost(0x04, text); }

static void print_number(uint64_t value, const char *end) {
  char digits[24];
  uint32_t place = sizeof digits;
  digits[--place] = 0;
  do {
    digits[--place] = (char)('0' + value % 10U);
    value /= 10U;
  } while (value > 0);
  print(&digits[place]);
  print(end);
}

static void stop(uint32_t code) {
  const uint32_t reason[] = {0x20026U, code}; /* application exit */
  semihost(0x20, reason);
}

void fault(void) {
  print("fault\n");
  stop(1);
}

static void start(void) {
  for (uint32_t *word = &stack_top - STACK_BYTES / 4U; word < (uint32_t *)__builtin_frame_address(0) - 64; ++word) {
    *word = UNTOUCHED;
  }
  TIMER_RELOAD = TIMER_MASK;
  TIMER_VALUE = 0;
  TIMER_CONTROL = TIMER_ON;
}

/* One line of a tick. */
static void print_tick(const ibvs_command_result *command, const ibvs_real *thrusts, uint32_t counts) {
  ibvs_real difference = 0;
  bool limited = false;
  for (uint32_t i = 0; i < IBVS_ROTORS; ++i) {
    difference = r_fmax(difference, r_fabs(command->thrusts[i] - thrusts[i]));
  }
  for (uint32_t i = 0; i < IBVS_ROWS; ++i) {
    limited = limited || command->multipliers[i] != 0;
  }
  print_number((uint64_t)command->iterations, " ");
  print_number(limited ? 1U : 0U, " ");
  print_number((uint64_t)counts * INSTRUCTIONS_A_COUNT, " ");
  print_number((uint64_t)command->outcome, " ");
  print_number((uint64_t)(difference * (ibvs_real)1e9), "\n");
}

static void print_stack(void) {
  const uint32_t *word = &stack_top - STACK_BYTES / 4U;
  while (*word == UNTOUCHED) {
    word += 1;
  }
  print("stack ");
  print_number((uint64_t)((uintptr_t)&stack_top - (uintptr_t)word), "\n");
}

#endif
