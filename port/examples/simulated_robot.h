/* The sensor of the examples: a robot that drives round and round in a room, its odometry and its laser, exact but for
 * the odometry's bias. Directions are turned by fixed angles, so that there is no sine or cosine to call and the bits
 * are the same everywhere. */
#ifndef MELLIN_SIMULATED_ROBOT_H
#define MELLIN_SIMULATED_ROBOT_H

#include "mellin/mellin.h"

#ifdef __cplusplus
extern "C" {
#endif

enum {
  SIMULATED_BEAMS = 180,           /* once round, two degrees apart */
  SIMULATED_STEPS_PER_ROUND = 80,  /* 20 cm and 4.5 degrees each: a round is 16 m */
  SIMULATED_PERIOD_US = 100 * 1000 /* between two scans */
};

/* A position, and the direction of travel as a unit vector and as an angle. */
typedef struct simulated_place {
  double x;
  double y;
  double cos;
  double sin;
  double theta;
} simulated_place;

typedef struct simulated_robot {
  simulated_place world;    /* where it is, in the room */
  simulated_place odometry; /* where it believes to be, from its start on: 2 % too far, turned 4 % too much */
  int64_t stamp_us;
  float ranges_m[SIMULATED_BEAMS];
} simulated_robot;

/* The laser as a configuration has it. */
mellin_laser simulated_laser(void);

/* Puts the robot at its start. Its first scan is made there. */
void simulated_start(simulated_robot* robot);

/* Drives one step; the next scan is made there. */
void simulated_drive(simulated_robot* robot);

/* Makes the scan. Its ranges lie in the robot and are valid until the next one is made. */
mellin_scan simulated_scan(simulated_robot* robot);

/* How far a pose in the frame of the robot's start is from the truth, m. */
double simulated_error_m(const simulated_robot* robot, const mellin_pose2* start_T_base);

#ifdef __cplusplus
}
#endif

#endif
