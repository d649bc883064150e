/* Estimation and controller of one flight: sensors and features of pictures in, estimates and thrusts out.
 *
 * Every tick: ibvs_estimate, then the caller's reference by these estimates, then ibvs_command. Frames, units and
 * stamps as in ibvs_qp.h; wall axes are right (level) and down, seen into the wall. The inertial sensors must work: a
 * frame without sound ones has no estimates, and ibvs_command holds (IBVS_HOLD).
 */
#ifndef IBVS_ESTIMATION_H
#define IBVS_ESTIMATION_H

#include "ibvs_estimation_layout.h"
#include "ibvs_qp.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Raw sensors of one tick. */
typedef struct {
  int64_t stamp_ns;               /* time of the tick */
  ibvs_real attitude[4];          /* unit quaternion */
  ibvs_real angular_velocity[3];  /* gyro in B [rad/s] */
  ibvs_real specific_force[3];    /* accelerometer in B at the centre of mass [m/s^2] */
  ibvs_real wrench[6];            /* raw sample in the sensor's axes, vehicle on tool: a push reads +x [N, N m] */
  int64_t wrench_stamp_ns;        /* time at which it was taken; a sample counts once */
  bool has_thrust_min, has_thrust_max;
  ibvs_real thrust_min[IBVS_ROTORS], thrust_max[IBVS_ROTORS]; /* as in ibvs_measurement */
} ibvs_frame;

typedef enum { IBVS_UNKNOWN_EDGE = 0, IBVS_BOARD_EDGE = 1, IBVS_PAINT_EDGE = 2 } ibvs_edge;

/* One line of a picture, x cos(theta) + y sin(theta) = rho in normalised coordinates. */
typedef struct {
  int64_t track_id;     /* identity from picture to picture, positive; 0: role and order in the picture identify the
                           line; a line with a negative one is refused */
  ibvs_role role;
  ibvs_edge kind;
  int32_t surface_side; /* side of the working surface along the normal: 1, -1, 0 unknown */
  ibvs_real rho, theta; /* [-], [rad] */
  ibvs_real variance;   /* of rho */
  ibvs_real weight;     /* 0 to 1 */
  bool has_segment;
  ibvs_real segment[4]; /* visible end points x1, y1, x2, y2 */
  ibvs_real covariance, theta_variance; /* of rho and theta, of theta; used with a turned camera only */
} ibvs_line_feature;

/* Features of one picture at its capture; a plane alone is one without lines. */
typedef struct {
  int64_t stamp_ns;
  bool has_plane;
  ibvs_real plane[4];               /* wall (A, B, C, D) in C, D != 0 */
  ibvs_real curvature[3];           /* of the wall: right right, right down, down down [1/m], > 0 where it bulges */
  bool has_velocity;
  ibvs_real velocity[3];            /* of the centre of mass in B [m/s] */
  ibvs_real velocity_covariance[9]; /* large in directions that were not observed */
  int64_t velocity_stamp_ns;        /* time for which it holds; 0: at capture */
  uint32_t line_count;
  ibvs_line_feature lines[IBVS_MOST_LINES];
} ibvs_features;

/* A line on the wall, from picture to picture. */
typedef struct {
  int64_t track_id;         /* of the feature; negative where that has none */
  ibvs_role role;
  ibvs_edge kind;
  int32_t surface_side;
  uint32_t slot;            /* its place in the filter's state */
  uint32_t pictures;        /* number of pictures that showed it */
  int64_t seen_ns;          /* capture of the last one; fresh_ns: tick at which it came */
  int64_t fresh_ns;
  ibvs_real offset;         /* from the tip along the normal, which points down or right [m] */
  ibvs_real deviation;      /* of the filtered offset [m] */
  ibvs_real residual;       /* of the last measured offset [m] */
  ibvs_real angle;          /* of the normal in (right, down) [rad] */
  ibvs_real angle_variance; /* [rad^2] */
  ibvs_real weight;         /* now; fresh_weight: at the last picture */
  ibvs_real fresh_weight;
  ibvs_real seen_angle;     /* of the visible piece [rad]; middle and length [m]: NAN and 0 without end points */
  ibvs_real middle, length;
} ibvs_tracked_line;

/* Estimates of one tick. */
typedef struct {
  int64_t stamp_ns;          /* of the frame */
  uint32_t rejected;         /* IBVS_REJECT_... of frame and features */
  bool valid;                /* false: the frame was refused, the other entries are of the tick before */
  bool wall_known, in_contact, stiffness_known;
  bool tared;                /* the force sensor's bias has been averaged long enough */
  bool velocity_known;       /* measured within the last velocity_life_s */
  ibvs_real normal[3];       /* unit vector into the wall in B */
  ibvs_real distance;        /* tip to wall [m], while a wall is known */
  ibvs_real distance_rate;   /* [m/s], negative towards the wall */
  ibvs_real push;            /* filtered, on the wall [N]; push_noise: its deviation in free flight */
  ibvs_real push_noise;
  ibvs_real push_reference;  /* of the law in the tick before, within reach [N] */
  ibvs_real time_in_contact; /* [s], 0 while free */
  ibvs_real stiffness;       /* of brush and wall [N/m]; the assumed one until it is known */
  ibvs_real velocity[2];     /* in the wall plane, right and down [m/s] */
  ibvs_real odometer[2];     /* way of the tip [m] */
  ibvs_real attitude[4];     /* without steps that the gyro did not measure */
  ibvs_real angular_velocity[3]; /* without the gyro's bias [rad/s] */
  ibvs_real wrench[6];       /* tared contact wrench ON the vehicle at the centre of mass, in B [N, N m] */
  uint32_t line_count;
  ibvs_tracked_line lines[IBVS_TRACKS]; /* in the order in which they were found */
} ibvs_estimates;

/* Ticks of the last half second. */
typedef struct {
  ibvs_real rows[IBVS_HISTORY][IBVS_MOTION_STATES + 4]; /* motion and attitude */
  int64_t stamps[IBVS_HISTORY];
  ibvs_real lengths[IBVS_HISTORY]; /* [s] */
  uint32_t first, count;
} ibvs_tick_history;

/* One instance; all members are private but `controller.gains`. */
typedef struct {
  ibvs_controller controller;
  ibvs_clock clock;
  int32_t jumps;
  ibvs_frame frame;     /* last accepted, in the time of the clock */
  ibvs_estimates now;
  ibvs_real plane[4];
  int64_t plane_ns, accepted_plane_ns, picture_ns, wrench_ns, tick_ns;
  bool doubt;           /* ticks are missing for an unknown time */
  /* motion in the wall plane */
  ibvs_tick_history history;
  ibvs_real variance[IBVS_MOTION_STATES], density, velocity_age_s;
  int64_t lines_ns, refused_ns, velocity_ns, corrected_ns, gap_end_ns;
  bool motion_doubt;
  /* functions */
  ibvs_real predict_inputs[IBVS_PREDICT_INPUTS], predict_states[IBVS_PREDICT_STATES], predicted[IBVS_PREDICTED];
  ibvs_real correct_inputs[IBVS_CORRECT_INPUTS], correct_states[IBVS_CORRECT_STATES], corrected[IBVS_CORRECTED];
  ibvs_real next_states[IBVS_MOST_STATES];
} ibvs_flight;

/* Size of an instance [bytes]. */
uint32_t ibvs_flight_size(void);

/* As before the first tick, with the gains compiled in. */
void ibvs_flight_init(ibvs_flight *flight);

/* As after ibvs_flight_init, with the gains in force. */
void ibvs_flight_reset(ibvs_flight *flight);

/* Estimates of a tick. features: of a picture that came with it, or NULL. Features with a refused frame are not used,
 * IBVS_REJECT_FEATURES; they are accepted with a later frame. */
void ibvs_estimate(ibvs_flight *flight, const ibvs_frame *frame, const ibvs_features *features,
                   ibvs_estimates *estimates);

/* Thrusts of the tick. followed: track_id of every line of the reference, count is the reference's line_count. A line
 * that is not tracked, or has another role, has no weight in this tick: IBVS_REJECT_LINES. */
void ibvs_command(ibvs_flight *flight, const ibvs_reference *reference, const int64_t *followed, uint32_t count,
                  ibvs_command_result *command);

/* Reference of a tracked line at an offset from the tip [m]. */
ibvs_line_reference ibvs_line_target(const ibvs_estimates *estimates, const ibvs_tracked_line *line, ibvs_real offset);

#ifdef __cplusplus
}
#endif
#endif
