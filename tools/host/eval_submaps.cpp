#include "host/eval_submaps.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <set>
#include <stdexcept>

#include "host/map_picture.hpp"
#include "host/mapping_run.hpp"
#include "host/pairing.hpp"
#include "host/parallel.hpp"
#include "mellin/core/random.hpp"
#include "ramflash/heap_flash.hpp"

namespace mellin::host {
namespace {

/// Lever by which the heading of a scan counts in the fit of a submap's pose, m: about as far as its walls are.
constexpr double kHeadingLever_m = 3.0;
/// Lattices of more cells are refused: the truth is none then.
constexpr double kMostCells = 1e8;

Config live_config(const Log& log, const LiveOptions& options, std::vector<std::uint8_t>& lasers) {
  Config config = desktop_profile();
  config.mapper.particles = options.particles;
  config.seed = options.seed;
  config.collection.close_loops = false;
  lasers = add_lasers(config, log);
  return config;
}

Pose2 blend(const Pose2& p, const Pose2& q, double share_of_q) {
  return {p.x + share_of_q * (q.x - p.x), p.y + share_of_q * (q.y - p.y),
          wrap_angle(p.theta + share_of_q * wrap_angle(q.theta - p.theta))};
}

bool is_identity(const Pose2& pose) { return pose.x == 0.0 && pose.y == 0.0 && pose.theta == 0.0; }

/// Two points a scan, ahead of the robot and behind it, so that headings count in the fit as well as places.
void add_for_fit(const Pose2& live, const Pose2& truth, PosePairs& pairs) {
  for (const double lever : {-kHeadingLever_m, kHeadingLever_m}) {
    pairs.estimate.push_back(compose(live, {lever, 0.0, 0.0}));
    pairs.truth.push_back(compose(truth, {lever, 0.0, 0.0}));
  }
}

/// The lattice of the truth frame.
struct Lattice {
  double cell_m = 0.0;
  std::int64_t first_column = 0;
  std::int64_t first_row = 0;
  std::size_t width = 0;
  std::size_t height = 0;
};

PosedScan posed(const LiveScan& live, const Pose2& frame_T_base) {
  PosedScan scan = live.scan;
  scan.world_T_laser = compose(frame_T_base, live.base_T_laser);
  return scan;
}

Lattice lattice_of(const std::vector<LiveDrive>& drives, double cell_m) {
  MapBounds box;
  for (const LiveDrive& drive : drives) {
    for (const LiveScan& live : drive.scans) {
      const PosedScan scan = posed(live, live.truth_T_base);
      box.include(scan.world_T_laser.x, scan.world_T_laser.y);
      for (std::size_t beam = 0; beam < scan.ranges_m.size(); ++beam) {
        if (hit_something(scan, beam)) {
          const PointM end = end_point(scan, beam, scan.world_T_laser);
          box.include(end.x, end.y);
        }
      }
    }
  }
  const double columns = (box.max_x - box.min_x) / cell_m + 2.0;
  const double rows = (box.max_y - box.min_y) / cell_m + 2.0;
  if (!(columns * rows < kMostCells)) {
    throw std::runtime_error("the ground truth spreads over more than " + std::to_string(kMostCells) + " cells");
  }
  Lattice lattice;
  lattice.cell_m = cell_m;
  lattice.first_column = static_cast<std::int64_t>(std::floor(box.min_x / cell_m));
  lattice.first_row = static_cast<std::int64_t>(std::floor(box.min_y / cell_m));
  lattice.width = static_cast<std::size_t>(columns);
  lattice.height = static_cast<std::size_t>(rows);
  return lattice;
}

/// What the scans observe at their true poses, as far as it lies in the submap's grid.
ObservedArea observed_area(const LiveDrive& drive, const EvalSubmap& submap, const Lattice& lattice) {
  CellCounts counts(lattice.width, lattice.height, lattice.cell_m, static_cast<double>(lattice.first_column),
                    static_cast<double>(lattice.first_row));
  for (std::size_t i = 0; i < submap.scan_count; ++i) {
    const LiveScan& live = drive.scans[submap.first_scan + i];
    const PosedScan scan = posed(live, live.truth_T_base);
    counts.add(scan, scan.world_T_laser);
  }
  const Pose2 submap_T_truth = inverse(submap.truth_T_submap);
  const double half_m = 0.5 * submap.grid.side * static_cast<double>(submap.grid.cell_m);
  ObservedArea area;
  area.bits.resize((counts.size() + 63) / 64);
  for (std::size_t cell = 0; cell < counts.size(); ++cell) {
    if (counts.observations(cell) == 0) {
      continue;
    }
    const auto column = static_cast<double>(lattice.first_column) + static_cast<double>(cell % lattice.width) + 0.5;
    const std::size_t row_above = cell / lattice.width;
    const auto row = static_cast<double>(lattice.first_row) + static_cast<double>(row_above) + 0.5;
    const Pose2 at = compose(submap_T_truth, {column * lattice.cell_m, row * lattice.cell_m, 0.0});
    if (std::fabs(at.x) < half_m && std::fabs(at.y) < half_m) {
      area.bits[cell / 64] |= std::uint64_t{1} << (cell % 64);
      area.cells += 1;
    }
  }
  return area;
}

/// The middle of the box round the places where the scans were taken, in axes of that heading.
Pose2 frame_of(const std::vector<PosedScan>& scans, double heading_rad) {
  const Pose2 axes{0.0, 0.0, heading_rad};
  MapBounds box;
  for (const PosedScan& scan : scans) {
    const Pose2 at = between(axes, scan.world_T_laser);
    box.include(at.x, at.y);
  }
  return compose(axes, {0.5 * (box.min_x + box.max_x), 0.5 * (box.min_y + box.max_y), 0.0});
}

void render(const LiveDrive& drive, const SubmapOptions& options, double heading_rad, EvalSubmap& submap) {
  std::vector<PosedScan> scans;
  PosePairs fit;
  for (std::size_t i = 0; i < submap.scan_count; ++i) {
    const LiveScan& live = drive.scans[submap.first_scan + i];
    scans.push_back(posed(live, live.session_T_base));
    add_for_fit(live.session_T_base, live.truth_T_base, fit);
  }
  submap.grid = render_submap(scans, frame_of(scans, heading_rad), options.side, options.cell_m);
  submap.truth_T_submap = compose(align(fit), submap.grid.world_T_submap);
}

std::size_t shared_cells(const ObservedArea& a, const ObservedArea& b) {
  std::size_t shared = 0;
  for (std::size_t i = 0; i < a.bits.size(); ++i) {
    shared += static_cast<std::size_t>(std::popcount(a.bits[i] & b.bits[i]));
  }
  return shared;
}

bool share_scans(const EvalSubmap& a, const EvalSubmap& b) {
  return a.drive == b.drive && a.first_scan < b.first_scan + b.scan_count && b.first_scan < a.first_scan + a.scan_count;
}

}  // namespace

TruthOfLive::TruthOfLive(const std::vector<StampedPose>& live, const std::vector<StampedPose>& truth) {
  for (const StampedPose& known : truth) {
    const StampedPose* const found = pose_at(live, known.seconds);
    if (found != nullptr) {
      anchors_.push_back({known.seconds, found->pose, known.pose});
    }
  }
}

bool TruthOfLive::correct(double seconds, const Pose2& live_T_base, Pose2& truth_T_base) const {
  const auto after = std::lower_bound(anchors_.begin(), anchors_.end(), seconds,
                                      [](const Anchor& anchor, double s) { return anchor.seconds < s; });
  // By the neighbours that lie within reach.
  std::vector<Anchor> near;
  std::vector<Pose2> carried;
  for (auto it = after == anchors_.begin() ? after : after - 1; it != anchors_.end() && it <= after; ++it) {
    const Pose2 anchor_T_base = between(it->live, live_T_base);
    if (translation(anchor_T_base) <= kTruthReach_m) {
      near.push_back(*it);
      carried.push_back(compose(it->truth, anchor_T_base));
    }
  }
  if (near.empty()) {
    return false;
  }
  const double way_s = std::max(near.back().seconds - near.front().seconds, 1e-9);
  const double share = near.size() == 2 ? (seconds - near.front().seconds) / way_s : 0.0;
  truth_T_base = blend(carried.front(), carried.back(), share);
  return true;
}

LiveDrive drive_live(const Log& log, const std::vector<StampedPose>& truth, const LiveOptions& options) {
  std::vector<std::uint8_t> lasers;
  const Config config = live_config(log, options, lasers);
  port::HeapFlash flash(port::FlashGeometry{});
  MappingRun run(config, flash.flash(), nullptr);
  run.map(log, lasers, nullptr);
  const MappedSession& session = run.sessions().front();
  const TruthOfLive correction(by_time(run.live_trajectory(session)), by_time(truth));

  LiveDrive drive{log.path, {}};
  std::set<std::uint32_t> seen;
  std::size_t stretch = 0;
  bool gap = false;
  for (std::size_t i = 0; i < session.scans.size(); ++i) {
    const MappedSession::MappedScan& mapped = session.scans[i];
    // A taken scan is the first that hangs on itself.
    if (!is_identity(mapped.anchor_T_base) || !seen.insert(mapped.anchor_scan).second) {
      continue;
    }
    LiveScan live;
    if (!correction.correct(mapped.seconds, mapped.session_T_base, live.truth_T_base)) {
      gap = true;
      continue;
    }
    stretch += gap || mapped.use == ScanUse::lost ? 1 : 0;
    gap = false;
    const LaserSpec& laser = log.lasers[log.scans[i].laser];
    live.seconds = mapped.seconds;
    live.session_T_base = mapped.session_T_base;
    live.base_T_laser = laser.base_T_laser;
    live.scan = {{},
                 log.scans[i].ranges,
                 laser.angle_min_rad,
                 laser.increment_rad,
                 std::min(laser.max_range_m, options.max_range_m)};
    live.stretch = stretch;
    drive.scans.push_back(std::move(live));
  }
  if (drive.scans.empty()) {
    throw std::runtime_error(log.path + ": expected scans at stamps of the ground truth, found none");
  }
  return drive;
}

std::vector<EvalSubmap> make_submaps(const std::vector<LiveDrive>& drives, const SubmapOptions& options,
                                     std::size_t threads) {
  const std::size_t every = options.every != 0 ? options.every : std::max<std::size_t>(options.scans / 4U, 1);
  std::vector<EvalSubmap> submaps;
  for (std::size_t d = 0; d < drives.size(); ++d) {
    const std::vector<LiveScan>& scans = drives[d].scans;
    for (std::size_t first = 0; first + options.scans <= scans.size(); first += every) {
      if (scans[first].stretch == scans[first + options.scans - 1].stretch) {
        EvalSubmap submap;
        submap.drive = d;
        submap.first_scan = first;
        submap.scan_count = options.scans;
        submaps.push_back(std::move(submap));
      }
    }
  }
  const Lattice lattice = lattice_of(drives, options.area_cell_m);
  in_parallel(threads, submaps.size(), [&](std::size_t, std::size_t i) {
    EvalSubmap& submap = submaps[i];
    Random random(options.seed, i);
    const double heading = options.frames == SubmapFrames::random ? kTwoPi * random.uniform() - kPi : 0.0;
    render(drives[submap.drive], options, heading, submap);
    submap.area = observed_area(drives[submap.drive], submap, lattice);
  });
  return submaps;
}

std::vector<EvalPair> make_pairs(const std::vector<EvalSubmap>& submaps, PairChoice choice) {
  std::vector<EvalPair> pairs;
  for (std::size_t a = 0; a < submaps.size(); ++a) {
    for (std::size_t b = a + 1; b < submaps.size(); ++b) {
      if (share_scans(submaps[a], submaps[b]) ||
          (choice == PairChoice::between_sessions && submaps[a].drive == submaps[b].drive)) {
        continue;
      }
      const std::size_t shared = shared_cells(submaps[a].area, submaps[b].area);
      const std::size_t smaller = std::min(submaps[a].area.cells, submaps[b].area.cells);
      const std::size_t either = submaps[a].area.cells + submaps[b].area.cells - shared;
      EvalPair pair{a, b, 0.0, 0.0, between(submaps[a].truth_T_submap, submaps[b].truth_T_submap), 1.0};
      if (smaller > 0) {
        pair.overlap = static_cast<double>(shared) / static_cast<double>(smaller);
        pair.union_overlap = static_cast<double>(shared) / static_cast<double>(either);
      }
      pairs.push_back(pair);
    }
  }
  return pairs;
}

}  // namespace mellin::host
