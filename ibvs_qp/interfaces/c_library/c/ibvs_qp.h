/* Hybrid motion/force controller of a fully-actuated UAV: one quadratic program per tick, solved by OSQP.
 *
 * Frames: body B is forward-right-down at the centre of mass; camera C is right-down-forward. A quaternion
 * (w, x, y, z) turns vectors of B into the inertial frame I (north-east-down; its yaw is arbitrary). SI units.
 * With a turned camera (IBVS_TURNED_CAMERA) measured lines and planes are in its own axes, references in C.
 * Stamps are nanoseconds of one monotonic clock.
 *
 * One ibvs_controller is one instance. There is no global state, no allocation and no blocking call; the largest
 * number of iterations (IBVS_MAX_ITERATIONS) bounds the time of a step. ibvs_step never fails: a refused input is
 * reported in ibvs_command_result.rejected, and the thrusts stay finite, within their limits and within the rate limit.
 */
#ifndef IBVS_QP_H
#define IBVS_QP_H

#include <stdbool.h>
#include <stdint.h>

#include "ibvs_layout.h"
#include "ibvs_program.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Roles of a line. */
typedef enum { IBVS_HORIZONTAL = 0, IBVS_VERTICAL = 1 } ibvs_role;

/* One line of the picture, x cos(theta) + y sin(theta) = rho in normalised coordinates. */
typedef struct {
  ibvs_real rho;      /* signed distance from the image centre [-] */
  ibvs_real theta;    /* angle of the normal [rad] */
  ibvs_real weight;   /* 0 (fading out) to 1 (trusted) */
  ibvs_real variance; /* of rho */
  int64_t stamp_ns;   /* time at which the line was as described, 0 if unknown */
  ibvs_role role;
  ibvs_real covariance, theta_variance; /* of rho and theta, of theta; used with a turned camera only */
} ibvs_line;

/* Sensors of one tick; an optional entry counts where its flag is true. */
typedef struct {
  int64_t stamp_ns;                 /* time of the tick */
  ibvs_real attitude[4];            /* unit quaternion */
  ibvs_real angular_velocity[3];    /* gyro in B [rad/s] */
  bool has_specific_force;
  ibvs_real specific_force[3];      /* accelerometer in B [m/s^2] */
  ibvs_real contact_wrench[6];      /* tared wrench ON the vehicle at the centre of mass, in B [N, N m] */
  int64_t wrench_stamp_ns;          /* time at which it was measured */
  bool has_velocity;
  ibvs_real velocity[3];            /* of the centre of mass in B [m/s] */
  bool has_velocity_stamp;
  int64_t velocity_stamp_ns;        /* time for which the velocity holds; without: at the tick */
  bool has_acceleration_bias;
  ibvs_real acceleration_bias[3];   /* measured minus true acceleration, in B [m/s^2] */
  bool has_plane;
  ibvs_real plane[4];               /* wall (A, B, C, D) in C, D != 0 */
  int64_t plane_stamp_ns;           /* time at which it was measured */
  bool has_thrust_min, has_thrust_max;
  ibvs_real thrust_min[IBVS_ROTORS], thrust_max[IBVS_ROTORS]; /* limits in force [N]; without: those compiled in */
  uint32_t line_count;
  ibvs_line lines[IBVS_MOST_LINES];
} ibvs_measurement;

/* Target of a line. */
typedef struct {
  ibvs_real rho, theta;
  ibvs_role role;
} ibvs_line_reference;

/* Targets of one tick. */
typedef struct {
  ibvs_real push_force;   /* push on the wall [N], >= 0 */
  ibvs_real standoff;     /* tip to wall while not in contact [m] */
  ibvs_real velocity[2];  /* in the wall plane, right and down [m/s] */
  ibvs_real travel[2];    /* velocity planned at this push [m/s] */
  ibvs_real tilt[2];      /* roll and pitch [rad]: level, except for a vehicle that lost a rotor */
  ibvs_real trim[2];      /* roll and pitch of a level hover with a limited rotor [rad] */
  bool contact;           /* press the wall, or keep the stand-off */
  uint32_t line_count;
  ibvs_line_reference lines[IBVS_LINES]; /* pair with measured lines by role, then order */
} ibvs_reference;

typedef enum { IBVS_MODE_FREE = 0, IBVS_MODE_APPROACH = 1, IBVS_MODE_CONTACT = 2, IBVS_MODE_HOLD = 3 } ibvs_mode;

/* Bits of ibvs_command_result.rejected. */
enum {
  IBVS_REJECT_STAMP = 1 << 0,
  IBVS_REJECT_ATTITUDE = 1 << 1,
  IBVS_REJECT_ANGULAR_VELOCITY = 1 << 2,
  IBVS_REJECT_SPECIFIC_FORCE = 1 << 3,
  IBVS_REJECT_CONTACT_WRENCH = 1 << 4,
  IBVS_REJECT_VELOCITY = 1 << 5,
  IBVS_REJECT_ACCELERATION_BIAS = 1 << 6,
  IBVS_REJECT_THRUST_MIN = 1 << 7,
  IBVS_REJECT_THRUST_MAX = 1 << 8,
  IBVS_REJECT_WRENCH_STAMP = 1 << 9,
  IBVS_REJECT_PLANE = 1 << 10,
  IBVS_REJECT_LINES = 1 << 11,
  IBVS_REJECT_VELOCITY_STAMP = 1 << 12,
  IBVS_REJECT_THRUST_ORDER = 1 << 13,  /* a maximum below its minimum: the last limits stay in force */
  IBVS_REJECT_REFERENCE = 1 << 14,     /* the last accepted one stays in force */
  IBVS_REJECT_GAINS = 1 << 15,         /* the last accepted ones stay in force */
  IBVS_REJECT_PROGRAM = 1 << 16,       /* OSQP's answer failed the acceptance test */
  IBVS_REJECT_RECOVERING = 1 << 17,    /* solved again, not yet for long */
  IBVS_REJECT_FEATURES = 1 << 18       /* of ibvs_estimate: features too old, ahead, not after the last ones, or with a
                                          refused frame */
};

/* Thrusts of one tick and how they came about. */
typedef struct {
  int64_t stamp_ns;
  ibvs_real thrusts[IBVS_ROTORS];       /* [N] */
  ibvs_real wrench[6];                  /* of the thrusts, in B [N, N m] */
  ibvs_real unallocated_wrench[6];      /* of the thrusts without limits, minus `wrench` [N, N m] */
  ibvs_real multipliers[IBVS_ROWS];     /* of the limits; 0 where one is not active or the program was not solved */
  ibvs_outcome outcome;
  ibvs_mode mode;
  uint32_t rejected;                    /* IBVS_REJECT_... */
  int32_t iterations;                   /* of OSQP */
  bool wall_known;
  ibvs_real distance;                   /* estimated, tip to wall [m], while a wall is known */
  ibvs_real push;                       /* filtered, on the wall [N] */
  ibvs_real reach;                      /* largest push that the limits in force allow [N] */
} ibvs_command_result;

/* Stamps to a time that only increases. */
typedef struct {
  int64_t shift_ns, last_ns, odd_first, odd_last;
  int32_t odd_count, jumps;
} ibvs_clock;

/* One instance; all members are private but `gains`. */
typedef struct {
  ibvs_gains gains;          /* may be changed between steps; checked at every step */
  ibvs_gains gains_in_force;
  ibvs_clock clock;
  /* inputs in force */
  bool measured;
  ibvs_measurement last;
  ibvs_reference reference;
  /* pairs of lines and references */
  int32_t pairs[IBVS_LINES]; /* reference of every index: role and order; -1 for none */
  /* tick */
  int64_t tick_ns;
  ibvs_real inputs[IBVS_INPUTS], states[IBVS_STATES], next_states[IBVS_STATES], finite[1], results[IBVS_RESULTS];
  ibvs_real free[IBVS_ROTORS]; /* thrusts without limits */
  ibvs_real line_rows[6 * (IBVS_LINES + 1)], line_targets[IBVS_LINES + 1], secondary[6];
  /* solution and command */
  ibvs_program program;
  bool commanded;
  int32_t recovery;
  ibvs_real thrusts[IBVS_ROTORS], change[IBVS_ROTORS], unallocated;
} ibvs_controller;

/* Size of an instance [bytes], for callers that do not compile against this header. */
uint32_t ibvs_size(void);

/* As before the first tick, with the gains compiled in. */
void ibvs_init(ibvs_controller *controller);

/* As after ibvs_init, with the gains in force. */
void ibvs_reset(ibvs_controller *controller);

/* Thrusts of one tick. The inputs are copied; no pointer is kept. */
void ibvs_step(ibvs_controller *controller, const ibvs_measurement *measurement, const ibvs_reference *reference,
               ibvs_command_result *command);

/* The same from packed inputs (ibvs_layout.h) that a caller has validated; thrusts of earlier ticks included. */
void ibvs_step_packed(ibvs_controller *controller, ibvs_command_result *command);

#ifdef __cplusplus
}
#endif
#endif
