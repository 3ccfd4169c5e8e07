// The whole configuration: plain data, and what it costs. Three profiles to start from; every field has a default that
// works. Sizes are known at compile time, so firmware can write
//
//   constexpr mellin::Config config = mellin::micro_profile();
//   alignas(mellin::kArenaAlignment) static std::byte memory[mellin::required_bytes(config)];
#pragma once

#include <cstdint>

#include "mellin/collection/map_collection.hpp"
#include "mellin/collection/registration.hpp"
#include "mellin/collection/screening.hpp"
#include "mellin/mapping/particle_mapper.hpp"
#include "mellin/mapping/submap_builder.hpp"
#include "mellin/store/submap_store.hpp"

namespace mellin {

struct Config {
  LaserConfig lasers[kMaxLasers];

  // Sizes that several parts share; resolved() hands them down.
  std::uint16_t side = 768;               ///< cells along the live window and along a submap; even
  float cell_m = 0.05F;                   ///< edge of a cell
  std::uint16_t remembered_scans = 40;    ///< K: scans in the live map, and in a submap (paper, Section V-A)
  std::uint16_t screening_side = 96;      ///< pixels along a digest: side over a power of two
  std::uint16_t registration_side = 192;  ///< pixels along the pictures that are registered: side over a power of two
  std::uint16_t class_side = 192;         ///< cells along the grids on which a registration is verified; divides side
  std::uint32_t max_submaps = 512;
  std::uint16_t max_sessions = 16;
  std::uint16_t grid_slots = 4;  ///< full submaps in RAM: one being rendered, one being linked, others cached
  std::uint64_t seed = 1;        ///< of all random numbers

  ParticleMapperConfig mapper;
  SubmapBuilderConfig submaps;
  ScreeningConfig screening;
  RegistrationConfig registration;
  CollectionConfig collection;
};

/// The configuration with its shared sizes handed down to the parts. create() does it by itself.
constexpr Config resolved(const Config& given) {
  Config c = given;
  std::uint16_t beams = 0;
  for (const LaserConfig& laser : c.lasers) {
    beams = laser.beams > beams ? laser.beams : beams;
  }
  c.mapper.max_beams = beams;
  c.mapper.side = c.side;
  c.mapper.cell_m = c.cell_m;
  c.mapper.remembered_scans = c.remembered_scans;
  c.submaps.max_scans = c.remembered_scans;
  c.submaps.side = c.side;
  c.submaps.cell_m = c.cell_m;
  c.submaps.smoother.max_scans = c.remembered_scans;
  c.submaps.smoother.max_beams = beams;
  c.screening.grid_side = c.side;
  c.screening.max_submaps = c.max_submaps;
  c.screening.matcher.side = c.screening_side;
  const std::uint32_t most_turns = std::uint32_t{c.screening_side} * c.screening.matcher.turns_per_bin;
  if (c.screening.matcher.kept_turns > most_turns) {
    c.screening.matcher.kept_turns = static_cast<std::uint16_t>(most_turns);
  }
  c.screening.matcher.pixel_m = c.cell_m * static_cast<float>(c.side) / static_cast<float>(c.screening_side);
  c.registration.grid_side = c.side;
  c.registration.class_side = c.class_side;
  c.registration.matcher.side = c.registration_side;
  c.registration.matcher.pixel_m = c.cell_m * static_cast<float>(c.side) / static_cast<float>(c.registration_side);
  c.collection.max_submaps = c.max_submaps;
  c.collection.max_sessions = c.max_sessions;
  c.collection.digest_bytes = static_cast<std::uint32_t>(SpectralScreening::digest_size(c.screening_side));
  return c;
}

/// ok, or invalid_config with a line to `log` that names the field, what it is and what it has to be.
Status validate(const Config& given, Log log = Log());

/// A hash of what stored submaps depend on: cell size, sides, digests. A store written under another one is refused.
constexpr std::uint64_t fingerprint(const Config& c) {
  const std::uint64_t fields[] = {c.side, static_cast<std::uint64_t>(c.cell_m * 1e6F), c.screening_side};
  std::uint64_t hash = 0xCBF29CE484222325ULL;  // FNV-1a
  for (const std::uint64_t field : fields) {
    for (int i = 0; i < 8; ++i) {
      hash = (hash ^ (field >> (8 * i) & 0xFFU)) * 0x100000001B3ULL;
    }
  }
  return hash;
}

constexpr StoreConfig store_config(const Config& c) {
  StoreConfig store;
  store.side = c.side;
  store.cell_m = c.cell_m;
  store.max_submaps = c.max_submaps;
  store.max_blobs = 2 * c.max_submaps + c.collection.graph.max_edges;
  store.grid_slots = c.grid_slots;
  store.fingerprint = fingerprint(c);
  return store;
}

/// The paper's sizes: 768 x 768 cells of 5 cm, 40 scans; but one particle, see ParticleMapperConfig.
constexpr Config desktop_profile() {
  Config c;
  c.max_submaps = 1024;
  c.grid_slots = 16;
  // A new submap meets all others: what turning it takes is done once an angle. A quarter of an angular bin is finer
  // than the angles are known, and loses no edge on the real logs.
  c.screening.matcher.turns_per_bin = 4;
  c.screening.matcher.kept_turns = 384;
  c.collection.graph.max_edges = 8192;
  c.collection.graph.max_fill = 32768;
  return c;
}

/// For a board with a few megabytes of RAM (Cortex-M7, M55): 320 x 320 cells of 10 cm.
constexpr Config micro_profile() {
  Config c;
  c.side = 320;
  c.cell_m = 0.1F;
  c.screening_side = 40;
  c.registration_side = 80;
  c.class_side = 160;
  c.max_submaps = 160;
  c.grid_slots = 2;
  c.mapper.spare_scans = 8;
  // On coarse cells a match errs about as much as the odometry's bias is worth: on the real logs learning it gained
  // nothing (tools/accuracy.sh --profile micro --set mapper.odometry.learn_bias=1).
  c.mapper.odometry.learn_bias = false;
  c.submaps.band_rows = 16;
  c.screening.cache_features = false;
  c.registration.matcher.translation_peaks = 2;  // more leave a board too little time between scans
  c.registration.alignment.max_points = 1024;
  c.registration.alignment.keep_both = false;
  c.collection.graph.max_edges = 512;
  c.collection.graph.max_fill = 2048;
  c.collection.linker.pending = 32;
  return c;
}

/// For a board with a few hundred kilobytes (Cortex-M4F, M33): 160 x 160 cells of 16 cm. Digests stay in flash.
constexpr Config nano_profile() {
  Config c = micro_profile();
  c.side = 160;
  c.cell_m = 0.16F;
  c.registration_side = 40;
  c.class_side = 80;
  c.max_submaps = 150;
  c.max_sessions = 4;
  c.mapper.spare_scans = 4;
  c.mapper.count_once_a_scan = true;
  c.mapper.monitor.conflict_share = 0.5F;  // in coarse cells a third of the beams contradicts where the robot is right
  c.submaps.band_rows = 4;
  c.submaps.smoother.iterations = 0;  // no room for it
  c.screening.hold_digests = false;
  // Dropping rotations that do not stand out would spare a third of screening here, most of which is making spectra
  // anew; on the three real logs it moves the errors either way (tools/accuracy.sh --profile nano --set
  // screening.min_rotation_peak=0.35).
  c.screening.min_rotation_peak = 0.0F;
  c.registration.alignment.max_points = 512;
  c.registration.alignment.final_m = 0.2F;  // over the width of a cell, below which points do not lie still
  c.collection.graph.max_edges = 360;
  c.collection.graph.max_fill = 760;
  c.collection.linker.min_gain_bits = 1.5F;
  c.collection.linker.pending = 16;
  return c;
}

}  // namespace mellin
