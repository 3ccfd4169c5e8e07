/* A mapping run through the C interface, written in C99, for the suites c_interface and c_config. */
#ifndef MELLIN_TESTS_C_DRIVE_H
#define MELLIN_TESTS_C_DRIVE_H

#include "mellin/mellin.h"

#ifdef __cplusplus
extern "C" {
#endif

/* What each scan led to. */
typedef struct c_drive_step {
  mellin_status added;
  mellin_scan_outcome outcome;
  mellin_pose2 pose;
  mellin_sym3 covariance;
  mellin_pose2 map_pose;
  uint32_t component;
} c_drive_step;

/* The configuration of the run: the nano profile with each kind of field changed. */
mellin_status c_drive_config(mellin_config* config, uint16_t beams);

/* Maps the scans in one session, with `slices` slices of work after each (0: until there is no more), and flushes.
 * Returns MELLIN_OK, or the first status that was not. */
mellin_status c_drive(mellin_slam* slam, const mellin_scan* scans, size_t count, uint32_t slices, c_drive_step* steps);

/* sizeof of each type of mellin.h as the C compiler has it, in the order of the header, and the place of the last field
 * of mellin_config; returns how many. */
enum { C_DRIVE_TYPES = 25 };
size_t c_drive_sizes(size_t sizes[C_DRIVE_TYPES]);

#ifdef __cplusplus
}
#endif

#endif
