/* Declarations that the files of the estimation share. */
#ifndef IBVS_ESTIMATION_INTERNAL_H
#define IBVS_ESTIMATION_INTERNAL_H

#include "ibvs_estimation.h"
#include "ibvs_internal.h"

#define SECONDS(ns) (R(1e-9) * (ibvs_real)(ns))

typedef void ibvs_function(const ibvs_real *const *arguments, ibvs_real *const *results);

/* Generated (ibvs_predict.c, ibvs_correct.c, ibvs_estimation_tables.c). */
ibvs_function ibvs_predict, ibvs_correct;
extern const ibvs_field ibvs_frame_fields[IBVS_FRAME_FIELDS];
extern const ibvs_real ibvs_predict_start[IBVS_PREDICT_STATES], ibvs_correct_start[IBVS_CORRECT_STATES];
extern const ibvs_real ibvs_force_axes[3][3], ibvs_tip_from_camera[3];
extern const uint16_t ibvs_given_places[IBVS_GIVEN_ENTRIES][2]; /* of the tick's inputs and of the prediction */

/* wall_motion.c */
const ibvs_real *ibvs_motion(const ibvs_flight *f);
void ibvs_motion_reset(ibvs_flight *f);
void ibvs_motion_doubt(ibvs_flight *f);
void ibvs_remember(ibvs_flight *f, int64_t stamp_ns, ibvs_real dt);
void ibvs_attitude_at(const ibvs_flight *f, int64_t stamp_ns, ibvs_real attitude[4]);
void ibvs_evaluate(ibvs_flight *f, ibvs_function *function, const ibvs_real *inputs, ibvs_real *states, uint32_t count,
                   ibvs_real *results);
void ibvs_correct_velocity(ibvs_flight *f, const ibvs_features *features, int64_t stamp_ns, int64_t velocity_ns,
                           const ibvs_real wall[7]);
void ibvs_correct_line(ibvs_flight *f, const ibvs_line_feature *line, int64_t track_id, int64_t stamp_ns,
                       const ibvs_real wall[7]);
void ibvs_end_correction(ibvs_flight *f, int64_t stamp_ns);

#endif
