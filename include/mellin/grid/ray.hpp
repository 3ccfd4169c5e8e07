// Rays on a grid of cells: which cells a laser beam runs through, in integers, so that walking it a second time meets
// exactly the same cells, whatever part of it is looked at.
#pragma once

#include <cstdint>

namespace mellin {

/// Cells [column_min, column_end) x [row_min, row_end) of the unbounded world grid.
struct CellRect {
  std::int32_t column_min = 0;
  std::int32_t row_min = 0;
  std::int32_t column_end = 0;
  std::int32_t row_end = 0;

  bool empty() const { return column_min >= column_end || row_min >= row_end; }
  bool contains(std::int32_t column, std::int32_t row) const {
    return column >= column_min && column < column_end && row >= row_min && row < row_end;
  }
};

inline bool operator==(const CellRect& a, const CellRect& b) {
  return a.column_min == b.column_min && a.row_min == b.row_min && a.column_end == b.column_end &&
         a.row_end == b.row_end;
}

CellRect intersection(const CellRect& a, const CellRect& b);

/// A beam from its first cell (the sensor's) to its last. Where `hit`, the last cell reflected the beam; otherwise the
/// beam is only known to have passed. Coordinates up to 2^29 in magnitude, extents up to 2^14.
struct Ray {
  std::int32_t column_from = 0;
  std::int32_t row_from = 0;
  std::int32_t column_to = 0;
  std::int32_t row_to = 0;
  bool hit = true;
};

namespace detail {

/// Bresenham's line in closed form: after i steps along the longer axis (extent `major`), the shorter axis (extent
/// `minor` <= major) has moved by floor((2 i minor + major) / (2 major)).
struct RaySteps {
  std::int32_t major;
  std::int32_t minor;

  std::int32_t moved(std::int32_t i) const { return major == 0 ? 0 : (2 * i * minor + major) / (2 * major); }
  /// The first step at which the shorter axis has moved by at least k; major + 1 where it never does.
  std::int32_t first_with(std::int32_t k) const {
    if (k <= 0) {
      return 0;
    }
    if (k > minor) {
      return major + 1;
    }
    return ((2 * k - 1) * major + 2 * minor - 1) / (2 * minor);
  }
};

/// Steps [first, end) at which from + direction * moved lies in [low, high), for a coordinate that moves monotonically
/// by one a step or less; `first_with(k)` says at which step it has moved by k.
template <class FirstWith>
void clip_axis(std::int32_t from, bool forward, std::int32_t low, std::int32_t high, FirstWith first_with,
               std::int32_t& first, std::int32_t& end) {
  const std::int32_t enter = forward ? low - from : from - (high - 1);
  const std::int32_t leave = forward ? high - from : from - low + 1;
  const std::int32_t begin_step = first_with(enter);
  const std::int32_t end_step = leave <= 0 ? 0 : first_with(leave);
  first = begin_step > first ? begin_step : first;
  end = end_step < end ? end_step : end;
}

}  // namespace detail

/// Calls visit(column, row, is_hit) for each cell of the ray inside `rect`, from the sensor outwards. Cost: a few
/// divisions, then proportional to the cells visited.
template <class Visit>
void visit_ray(const Ray& ray, const CellRect& rect, Visit&& visit) {
  if (rect.empty()) {
    return;
  }
  const std::int32_t dc = ray.column_to - ray.column_from;
  const std::int32_t dr = ray.row_to - ray.row_from;
  const std::int32_t wide = dc < 0 ? -dc : dc;
  const std::int32_t high = dr < 0 ? -dr : dr;
  const bool along_columns = wide >= high;
  const detail::RaySteps steps{along_columns ? wide : high, along_columns ? high : wide};
  std::int32_t first = 0;
  std::int32_t end = steps.major + 1;
  const auto by_major = [&](std::int32_t k) { return k <= 0 ? 0 : (k > steps.major ? steps.major + 1 : k); };
  const auto by_minor = [&](std::int32_t k) { return steps.first_with(k); };
  if (along_columns) {
    detail::clip_axis(ray.column_from, dc >= 0, rect.column_min, rect.column_end, by_major, first, end);
    detail::clip_axis(ray.row_from, dr >= 0, rect.row_min, rect.row_end, by_minor, first, end);
  } else {
    detail::clip_axis(ray.row_from, dr >= 0, rect.row_min, rect.row_end, by_major, first, end);
    detail::clip_axis(ray.column_from, dc >= 0, rect.column_min, rect.column_end, by_minor, first, end);
  }
  if (first >= end) {
    return;
  }
  const std::int32_t column_step = dc < 0 ? -1 : 1;
  const std::int32_t row_step = dr < 0 ? -1 : 1;
  const std::int32_t moved = steps.moved(first);
  std::int32_t column = ray.column_from + column_step * (along_columns ? first : moved);
  std::int32_t row = ray.row_from + row_step * (along_columns ? moved : first);
  std::int32_t rest = 2 * first * steps.minor + steps.major - 2 * steps.major * moved;
  for (std::int32_t i = first; i < end; ++i) {
    visit(column, row, ray.hit && i == steps.major);
    rest += 2 * steps.minor;
    const bool side_step = rest >= 2 * steps.major && steps.major > 0;
    rest -= side_step ? 2 * steps.major : 0;
    column += along_columns || side_step ? column_step : 0;
    row += !along_columns || side_step ? row_step : 0;
  }
}

}  // namespace mellin
