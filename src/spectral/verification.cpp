#include "mellin/spectral/verification.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "spectral/obstacles.hpp"

namespace mellin {
namespace {

constexpr std::uint8_t kMaxReachCells = 4;
constexpr std::uint8_t kMarkFree = 16;     // classify() only: free, whatever lies beside it
constexpr std::uint8_t kMarkBlocked = 32;  // classify() only: too close to an obstacle to contradict one

bool valid(const VerificationConfig& config) {
  return config.occupied_from >= 1 && config.occupied_from <= kCertainlyOccupied &&
         config.near_cells <= kMaxReachCells && config.clear_cells >= config.near_cells &&
         config.clear_cells <= kMaxReachCells && config.doubt_m >= 0.0F && std::isfinite(config.doubt_m);
}

bool valid(const Span<const std::uint8_t>& cells, std::uint16_t side, float cell_m) {
  return side > 0 && side % 2 == 0 && cells.size() == static_cast<std::size_t>(side) * side && cell_m > 0.0F &&
         std::isfinite(cell_m);
}

std::uint8_t class_of_block(const GridView& grid, std::uint16_t column, std::uint16_t row, std::uint16_t block,
                            std::uint8_t occupied_from) {
  std::uint32_t observed = 0;
  std::uint32_t obstacles = 0;
  const std::uint8_t* cells =
      grid.cells.data() + static_cast<std::size_t>(row) * block * grid.side + column * std::size_t{block};
  for (std::uint16_t y = 0; y < block; ++y, cells += grid.side) {
    for (std::uint16_t x = 0; x < block; ++x) {
      observed += cells[x] != kUnobserved ? 1U : 0U;
      obstacles += is_obstacle(cells[x], occupied_from) ? 1U : 0U;
    }
  }
  std::uint8_t bits = observed > 0 ? kClassObserved : 0;
  if (obstacles > 0) {
    bits |= kClassOccupied;
  } else if (observed > 0 && 2 * observed >= static_cast<std::uint32_t>(block) * block) {
    bits |= kMarkFree;
  }
  return bits;
}

/// Sets `bit` in all cells within `reach` of (column, row).
void stamp(Span<std::uint8_t> cells, int side, int column, int row, int reach, std::uint8_t bit) {
  for (int y = std::max(0, row - reach); y <= std::min(side - 1, row + reach); ++y) {
    for (int x = std::max(0, column - reach); x <= std::min(side - 1, column + reach); ++x) {
      std::uint8_t& cell =
          cells[static_cast<std::size_t>(y) * static_cast<std::size_t>(side) + static_cast<std::size_t>(x)];
      cell = static_cast<std::uint8_t>(cell | bit);
    }
  }
}

/// From occupied and free to near and clear.
void finish_classes(Span<std::uint8_t> cells, std::uint16_t side, const VerificationConfig& config) {
  for (std::uint16_t row = 0; row < side; ++row) {
    for (std::uint16_t column = 0; column < side; ++column) {
      if ((cells[static_cast<std::size_t>(row) * side + column] & kClassOccupied) != 0) {
        stamp(cells, side, column, row, config.clear_cells, kMarkBlocked);
        stamp(cells, side, column, row, config.near_cells, kClassNear);
      }
    }
  }
  for (std::uint8_t& cell : cells) {
    const bool clear = (cell & kMarkFree) != 0 && (cell & kMarkBlocked) == 0;
    cell =
        static_cast<std::uint8_t>((cell & (kClassObserved | kClassOccupied | kClassNear)) | (clear ? kClassClear : 0));
  }
}

/// What the cells of `from` say about `onto`, from lying at onto_T_from.
struct Evidence {
  std::uint32_t hits = 0;
  std::uint32_t conflicts = 0;
  std::uint32_t shared = 0;
  std::uint32_t observed = 0;
};

/// Where the centres of the cells of one class grid lie in another, in cells.
class Placing {
 public:
  Placing(const ClassView& onto, const ClassView& from, const Pose2& onto_T_from) {
    const SinCos turn = sincos(onto_T_from.theta);
    const double ratio = static_cast<double>(from.cell_m) / static_cast<double>(onto.cell_m);
    along_ = static_cast<float>(turn.cos * ratio);
    across_ = static_cast<float>(turn.sin * ratio);
    offset_x_ = static_cast<float>(onto_T_from.x / static_cast<double>(onto.cell_m) + 0.5 * onto.side);
    offset_y_ = static_cast<float>(onto_T_from.y / static_cast<double>(onto.cell_m) + 0.5 * onto.side);
    half_ = 0.5F * static_cast<float>(from.side) - 0.5F;
  }
  Point2f operator()(std::uint16_t column, std::uint16_t row) const {
    const float x = static_cast<float>(column) - half_;
    const float y = static_cast<float>(row) - half_;
    return {offset_x_ - across_ * y + along_ * x, offset_y_ + along_ * y + across_ * x};
  }

 private:
  float along_;
  float across_;
  float offset_x_;
  float offset_y_;
  float half_;
};

/// The class at a point, 0 beyond the border. Without branches: where a point falls is hard to guess.
std::uint8_t class_at(const ClassView& view, Point2f point) {
  const auto limit = static_cast<float>(view.side);
  const bool inside = static_cast<int>(point.x >= 0.0F) & static_cast<int>(point.y >= 0.0F) &
                      static_cast<int>(point.x < limit) & static_cast<int>(point.y < limit);
  const auto column = static_cast<std::uint32_t>(inside ? static_cast<std::int32_t>(point.x) : 0);
  const auto row = static_cast<std::uint32_t>(inside ? static_cast<std::int32_t>(point.y) : 0);
  const std::uint8_t there = view.cells.data()[row * view.side + column];
  return inside ? there : std::uint8_t{0};
}

Evidence gather(const ClassView& onto, const ClassView& from, const Pose2& onto_T_from) {
  const Placing place(onto, from, onto_T_from);
  Evidence evidence;
  for (std::uint16_t row = 0; row < from.side; ++row) {
    const std::uint8_t* const cells = from.cells.data() + static_cast<std::size_t>(row) * from.side;
    for (std::uint16_t column = 0; column < from.side; ++column) {
      const std::uint8_t seen = cells[column];
      if ((seen & kClassObserved) == 0) {
        continue;
      }
      ++evidence.observed;
      const std::uint8_t there = class_at(onto, place(column, row));
      evidence.shared += (there & kClassObserved) != 0 ? 1U : 0U;
      if ((seen & kClassOccupied) != 0) {
        evidence.hits += (there & kClassNear) != 0 ? 1U : 0U;
        evidence.conflicts += (there & kClassClear) != 0 ? 1U : 0U;
      }
    }
  }
  return evidence;
}

/// Among the next eight.
bool any_occupied(const std::uint8_t* cells) {
  std::uint64_t eight = 0;
  std::memcpy(&eight, cells, sizeof eight);
  return (eight & 0x0101010101010101U * kClassOccupied) != 0;
}

/// Calls visit(column, row, occupied) for every occupied cell, row by row, and for some others.
template <class Visit>
void visit_obstacles(const ClassView& view, Visit&& visit) {
  for (std::uint16_t row = 0; row < view.side; ++row) {
    const std::uint8_t* const cells = view.cells.data() + static_cast<std::size_t>(row) * view.side;
    std::uint16_t column = 0;
    while (column < view.side) {
      if (column + sizeof(std::uint64_t) <= view.side && !any_occupied(cells + column)) {
        column = static_cast<std::uint16_t>(column + sizeof(std::uint64_t));
        continue;
      }
      visit(column, row, (cells[column] & kClassOccupied) != 0);
      ++column;
    }
  }
}

void add_obstacle(const ClassView& onto, Point2f point, Evidence& evidence) {
  const unsigned there = class_at(onto, point);
  evidence.hits += (there & kClassNear) / kClassNear;
  evidence.conflicts += (there & kClassClear) / kClassClear;
}

Evidence gather_obstacles(const ClassView& onto, const ClassObstacles& from, const Pose2& onto_T_from) {
  const Placing place(onto, from.view, onto_T_from);
  Evidence evidence;
  for (const ClassCell cell : from.cells) {
    add_obstacle(onto, place(cell.column, cell.row), evidence);
  }
  return evidence;
}

Evidence gather_obstacles(const ClassView& onto, const ClassView& from, const Pose2& onto_T_from) {
  const Placing place(onto, from, onto_T_from);
  Evidence evidence;
  visit_obstacles(from, [&](std::uint16_t column, std::uint16_t row, bool occupied) {
    if (occupied) {
      add_obstacle(onto, place(column, row), evidence);
    }
  });
  return evidence;
}

float share(double part, double whole) { return whole > 0.0 ? static_cast<float>(std::min(1.0, part / whole)) : 0.0F; }

bool valid(const ClassView& a, const ClassView& b, const Pose2& a_T_b) {
  return valid(a.cells, a.side, a.cell_m) && valid(b.cells, b.side, b.cell_m) && is_finite(a_T_b);
}

/// Hits, conflicts and the score from them.
Agreement judge(const ClassView& a, const ClassView& b, const Evidence& on_a, const Evidence& on_b,
                const VerificationConfig& config) {
  Agreement agreement;
  agreement.hits_b_on_a = on_a.hits;
  agreement.conflicts_b_on_a = on_a.conflicts;
  agreement.hits_a_on_b = on_b.hits;
  agreement.conflicts_a_on_b = on_b.conflicts;
  const auto length_a = static_cast<double>(a.cell_m);
  const auto length_b = static_cast<double>(b.cell_m);
  const double hits_m = 0.5 * (on_a.hits * length_b + on_b.hits * length_a);
  const double conflicts_m = 0.5 * (on_a.conflicts * length_b + on_b.conflicts * length_a);
  agreement.score = share(hits_m, hits_m + conflicts_m + static_cast<double>(config.doubt_m));
  return agreement;
}

}  // namespace

Result<ClassView> classify(const GridView& grid, const VerificationConfig& config, std::uint16_t side,
                           Span<std::uint8_t> out) {
  if (!valid(config)) {
    return Status::invalid_config;
  }
  const std::size_t count = static_cast<std::size_t>(side) * side;
  if (!valid(grid.cells, grid.side, grid.cell_m) || side == 0 || side % 2 != 0 || grid.side % side != 0 ||
      out.size() < count) {
    return Status::invalid_argument;
  }
  const auto block = static_cast<std::uint16_t>(grid.side / side);
  const Span<std::uint8_t> cells = out.first(count);
  for (std::uint16_t row = 0; row < side; ++row) {
    for (std::uint16_t column = 0; column < side; ++column) {
      cells[static_cast<std::size_t>(row) * side + column] =
          class_of_block(grid, column, row, block, config.occupied_from);
    }
  }
  finish_classes(cells, side, config);
  return ClassView{Span<const std::uint8_t>(cells), side, grid.cell_m * static_cast<float>(block)};
}

Result<ClassView> classify(const DigestView& digest, const VerificationConfig& config, Span<std::uint8_t> out) {
  if (!valid(config)) {
    return Status::invalid_config;
  }
  const std::size_t count = static_cast<std::size_t>(digest.side) * digest.side;
  if (!valid(digest.obstacles, digest.side, digest.cell_m) || digest.observed.size() != mask_bytes(digest.side) ||
      digest.free.size() != mask_bytes(digest.side) || out.size() < count) {
    return Status::invalid_argument;
  }
  const Span<std::uint8_t> cells = out.first(count);
  // By what a pixel's bits say: neither, observed, free alone (which is as good as neither), both. Where no cell speaks
  // for its neighbours that is all.
  const bool finished = config.clear_cells == 0;
  const auto near_and_occupied = static_cast<std::uint8_t>(kClassObserved | kClassOccupied | kClassNear);
  const auto occupied = static_cast<std::uint8_t>(finished ? near_and_occupied : kClassObserved | kClassOccupied);
  const auto free = static_cast<std::uint8_t>(kClassObserved | (finished ? kClassClear : kMarkFree));
  const std::uint8_t classes[4] = {0, occupied, 0, free};
  for (std::size_t i = 0; i < count; i += 8) {
    const unsigned observed_bits = digest.observed[i / 8];
    const unsigned free_bits = digest.free[i / 8];
    for (std::size_t k = 0; k < std::min<std::size_t>(8, count - i); ++k) {
      cells[i + k] = classes[(observed_bits >> k & 1U) | (free_bits >> k & 1U) << 1U];
    }
  }
  if (!finished) {
    finish_classes(cells, digest.side, config);
  }
  return ClassView{Span<const std::uint8_t>(cells), digest.side, digest.cell_m};
}

Result<Agreement> verify(const ClassView& a, const ClassView& b, const Pose2& a_T_b, const VerificationConfig& config) {
  if (!valid(config)) {
    return Status::invalid_config;
  }
  if (!valid(a, b, a_T_b)) {
    return Status::invalid_argument;
  }
  const Evidence on_a = gather(a, b, a_T_b);
  const Evidence on_b = gather(b, a, inverse(a_T_b));
  Agreement agreement = judge(a, b, on_a, on_b, config);
  agreement.shared_cells = on_a.shared;

  const auto length_a = static_cast<double>(a.cell_m);
  const auto length_b = static_cast<double>(b.cell_m);
  const double area_a = on_b.observed * length_a * length_a;
  const double area_b = on_a.observed * length_b * length_b;
  const double shared =
      std::min(0.5 * (on_a.shared * length_b * length_b + on_b.shared * length_a * length_a), std::min(area_a, area_b));
  agreement.overlap = share(shared, std::min(area_a, area_b));
  agreement.union_overlap = share(shared, area_a + area_b - shared);
  return agreement;
}

Result<Span<const ClassCell>> obstacles(const ClassView& view, Span<ClassCell> out) {
  if (!valid(view.cells, view.side, view.cell_m) || out.size() < view.cells.size()) {
    return Status::invalid_argument;
  }
  std::size_t count = 0;
  visit_obstacles(view, [&](std::uint16_t column, std::uint16_t row, bool occupied) {
    // Written always and kept where it counts: obstacles are too scattered to guess.
    out.data()[count] = {column, row};
    count += occupied ? 1U : 0U;
  });
  return Span<const ClassCell>(out.first(count));
}

Result<Agreement> verify_obstacles(const ClassObstacles& a, const ClassObstacles& b, const Pose2& a_T_b,
                                   const VerificationConfig& config) {
  if (!valid(config)) {
    return Status::invalid_config;
  }
  if (!valid(a.view, b.view, a_T_b)) {
    return Status::invalid_argument;
  }
  const Evidence on_a = gather_obstacles(a.view, b, a_T_b);
  const Evidence on_b = gather_obstacles(b.view, a, inverse(a_T_b));
  return judge(a.view, b.view, on_a, on_b, config);
}

Result<Agreement> verify_obstacles(const ClassView& a, const ClassView& b, const Pose2& a_T_b,
                                   const VerificationConfig& config) {
  if (!valid(config)) {
    return Status::invalid_config;
  }
  if (!valid(a, b, a_T_b)) {
    return Status::invalid_argument;
  }
  return judge(a, b, gather_obstacles(a, b, a_T_b), gather_obstacles(b, a, inverse(a_T_b)), config);
}

}  // namespace mellin
