// What the matcher's suites share: a matcher with its memory, offices to look at, pictures moved and turned.
#pragma once

#include <doctest.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "mellin/core/random.hpp"
#include "mellin/grid/digest.hpp"
#include "mellin/spectral/matcher.hpp"

namespace mellin::test {

using Picture = std::vector<std::uint8_t>;

/// A matcher with memory for itself and as many features as are asked for.
class Bench {
 public:
  explicit Bench(const MatcherConfig& config, VectorUnit unit = best_vector_unit()) : config_(config) {
    MeasureArena measure;
    Matcher::carve(measure, config);
    memory_.resize(measure.use().total() / sizeof(double));
    Arena arena(Span<std::byte>(reinterpret_cast<std::byte*>(memory_.data()), measure.use().total()));
    REQUIRE(matcher.init(config, Matcher::carve(arena, config), unit) == Status::ok);
    REQUIRE(arena.ok());
    REQUIRE(arena.use().total() == measure.use().total());
  }

  /// Features over memory that lives as long as the bench.
  Features carve(FeatureUse use = FeatureUse::both) {
    MeasureArena measure;
    Features::carve(measure, config_, use);
    feature_memory_.emplace_back(measure.use().total() / sizeof(double));
    std::vector<double>& memory = feature_memory_.back();
    Arena arena(Span<std::byte>(reinterpret_cast<std::byte*>(memory.data()), measure.use().total()));
    return Features::carve(arena, config_, use);
  }
  Features extract(const Picture& picture, FeatureUse use = FeatureUse::both) {
    Features features = carve(use);
    REQUIRE(matcher.extract({picture.data(), picture.size()}, features) == Status::ok);
    return features;
  }
  HypothesisList match(const Picture& a, const Picture& b) {
    REQUIRE(matcher.match(extract(a), extract(b)) == Status::ok);
    return matcher.hypotheses();
  }

  Matcher matcher;

 private:
  MatcherConfig config_;
  std::vector<double> memory_;
  std::vector<std::vector<double>> feature_memory_;
};

constexpr MatcherConfig config_of(std::uint16_t side, float pixel_m = 1.0F) {
  MatcherConfig config;
  config.side = side;
  config.pixel_m = pixel_m;
  return config;
}

struct Wall {
  double x0, y0, x1, y1;
};

/// A floor of an office building round the origin: two corridors, rooms of different sizes with doors, furniture.
inline std::vector<Wall> office(std::uint64_t seed) {
  Random random(seed, 1);
  std::vector<Wall> walls;
  for (const double corridor : {-1.0, 1.0}) {
    for (double x = -24.0; x < 24.0;) {
      const double width = 2.5 + 3.5 * random.uniform();
      const double depth = corridor * (3.5 + 2.5 * random.uniform());
      const double door = x + 0.3 + (width - 1.5) * random.uniform();
      walls.push_back({x, corridor, door, corridor});
      walls.push_back({door + 0.9, corridor, x + width, corridor});
      walls.push_back({x, corridor, x, corridor + depth});
      walls.push_back({x, corridor + depth, x + width, corridor + depth});
      for (int i = 0; i < 2; ++i) {
        const double fx = x + 0.4 + (width - 1.4) * random.uniform();
        const double fy = corridor + depth * (0.2 + 0.6 * random.uniform());
        walls.push_back({fx, fy, fx + 0.6 * random.uniform(), fy + 0.8 * (random.uniform() - 0.5)});
      }
      x += width;
    }
  }
  for (const double x : {-7.0, -5.2}) {
    walls.push_back({x, -14.0, x, -1.0});
    walls.push_back({x, 5.0, x, 14.0 + x / 7.0});
  }
  return walls;
}

/// The submap at `world_T_submap`: what lies within `range_m` of it, drawn from the walls themselves, so that two
/// submaps of the same walls are two samplings, not one picture turned.
inline std::vector<std::uint8_t> render(const std::vector<Wall>& walls, const Pose2& world_T_submap, std::uint16_t side,
                                        double cell_m, double range_m) {
  std::vector<std::uint8_t> cells(std::size_t{side} * side, kUnobserved);
  const double half = side / 2.0;
  for (std::size_t r = 0; r < side; ++r) {
    for (std::size_t c = 0; c < side; ++c) {
      const double x = (static_cast<double>(c) + 0.5 - half) * cell_m;
      const double y = (static_cast<double>(r) + 0.5 - half) * cell_m;
      if (x * x + y * y < range_m * range_m) {
        cells[r * side + c] = 0;
      }
    }
  }
  const Pose2 submap_T_world = inverse(world_T_submap);
  for (const Wall& wall : walls) {
    const double length = std::hypot(wall.x1 - wall.x0, wall.y1 - wall.y0);
    const int points = static_cast<int>(length / cell_m * 4.0) + 2;
    for (int i = 0; i < points; ++i) {
      const double t = i / (points - 1.0);
      const Pose2 p =
          compose(submap_T_world, {wall.x0 + t * (wall.x1 - wall.x0), wall.y0 + t * (wall.y1 - wall.y0), 0});
      const double c = std::floor(p.x / cell_m + half);
      const double r = std::floor(p.y / cell_m + half);
      if (p.x * p.x + p.y * p.y < range_m * range_m && c >= 0 && c < side && r >= 0 && r < side) {
        cells[static_cast<std::size_t>(r) * side + static_cast<std::size_t>(c)] = kCertainlyOccupied;
      }
    }
  }
  return cells;
}

inline Picture digest_of(const std::vector<std::uint8_t>& cells, std::uint16_t grid_side, std::uint16_t side) {
  Picture picture(std::size_t{side} * side);
  std::vector<float> scratch(DigestMaker::scratch_size(grid_side, side));
  DigestOut out;
  out.obstacles = {picture.data(), picture.size()};
  out.side = side;
  REQUIRE(make_digest({{cells.data(), cells.size()}, grid_side, 0.1F}, {scratch.data(), scratch.size()}, out) ==
          Status::ok);
  return picture;
}

struct Error {
  double metres;
  double radians;
};

inline Error error_of(const Pose2& pose, const Pose2& truth) {
  return {std::hypot(pose.x - truth.x, pose.y - truth.y), std::fabs(wrap_angle(pose.theta - truth.theta))};
}

/// `picture` moved by whole pixels; what leaves the frame is lost.
inline Picture moved(const Picture& picture, std::size_t side, int dx, int dy) {
  Picture out(picture.size(), 0);
  const auto n = static_cast<std::ptrdiff_t>(side);
  for (std::ptrdiff_t r = 0; r < n; ++r) {
    for (std::ptrdiff_t c = 0; c < n; ++c) {
      if (c - dx >= 0 && c - dx < n && r - dy >= 0 && r - dy < n) {
        out[static_cast<std::size_t>(r * n + c)] = picture[static_cast<std::size_t>((r - dy) * n + c - dx)];
      }
    }
  }
  return out;
}

/// `picture` turned by 90 degrees from x to y, exactly.
inline Picture quarter_turned(const Picture& picture, std::size_t side) {
  Picture out(picture.size());
  for (std::size_t r = 0; r < side; ++r) {
    for (std::size_t c = 0; c < side; ++c) {
      out[c * side + (side - 1 - r)] = picture[r * side + c];
    }
  }
  return out;
}

/// A small picture in the middle of a larger one.
inline Picture centred(const Picture& picture, std::size_t side, std::size_t in) {
  Picture out(in * in, 0);
  const std::size_t border = (in - side) / 2;
  for (std::size_t r = 0; r < side; ++r) {
    for (std::size_t c = 0; c < side; ++c) {
      out[(r + border) * in + c + border] = picture[r * side + c];
    }
  }
  return out;
}

inline bool all_finite(const HypothesisList& hypotheses) {
  for (const Hypothesis& h : hypotheses) {
    if (!is_finite(h.a_T_b) || !std::isfinite(h.peak) || !std::isfinite(h.rotation_peak)) {
      return false;
    }
  }
  return true;
}

}  // namespace mellin::test
