/* Vectors and start of a Cortex-M with a floating-point unit: memory, unit, main. */
#include <stdint.h>
#include <string.h>

extern uint32_t stack_top, data_start, data_end, data_load, bss_start, bss_end;
int main(void);
void reset(void);
void fault(void);
void tick_interrupt(void);

#define COPROCESSOR_ACCESS (*(volatile uint32_t *)0xE000ED88U)
#define FLOATING_POINT (0xFU << 20)

__attribute__((weak)) void fault(void) {
  for (;;) {
  }
}

__attribute__((weak)) void tick_interrupt(void) {}

void reset(void) {
  COPROCESSOR_ACCESS |= FLOATING_POINT;
  __asm volatile("dsb\n isb");
  memcpy(&data_start, &data_load, (size_t)((uintptr_t)&data_end - (uintptr_t)&data_start));
  memset(&bss_start, 0, (size_t)((uintptr_t)&bss_end - (uintptr_t)&bss_start));
  (void)main();
  for (;;) {
  }
}

/* Stack, then reset, faults, and the system timer's interrupt as the last of sixteen. */
__attribute__((section(".vectors"), used)) const uintptr_t vectors[16] = {
    (uintptr_t)&stack_top, (uintptr_t)reset, (uintptr_t)fault, (uintptr_t)fault, (uintptr_t)fault, (uintptr_t)fault,
    (uintptr_t)fault, 0, 0, 0, 0, (uintptr_t)fault, (uintptr_t)fault, 0, (uintptr_t)fault, (uintptr_t)tick_interrupt};
