// Screening and registration on a recorded building: submaps rendered from the scans of Intel Research Lab at their
// corrected poses, each in a random orientation.
#include <doctest.h>
#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "mellin/core/random.hpp"
#include "mellin/grid/digest.hpp"
#include "mellin/spectral/matcher.hpp"

using namespace mellin;

namespace {

constexpr std::uint16_t kGridSide = 768;
constexpr double kCell = 0.05;
constexpr double kMaxRange = 20.0;
constexpr std::size_t kScans = 40;

struct Scan {
  Pose2 pose;
  std::vector<double> ranges;
};

struct Submap {
  Pose2 world_T_submap;
  std::vector<std::uint8_t> cells;
};

std::filesystem::path data_folder() {
  const char* const given = std::getenv("MELLIN_DATA");
  return given != nullptr ? given : std::filesystem::path(__FILE__).parent_path().parent_path() / "../shared/data";
}

/// The scans of the log that have a corrected pose, by stamp in milliseconds.
std::vector<Scan> read_scans(const std::filesystem::path& folder) {
  std::map<long, Pose2> poses;
  std::ifstream truth(folder / "intel.tum");
  double t = 0, x = 0, y = 0, z = 0, qx = 0, qy = 0, qz = 0, qw = 0;
  while (truth >> t >> x >> y >> z >> qx >> qy >> qz >> qw) {
    poses[std::lround(t * 1000)] = {x, y, 2 * std::atan2(qz, qw)};
  }
  std::vector<Scan> scans;
  gzFile log = gzopen((folder / "intel.log.gz").c_str(), "rb");
  std::vector<char> line(1 << 16);
  while (log != nullptr && gzgets(log, line.data(), static_cast<int>(line.size())) != nullptr) {
    std::istringstream words(line.data());
    std::string kind;
    std::size_t count = 0;
    words >> kind >> count;
    if (kind != "FLASER") {
      continue;
    }
    Scan scan;
    scan.ranges.resize(count);
    for (double& range : scan.ranges) {
      words >> range;
    }
    double skipped = 0;
    for (int i = 0; i < 6; ++i) {
      words >> skipped;
    }
    words >> t;
    for (const long stamp : {0L, -1L, 1L}) {
      const auto found = poses.find(std::lround(t * 1000) + stamp);
      if (found != poses.end()) {
        scan.pose = found->second;
        scans.push_back(scan);
        break;
      }
    }
  }
  if (log != nullptr) {
    gzclose(log);
  }
  return scans;
}

Submap render(const std::vector<Scan>& scans, std::size_t first, double turn) {
  Submap submap;
  for (std::size_t i = first; i < first + kScans; ++i) {
    submap.world_T_submap.x += scans[i].pose.x / static_cast<double>(kScans);
    submap.world_T_submap.y += scans[i].pose.y / static_cast<double>(kScans);
  }
  submap.world_T_submap.theta = turn;
  std::vector<int> hits(std::size_t{kGridSide} * kGridSide);
  std::vector<int> seen(hits.size());
  for (std::size_t i = first; i < first + kScans; ++i) {
    const Pose2 laser = between(submap.world_T_submap, scans[i].pose);
    for (std::size_t beam = 0; beam < scans[i].ranges.size(); ++beam) {
      const double range = scans[i].ranges[beam];
      if (range >= kMaxRange) {
        continue;
      }
      const double angle = laser.theta + (static_cast<double>(beam) - 90.0) * kPi / 180.0;
      std::size_t before = hits.size();
      const int steps = static_cast<int>(range / (0.5 * kCell));
      for (int s = 0; s <= steps; ++s) {
        const double r = s == steps ? range : s * 0.5 * kCell;
        const double column = std::floor((laser.x + r * std::cos(angle)) / kCell) + 0.5 * kGridSide;
        const double row = std::floor((laser.y + r * std::sin(angle)) / kCell) + 0.5 * kGridSide;
        if (column < 0 || column >= kGridSide || row < 0 || row >= kGridSide) {
          break;
        }
        const std::size_t cell = static_cast<std::size_t>(row) * kGridSide + static_cast<std::size_t>(column);
        seen[cell] += cell != before ? 1 : 0;
        hits[cell] += s == steps ? 1 : 0;
        before = cell;
      }
    }
  }
  submap.cells.resize(hits.size(), kUnobserved);
  for (std::size_t i = 0; i < hits.size(); ++i) {
    if (seen[i] > 0) {
      submap.cells[i] = static_cast<std::uint8_t>(std::lround(254.0 * std::min(hits[i], seen[i]) / seen[i]));
    }
  }
  return submap;
}

struct Picture {
  std::vector<std::uint8_t> obstacles;
  std::vector<std::uint8_t> observed;
};

Picture digest_of(const Submap& submap, std::uint16_t side) {
  Picture picture{std::vector<std::uint8_t>(std::size_t{side} * side), std::vector<std::uint8_t>(mask_bytes(side))};
  std::vector<float> scratch(DigestMaker::scratch_size(kGridSide, side));
  DigestOut out;
  out.obstacles = {picture.obstacles.data(), picture.obstacles.size()};
  out.observed = {picture.observed.data(), picture.observed.size()};
  out.side = side;
  REQUIRE(make_digest({{submap.cells.data(), submap.cells.size()}, kGridSide, static_cast<float>(kCell)},
                      {scratch.data(), scratch.size()}, out) == Status::ok);
  return picture;
}

/// Share of the smaller observed area that both have seen.
double overlap(const Picture& a, const Picture& b, const Pose2& a_T_b, std::uint16_t side) {
  const double pixel = kGridSide * kCell / side;
  const auto seen = [side](const Picture& picture, double column, double row) {
    return column >= 0 && row >= 0 && column < side && row < side &&
           mask_bit({picture.observed.data(), picture.observed.size()},
                    static_cast<std::size_t>(row) * side + static_cast<std::size_t>(column));
  };
  double in_a = 0, in_b = 0, both = 0;
  for (int r = 0; r < side; ++r) {
    for (int c = 0; c < side; ++c) {
      in_a += seen(a, c, r) ? 1 : 0;
      if (seen(b, c, r)) {
        in_b += 1;
        const Pose2 p = compose(a_T_b, {(c + 0.5 - side / 2.0) * pixel, (r + 0.5 - side / 2.0) * pixel, 0});
        both += seen(a, std::floor(p.x / pixel + side / 2.0), std::floor(p.y / pixel + side / 2.0)) ? 1 : 0;
      }
    }
  }
  return both / std::max(1.0, std::min(in_a, in_b));
}

struct Pair {
  std::size_t a, b;
  bool positive;
  float peak;
  double metres, radians;
};

/// All pairs that share at least 40 % (positive) or at most 10 % (negative) of what they have seen, best peak first.
std::vector<Pair> match_all(const std::vector<Submap>& submaps, std::uint16_t side, bool positives_only,
                            MatcherConfig config = {}) {
  config.side = side;
  config.pixel_m = static_cast<float>(kGridSide * kCell / side);
  MeasureArena measure;
  Matcher::carve(measure, config);
  for (std::size_t i = 0; i < submaps.size(); ++i) {
    Features::carve(measure, config);
  }
  std::vector<double> memory(measure.use().total() / sizeof(double));
  Arena arena(Span<std::byte>(reinterpret_cast<std::byte*>(memory.data()), measure.use().total()));
  Matcher matcher;
  REQUIRE(matcher.init(config, Matcher::carve(arena, config)) == Status::ok);
  std::vector<Picture> pictures;
  std::vector<Features> features;
  for (const Submap& submap : submaps) {
    pictures.push_back(digest_of(submap, side));
    features.push_back(Features::carve(arena, config));
    REQUIRE(matcher.extract({pictures.back().obstacles.data(), pictures.back().obstacles.size()}, features.back(),
                            {pictures.back().observed.data(), pictures.back().observed.size()}) == Status::ok);
  }
  std::vector<Pair> pairs;
  for (std::size_t a = 0; a < submaps.size(); ++a) {
    for (std::size_t b = a + 2; b < submaps.size(); ++b) {
      const Pose2 truth = between(submaps[a].world_T_submap, submaps[b].world_T_submap);
      const double shared = translation(truth) > 30 ? 0 : overlap(pictures[a], pictures[b], truth, side);
      if (shared < 0.4 && (shared > 0.1 || positives_only)) {
        continue;
      }
      REQUIRE(matcher.match(features[a], features[b]) == Status::ok);
      REQUIRE_FALSE(matcher.hypotheses().empty());
      const Hypothesis& best = matcher.hypotheses()[0];
      pairs.push_back({a, b, shared >= 0.4, best.peak, std::hypot(best.a_T_b.x - truth.x, best.a_T_b.y - truth.y),
                       std::fabs(wrap_angle(best.a_T_b.theta - truth.theta))});
    }
  }
  std::sort(pairs.begin(), pairs.end(), [](const Pair& p, const Pair& q) { return p.peak > q.peak; });
  return pairs;
}

double share_right(const std::vector<Pair>& pairs) {
  double right = 0, all = 0;
  for (const Pair& pair : pairs) {
    right += pair.metres < 0.8 && pair.radians < 10 * kPi / 180 ? 1 : 0;
    all += 1;
  }
  return right / all;
}

}  // namespace

TEST_SUITE("matcher_data") {
  TEST_CASE("intel: screening ranks overlapping submaps first and registration is good to a few centimetres") {
    const std::filesystem::path folder = data_folder();
    if (!std::filesystem::exists(folder / "intel.log.gz")) {
      MESSAGE("skipped: no data");
      return;
    }
    const std::vector<Scan> scans = read_scans(folder);
    REQUIRE(scans.size() > 800);
    Random random(5, 0);
    std::vector<Submap> submaps;
    for (std::size_t first = 0; first + kScans <= scans.size(); first += kScans / 2) {
      submaps.push_back(render(scans, first, kTwoPi * random.uniform()));
    }

    const std::vector<Pair> pairs = match_all(submaps, 96, false);
    double positives = 0, right = 0, precision_sum = 0;
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      if (pairs[i].positive) {
        positives += 1;
        precision_sum += positives / static_cast<double>(i + 1);
        right += pairs[i].metres < 0.8 && pairs[i].radians < 10 * kPi / 180 ? 1 : 0;
      }
    }
    const double average_precision = precision_sum / positives;
    MESSAGE("screening at 96 px: " << pairs.size() << " pairs, " << positives << " positive, average precision "
                                   << average_precision << ", right poses " << right / positives);
    REQUIRE(positives > 30);
    CHECK(average_precision > 0.95);
    CHECK(right / positives > 0.85);

    MatcherConfig without;
    without.free_weight = 0.0F;
    const double with_free = share_right(match_all(submaps, 96, true));
    const double without_free = share_right(match_all(submaps, 96, true, without));
    MESSAGE("right poses where observed free space counts " << with_free << ", where it does not " << without_free);
    CHECK(with_free > without_free);

    std::vector<double> metres;
    double wrong = 0;
    for (const Pair& pair : match_all(submaps, 384, true)) {
      metres.push_back(pair.metres);
      wrong += pair.metres > 0.5 || pair.radians > 10 * kPi / 180 ? 1 : 0;
    }
    std::sort(metres.begin(), metres.end());
    MESSAGE("registration at 384 px: median error " << metres[metres.size() / 2] << " m, over 0.5 m or 10 degrees "
                                                    << wrong / static_cast<double>(metres.size()));
    CHECK(metres[metres.size() / 2] < 0.1);
    CHECK(wrong / static_cast<double>(metres.size()) < 0.15);
  }
}
