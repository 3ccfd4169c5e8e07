#include "simulated_robot.h"

#define PI 3.14159265358979323846
#define MAX_RANGE_M 20.0

/* Turns by a fixed angle: per beam, per step, and per step as the odometry has it. */
typedef struct turn {
  double cos;
  double sin;
  double angle_rad;
} turn;
static const turn beam_turn = {0.9993908270190958, 0.03489949670250097, 2.0 * PI / 180.0};
static const turn step_turn = {0.996917333733128, 0.07845909572784494, 4.5 * PI / 180.0};
static const turn odometry_turn = {0.9966659280340299, 0.08159061156815754, 4.68 * PI / 180.0};
static const double step_m = 0.2;
static const double odometry_step_m = 0.204;

/* The room, and what stands in it; the path runs through (6, 1.5) and (6, 6.6) and touches nothing. */
typedef struct box {
  double x_min;
  double x_max;
  double y_min;
  double y_max;
} box;
static const box room = {0.0, 12.0, 0.0, 8.0};
static const box furniture[] = {
    {0.0, 1.2, 0.0, 2.5}, {10.5, 12.0, 6.5, 8.0}, {5.6, 6.4, 3.9, 4.5}, {9.6, 11.0, 1.0, 2.0}, {2.0, 2.6, 6.6, 8.0},
};

/* The stretch of a ray, in metres, in which one of its coordinates lies between two bounds. */
static void clip(double from, double direction, double low, double high, double* enter_m, double* leave_m) {
  double first_m;
  double last_m;
  if (direction == 0.0) {
    if (from < low || from > high) {
      *enter_m = MAX_RANGE_M;
      *leave_m = 0.0;
    }
    return;
  }
  first_m = ((direction > 0.0 ? low : high) - from) / direction;
  last_m = ((direction > 0.0 ? high : low) - from) / direction;
  *enter_m = first_m > *enter_m ? first_m : *enter_m;
  *leave_m = last_m < *leave_m ? last_m : *leave_m;
}

static void cross(const box* b, double x, double y, double dx, double dy, double* enter_m, double* leave_m) {
  *enter_m = 0.0;
  *leave_m = MAX_RANGE_M;
  clip(x, dx, b->x_min, b->x_max, enter_m, leave_m);
  clip(y, dy, b->y_min, b->y_max, enter_m, leave_m);
}

/* How far it is to the next wall. */
static double range(double x, double y, double dx, double dy) {
  double enter_m;
  double nearest_m;
  size_t i;
  cross(&room, x, y, dx, dy, &enter_m, &nearest_m);
  for (i = 0; i < sizeof furniture / sizeof *furniture; ++i) {
    double leave_m;
    cross(&furniture[i], x, y, dx, dy, &enter_m, &leave_m);
    if (enter_m < leave_m && enter_m < nearest_m) {
      nearest_m = enter_m;
    }
  }
  return nearest_m;
}

static void step(simulated_place* place, double distance_m, const turn* by) {
  const double c = place->cos;
  place->x += distance_m * c;
  place->y += distance_m * place->sin;
  place->cos = c * by->cos - place->sin * by->sin;
  place->sin = c * by->sin + place->sin * by->cos;
  place->theta += by->angle_rad;
}

static const simulated_place origin = {0.0, 0.0, 1.0, 0.0, 0.0};
static const simulated_place start = {6.0, 1.5, 1.0, 0.0, 0.0};

mellin_laser simulated_laser(void) {
  mellin_laser laser = {SIMULATED_BEAMS, (float)-PI, (float)(2.0 * PI / 180.0), 0.05F, (float)MAX_RANGE_M, {0, 0, 0}};
  return laser;
}

void simulated_start(simulated_robot* robot) {
  robot->world = start;
  robot->odometry = origin;
  robot->stamp_us = 0;
}

void simulated_drive(simulated_robot* robot) {
  step(&robot->world, step_m, &step_turn);
  step(&robot->odometry, odometry_step_m, &odometry_turn);
  robot->stamp_us += SIMULATED_PERIOD_US;
}

mellin_scan simulated_scan(simulated_robot* robot) {
  const simulated_place* at = &robot->world;
  mellin_scan scan = {0};
  double dx = -at->cos; /* the first beam looks back */
  double dy = -at->sin;
  size_t i;
  for (i = 0; i < SIMULATED_BEAMS; ++i) {
    const double turned = dx * beam_turn.cos - dy * beam_turn.sin;
    robot->ranges_m[i] = (float)range(at->x, at->y, dx, dy);
    dy = dx * beam_turn.sin + dy * beam_turn.cos;
    dx = turned;
  }
  scan.stamp_us = robot->stamp_us;
  scan.ranges_m = robot->ranges_m;
  scan.range_count = SIMULATED_BEAMS;
  scan.odom_T_base.x = robot->odometry.x;
  scan.odom_T_base.y = robot->odometry.y;
  scan.odom_T_base.theta = robot->odometry.theta;
  return scan;
}

/* By Newton's method: a root without libm. */
static double root(double square) {
  double estimate = square > 1.0 ? square : 1.0;
  int i;
  for (i = 0; i < 60; ++i) {
    estimate = 0.5 * (estimate + square / estimate);
  }
  return estimate;
}

double simulated_error_m(const simulated_robot* robot, const mellin_pose2* start_T_base) {
  const double dx = start_T_base->x - (robot->world.x - start.x);
  const double dy = start_T_base->y - (robot->world.y - start.y);
  return root(dx * dx + dy * dy);
}
