#include "tests/support/c_drive.h"

mellin_status c_drive_config(mellin_config* config, uint16_t beams) {
  const mellin_status status = mellin_config_init(config, MELLIN_PROFILE_NANO);
  if (status != MELLIN_OK) {
    return status;
  }
  config->lasers[0].beams = beams;
  config->lasers[0].angle_increment_rad = 3.14159265F / (float)beams;
  config->lasers[0].max_range_m = 20.0F;
  config->lasers[0].base_T_laser.x = 0.1;
  config->cell_m = 0.1F;
  config->particles = 3;
  config->seed = 7;
  config->submap_every_scans = 4;
  config->take_distance_m = 0.3F;
  config->noise.angle_per_rad = 0.1F;
  return MELLIN_OK;
}

static mellin_status drain(mellin_slam* slam, uint32_t slices) {
  mellin_status status = mellin_work(slam, slices == 0 ? 64 : slices);
  while (slices == 0 && status == MELLIN_BUSY) {
    status = mellin_work(slam, 64);
  }
  return status == MELLIN_BUSY ? MELLIN_OK : status;
}

mellin_status c_drive(mellin_slam* slam, const mellin_scan* scans, size_t count, uint32_t slices, c_drive_step* steps) {
  mellin_status status = MELLIN_OK;
  size_t i;
  for (i = 0; i < count && status == MELLIN_OK; ++i) {
    c_drive_step* step = &steps[i];
    step->added = mellin_add(slam, &scans[i], &step->outcome);
    status = drain(slam, slices);
    if (status == MELLIN_OK) {
      status = mellin_pose(slam, &step->pose, &step->covariance);
    }
    if (status == MELLIN_OK) {
      status = mellin_map_pose(slam, &step->map_pose, &step->component);
    }
  }
  if (status == MELLIN_OK) {
    status = mellin_begin_flush(slam);
  }
  return status == MELLIN_OK ? drain(slam, 0) : status;
}

size_t c_drive_sizes(size_t sizes[C_DRIVE_TYPES]) {
  const size_t all[C_DRIVE_TYPES] = {
      sizeof(mellin_status),
      sizeof(mellin_pose2),
      sizeof(mellin_sym3),
      sizeof(mellin_profile),
      sizeof(mellin_laser),
      sizeof(mellin_motion_noise),
      sizeof(mellin_odometry_learning),
      sizeof(mellin_config),
      sizeof(mellin_part),
      sizeof(mellin_memory_use),
      sizeof(mellin_scan),
      sizeof(mellin_scan_use),
      sizeof(mellin_scan_outcome),
      sizeof(mellin_window),
      sizeof(mellin_cell_format),
      sizeof(mellin_submap),
      sizeof(mellin_edge_kind),
      sizeof(mellin_edge),
      sizeof(mellin_mapper_statistics),
      sizeof(mellin_slam_statistics),
      sizeof(mellin_collection_statistics),
      sizeof(mellin_statistics),
      sizeof(mellin_store_statistics),
      sizeof(mellin_port),
      offsetof(mellin_config, close_loops),
  };
  size_t i;
  for (i = 0; i < C_DRIVE_TYPES; ++i) {
    sizes[i] = all[i];
  }
  return C_DRIVE_TYPES;
}
