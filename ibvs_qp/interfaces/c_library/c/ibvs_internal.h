/* Declarations that the files of the library share. */
#ifndef IBVS_INTERNAL_H
#define IBVS_INTERNAL_H

#include <stddef.h>
#include <string.h>

#include "ibvs_math.h"
#include "ibvs_qp.h"

/* One row of a table of bounds: entries of a vector within [low, high]. */
typedef struct {
  size_t value, flag;   /* offsets in the structure; flag: NO_FLAG where the entry is not optional */
  uint32_t size;
  ibvs_real low, high;
  bool unit_length;     /* the length must be 1 instead */
  bool held;            /* the last accepted value stays in force where one is refused */
  uint32_t rejected;    /* bit of ibvs_command_result.rejected */
} ibvs_field;
#define IBVS_NO_FLAG ((size_t)-1)

/* Generated (ibvs_tables.c). */
extern const ibvs_field ibvs_measurement_fields[IBVS_MEASUREMENT_FIELDS];
extern const ibvs_field ibvs_reference_fields[IBVS_REFERENCE_FIELDS];
extern const ibvs_measurement ibvs_first_measurement;
extern const ibvs_reference ibvs_first_reference;
extern const ibvs_gains ibvs_default_gains, ibvs_least_gains, ibvs_largest_gains;
extern const ibvs_real ibvs_start_states[IBVS_STATES];
extern const ibvs_real ibvs_thrust_floor[IBVS_ROTORS], ibvs_thrust_ceiling[IBVS_ROTORS];
extern const ibvs_real ibvs_effectiveness[6][IBVS_ROTORS], ibvs_inverse[IBVS_ROTORS][6];
extern const ibvs_real ibvs_mass_matrix[6][6], ibvs_allocation_weights[6];
extern const ibvs_real ibvs_camera_turn[3][3]; /* from the real camera to C */

/* ibvs_tick.c, generated */
void ibvs_tick(const ibvs_real *const *arguments, ibvs_real *const *results);

/* validate.c */
void ibvs_clock_reset(ibvs_clock *c);
bool ibvs_accept_stamp(ibvs_clock *c, int64_t stamp);
bool ibvs_sample_time(const ibvs_clock *c, int64_t stamp, int64_t *time_ns);
bool ibvs_recent(const ibvs_clock *c, int64_t *stamp_ns);
bool ibvs_good_plane(const ibvs_real plane[4]);
bool ibvs_within(const void *structure, const ibvs_field *field);
bool ibvs_check_measurement(ibvs_controller *c, const ibvs_measurement *given, ibvs_measurement *own,
                            uint32_t *rejected);
bool ibvs_check_reference(ibvs_controller *c, const ibvs_reference *given);
bool ibvs_check_gains(ibvs_controller *c);

/* pack.c */
void ibvs_pack(ibvs_controller *c, const ibvs_measurement *m);

/* Features of a turned camera in C; false where they are out of view there. */
bool ibvs_turn_plane(ibvs_real plane[4]);
bool ibvs_turn_line(ibvs_real *rho, ibvs_real *theta, ibvs_real *variance, ibvs_real covariance,
                    ibvs_real theta_variance);
void ibvs_turn_point(const ibvs_real point[3], ibvs_real turned[3]);

/* ibvs_qp.c, for replays: continues from the flown thrusts of the last tick and of the one before, which the recorded
 * inputs answer; other: solution of another solver from which OSQP continues, or NULL */
typedef struct {
  uint32_t tick;
  ibvs_real x[IBVS_VARIABLES], multipliers[IBVS_ROWS];
} ibvs_other_solution;
void ibvs_follow(ibvs_controller *c, const ibvs_real *before, const ibvs_real *thrusts,
                 const ibvs_other_solution *other);

/* fallback.c; ibvs_allocate overwrites the program */
void ibvs_hold_thrusts(const ibvs_controller *c, ibvs_real thrusts[IBVS_ROTORS]);
void ibvs_analytic_thrusts(const ibvs_controller *c, ibvs_real thrusts[IBVS_ROTORS]);
void ibvs_allocate(ibvs_controller *c, const ibvs_real *free, const ibvs_real *lower, const ibvs_real *upper,
                   ibvs_real thrusts[IBVS_ROTORS]);

#endif
