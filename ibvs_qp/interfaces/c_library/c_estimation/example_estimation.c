/* Estimation and controller on any system with a C compiler: a vehicle hovers 0.3 m before a wall with a level edge.
 *
 * read_sensors and read_features are the vehicle's; in a real loop a timer starts every tick, as in example_posix.c. */
#include <stdio.h>

#include "ibvs_estimation.h"

#define TICK_NS 4000000
#define TICKS 500           /* 2 s */
#define TICKS_PER_PICTURE 8 /* 31 pictures per second */
#define LATENCY_NS 40000000 /* from the capture of a picture to its features */
#define INVERSE_DEPTH 1.25  /* of the wall in the camera [1/m]: 0.8 m, the tip is 0.5 m ahead of the camera */
#define EDGE_RHO (-0.0625)  /* of the edge in the picture: 50 mm above the camera, 30 mm below the tip */

static ibvs_frame read_sensors(int64_t now_ns) {
  return (ibvs_frame){.stamp_ns = now_ns, .attitude = {1, 0, 0, 0}, .specific_force = {0, 0, -IBVS_GRAVITY},
                      .wrench_stamp_ns = now_ns};
}

/* Features of a picture that has come since the last tick, or NULL. */
static const ibvs_features *read_features(int64_t now_ns, ibvs_features *features) {
  if (now_ns % (TICKS_PER_PICTURE * TICK_NS) != 0 || now_ns < LATENCY_NS) {
    return NULL;
  }
  *features = (ibvs_features){.stamp_ns = now_ns - LATENCY_NS, .has_plane = true, .line_count = 1};
  features->plane[2] = (ibvs_real)INVERSE_DEPTH;
  features->plane[3] = -1;
  features->lines[0] = (ibvs_line_feature){.track_id = 1, .role = IBVS_HORIZONTAL, .rho = (ibvs_real)EDGE_RHO,
                                           .theta = IBVS_QUARTER_TURN, .variance = (ibvs_real)1e-6, .weight = 1};
  return features;
}

int main(void) {
  static ibvs_flight flight;
  static ibvs_features features;
  static ibvs_estimates estimates;
  ibvs_command_result command;
  uint32_t rejected = 0;
  ibvs_flight_init(&flight);
  for (int tick = 0; tick < TICKS; ++tick) {
    ibvs_reference reference = {.standoff = (ibvs_real)0.3};
    int64_t followed = 0, now_ns = (int64_t)tick * TICK_NS;
    const ibvs_frame frame = read_sensors(now_ns);
    ibvs_estimate(&flight, &frame, read_features(now_ns, &features), &estimates);
    if (estimates.line_count > 0) { /* the strategy: keep the edge 30 mm below the tip */
      reference.lines[0] = ibvs_line_target(&estimates, &estimates.lines[0], (ibvs_real)0.03);
      reference.line_count = 1;
      followed = estimates.lines[0].track_id;
    }
    ibvs_command(&flight, &reference, &followed, reference.line_count, &command); /* command.thrusts: to the motors */
    rejected |= command.rejected;
  }
  printf("wall %.1f mm before the tip, edge %.1f mm below it, rejected 0x%x, thrusts", 1e3 * (double)estimates.distance,
         1e3 * (double)estimates.lines[0].offset, (unsigned)rejected);
  for (int i = 0; i < IBVS_ROTORS; ++i) {
    printf(" %.2f", (double)command.thrusts[i]);
  }
  printf(" N\n");
  return 0;
}
