#include "mellin/mapping/scan_matcher.hpp"

#include "mapping/surface.hpp"

namespace mellin {
namespace {

constexpr std::int32_t kSearchStep = 2;    // cells: within the reach of the field
constexpr std::int32_t kRecoveryStep = 3;  // cells: the nearest pose tried is within the reach of the field
constexpr int kRecoveryFiner = 4;          // steps of heading in one of the first search's, once it has found a place
constexpr float kInlierField = 0.1F;       // the field beside something that was hit a few times

constexpr std::uint16_t kFreeObservations = 3;  // of which none was a hit: surely free
constexpr std::uint8_t kSolid = 12;             // of 15: hit at least twice, and by two beams in five
constexpr std::uint8_t kSolidField = 204;       // the field in such a cell
constexpr int kSomeBeams = 10;                  // one in so many says nothing against a pose
constexpr std::int32_t kBeamEnd = 4;            // cells from a beam's end within which it may meet its wall

/// The field between the centres of four cells, 0 to 1, and its slope per cell.
struct Sample {
  float value;
  float dx;
  float dy;
};

Sample sample(const LiveGrid& grid, std::int32_t column, std::int32_t row, float x_cells, float y_cells) {
  const float u = x_cells - 0.5F;
  const float v = y_cells - 0.5F;
  const std::int32_t c = floor_cell(u);
  const std::int32_t r = floor_cell(v);
  const float fx = u - static_cast<float>(c);
  const float fy = v - static_cast<float>(r);
  float f00 = 0.0F;
  float f10 = 0.0F;
  float f01 = 0.0F;
  float f11 = 0.0F;
  if (grid.grid().unbroken(column + c, row + r, 1)) {
    const std::uint8_t* const low = grid.field_data() + grid.grid().index(column + c, row + r);
    const std::uint8_t* const high = low + grid.grid().side();
    f00 = low[0];
    f10 = low[1];
    f01 = high[0];
    f11 = high[1];
  } else {
    f00 = grid.field(column + c, row + r);
    f10 = grid.field(column + c + 1, row + r);
    f01 = grid.field(column + c, row + r + 1);
    f11 = grid.field(column + c + 1, row + r + 1);
  }
  constexpr float kScale = 1.0F / 255.0F;
  const float low = f00 + fx * (f10 - f00);
  const float high = f01 + fx * (f11 - f01);
  return {kScale * (low + fy * (high - low)), kScale * ((f10 - f00) + fy * ((f11 - f01) - (f10 - f00))),
          kScale * (high - low)};
}

/// Solves a positive definite 3 x 3 system M s = v. Returns false where M is not positive definite.
bool solve(const Sym3& m, const Pose2& v, Pose2& s) {
  Sym3 inv;
  if (!invert(m, inv)) {
    return false;
  }
  s = {inv.xx * v.x + inv.xy * v.y + inv.xt * v.theta, inv.xy * v.x + inv.yy * v.y + inv.yt * v.theta,
       inv.xt * v.x + inv.yt * v.y + inv.tt * v.theta};
  return true;
}

}  // namespace

struct ScanMatcher::Linearised {
  Sym3 hessian;       // of sum (1 - field)^2 over the points, in cells and rad, axes of the grid
  Pose2 gradient;     // towards smaller cost
  float cost = 0.0F;  // sum (1 - field)^2
  float sum = 0.0F;   // of the field
  std::size_t inliers = 0;
};

std::size_t ScanMatcher::set_scan(Span<const StoredRange> ranges, Span<const Point2f> directions,
                                  const Pose2& base_T_laser, float cell_m) {
  count_ = 0;
  const float inverse_cell = 1.0F / cell_m;
  const float mount_x = static_cast<float>(base_T_laser.x) * inverse_cell;
  const float mount_y = static_cast<float>(base_T_laser.y) * inverse_cell;
  const float step = kRangeStep_m * inverse_cell;
  origin_ = {mount_x, mount_y};
  for (std::size_t i = 0; i < ranges.size() && count_ < memory_.points.size(); ++i) {
    if (ranges[i] != 0) {
      const float length = static_cast<float>(ranges[i]) * step;
      memory_.points[count_++] = {mount_x + directions[i].x * length, mount_y + directions[i].y * length};
    }
  }
  const Span<const Point2f> ends = memory_.points.first(count_);
  for (std::size_t i = 0; i < count_; ++i) {
    memory_.normals[i] = surface::normal(ends, i, cell_m);
  }
  return count_;
}

ScanMatcher::Linearised ScanMatcher::linearise(const LiveGrid& grid, const GridPose& at, float x, float y,
                                               float theta) const {
  Linearised out;
  const SinCosF turn = sincos(theta);
  const float c = at.cos * turn.cos - at.sin * turn.sin;
  const float s = at.sin * turn.cos + at.cos * turn.sin;
  const float px = at.x_cells + x;
  const float py = at.y_cells + y;
  float hxx = 0.0F, hxy = 0.0F, hxt = 0.0F, hyy = 0.0F, hyt = 0.0F, htt = 0.0F, gx = 0.0F, gy = 0.0F, gt = 0.0F;
  for (std::size_t i = 0; i < count_; ++i) {
    const Point2f q = memory_.points[i];
    const float rx = c * q.x - s * q.y;
    const float ry = s * q.x + c * q.y;
    Sample f = sample(grid, at.column, at.row, px + rx, py + ry);
    const Point2f n = memory_.normals[i];
    if (n.x != 0.0F || n.y != 0.0F) {
      const float nx = c * n.x - s * n.y;
      const float ny = s * n.x + c * n.y;
      const float across = f.dx * nx + f.dy * ny;
      f.dx = across * nx;
      f.dy = across * ny;
    }
    const float residual = 1.0F - f.value;
    const float ft = f.dy * rx - f.dx * ry;
    out.cost += residual * residual;
    out.sum += f.value;
    out.inliers += f.value > kInlierField ? 1U : 0U;
    hxx += f.dx * f.dx;
    hxy += f.dx * f.dy;
    hxt += f.dx * ft;
    hyy += f.dy * f.dy;
    hyt += f.dy * ft;
    htt += ft * ft;
    gx += residual * f.dx;
    gy += residual * f.dy;
    gt += residual * ft;
  }
  const auto d = [](float value) { return static_cast<double>(value); };
  out.hessian = {d(hxx), d(hxy), d(hxt), d(hyy), d(hyt), d(htt)};
  out.gradient = {d(gx), d(gy), d(gt)};
  return out;
}

MatchResult ScanMatcher::refine(const LiveGrid& grid, const Pose2& start, const Pose2& prior,
                                const Sym3& prior_information) const {
  MatchResult result;
  result.pose = start;
  if (count_ == 0) {
    result.information = prior_information;
    return result;
  }
  const auto cell = static_cast<double>(grid.cell_m());
  const GridPose at = grid_pose(start, grid.cell_m());
  // Everything below in cells and along the grid's axes. The scan's cost is scan_weight * mean (1 - field)^2.
  const Sym3 rotated = rotate(prior_information, prior.theta);
  const Sym3 stiffness{rotated.xx * cell * cell, rotated.xy * cell * cell, rotated.xt * cell,
                       rotated.yy * cell * cell, rotated.yt * cell,        rotated.tt};
  const Pose2 off{(start.x - prior.x) / cell, (start.y - prior.y) / cell, wrap_angle(start.theta - prior.theta)};
  const double weight = static_cast<double>(config_.scan_weight) / static_cast<double>(count_);
  const auto total = [&](const Linearised& scan, const Pose2& moved) {
    const Pose2 e{off.x + moved.x, off.y + moved.y, off.theta + moved.theta};
    return weight * static_cast<double>(scan.cost) + 0.5 * quadratic_form(stiffness, e);
  };
  Pose2 moved;
  const auto linearise_at = [&](const Pose2& m) {
    return linearise(grid, at, static_cast<float>(m.x), static_cast<float>(m.y), static_cast<float>(m.theta));
  };
  Linearised here = linearise_at(moved);
  double cost = total(here, moved);
  double damping = 0.0;
  for (std::uint16_t i = 0; i < config_.max_iterations; ++i) {
    const Pose2 e{off.x + moved.x, off.y + moved.y, off.theta + moved.theta};
    Sym3 h = scale(here.hessian, 2.0 * weight) + stiffness;
    h.xx += damping * h.xx + 1e-9;
    h.yy += damping * h.yy + 1e-9;
    h.tt += damping * h.tt + 1e-9;
    const Pose2 g{
        2.0 * weight * here.gradient.x - (stiffness.xx * e.x + stiffness.xy * e.y + stiffness.xt * e.theta),
        2.0 * weight * here.gradient.y - (stiffness.xy * e.x + stiffness.yy * e.y + stiffness.yt * e.theta),
        2.0 * weight * here.gradient.theta - (stiffness.xt * e.x + stiffness.yt * e.y + stiffness.tt * e.theta)};
    Pose2 step;
    if (!solve(h, g, step)) {
      break;
    }
    const Pose2 next{moved.x + step.x, moved.y + step.y, moved.theta + step.theta};
    const Linearised there = linearise_at(next);
    const double next_cost = total(there, next);
    if (next_cost <= cost) {
      moved = next;
      here = there;
      cost = next_cost;
      damping *= 0.1;
      if (step.x * step.x + step.y * step.y < 4e-6 && step.theta * step.theta < 1e-8) {
        result.converged = true;
        break;
      }
    } else {
      damping = damping == 0.0 ? 0.1 : 10.0 * damping;
      if (damping > 1e4) {
        result.converged = true;  // no descent left at the field's resolution
        break;
      }
    }
  }
  result.pose = {start.x + moved.x * cell, start.y + moved.y * cell, wrap_angle(start.theta + moved.theta)};
  const Sym3 h = scale(here.hessian, 2.0 * weight) + stiffness;
  const Sym3 metric{h.xx / (cell * cell), h.xy / (cell * cell), h.xt / cell, h.yy / (cell * cell), h.yt / cell, h.tt};
  result.information = rotate(metric, -result.pose.theta);
  result.score = here.sum / static_cast<float>(count_);
  result.inlier_share = static_cast<float>(here.inliers) / static_cast<float>(count_);
  result.good = result.inlier_share >= config_.min_inlier_share;
  return result;
}

Sym3 ScanMatcher::scan_information(const LiveGrid& grid, const Pose2& pose) const {
  const float cell = grid.cell_m();
  const GridPose at = grid_pose(pose, cell);
  const Span<const Point2f> ends = memory_.points.first(count_);
  float xx = 0.0F, xy = 0.0F, xt = 0.0F, yy = 0.0F, yt = 0.0F, tt = 0.0F;
  for (std::size_t i = 0; i < count_; ++i) {
    const Point2f q = memory_.points[i];
    const Sample met = sample(grid, at.column, at.row, at.x_cells + at.cos * q.x - at.sin * q.y,
                              at.y_cells + at.sin * q.x + at.cos * q.y);
    const std::size_t before = surface::neighbour(ends, i, -1, cell);
    const std::size_t behind = surface::neighbour(ends, i, 1, cell);
    if (met.value <= kInlierField || before == i || behind == i) {
      continue;
    }
    const Point2f a = memory_.points[before];
    const Point2f b = memory_.points[behind];
    const float length = sqrt(surface::squared_distance(a, b));
    const float nx = (b.y - a.y) / length;
    const float ny = (a.x - b.x) / length;
    const float off = nx * (q.x - a.x) + ny * (q.y - a.y);
    if (off > surface::kStraight * length || off < -surface::kStraight * length) {
      continue;
    }
    const float nt = (ny * q.x - nx * q.y) * cell;
    xx += nx * nx;
    xy += nx * ny;
    xt += nx * nt;
    yy += ny * ny;
    yt += ny * nt;
    tt += nt * nt;
  }
  const auto d = [](float value) { return static_cast<double>(value); };
  const double worth = d(config_.independent_share) / (d(config_.point_sigma_m) * d(config_.point_sigma_m));
  return scale({d(xx), d(xy), d(xt), d(yy), d(yt), d(tt)}, worth);
}

/// How the search points of one heading are reached.
struct ScanMatcher::SearchPoints {
  std::size_t direct =
      0;  ///< by memory_.indices: cells that stay in the window and away from its seam, all search long
  std::size_t checked = 0;  ///< by memory_.offsets: the others
};

ScanMatcher::SearchPoints ScanMatcher::place_points(const LiveGrid& grid, const GridPose& at, float theta,
                                                    std::size_t stride, std::int32_t reach_cells) const {
  const SinCosF r = sincos(theta);
  const float c = at.cos * r.cos - at.sin * r.sin;
  const float s = at.sin * r.cos + at.cos * r.sin;
  SearchPoints placed;
  for (std::size_t i = 0; i < count_; i += stride) {
    const Point2f q = memory_.points[i];
    const CellOffset offset{static_cast<std::int16_t>(floor_cell(at.x_cells + c * q.x - s * q.y)),
                            static_cast<std::int16_t>(floor_cell(at.y_cells + s * q.x + c * q.y))};
    const std::int32_t column = at.column + offset.column;
    const std::int32_t row = at.row + offset.row;
    if (grid.grid().unbroken(column, row, reach_cells)) {
      memory_.indices[placed.direct++] = static_cast<std::uint32_t>(grid.grid().index(column, row));
    } else {
      memory_.offsets[placed.checked++] = offset;
    }
  }
  return placed;
}

/// The pose of the window round `centre` that fits scan and prior best.
Pose2 ScanMatcher::correlate(const LiveGrid& grid, const SearchWindow& window, const Pose2& centre, const Pose2& prior,
                             const Sym3& prior_information) const {
  if (count_ == 0 || config_.search_points == 0) {
    return centre;
  }
  const float cell = grid.cell_m();
  const GridPose at = grid_pose(centre, cell);
  const std::size_t stride = search_stride();
  const std::size_t used = (count_ + stride - 1) / stride;
  const auto per_point = static_cast<double>(config_.scan_weight) / static_cast<double>(used * 255);
  const Sym3 stiffness = rotate(prior_information, prior.theta);
  const Pose2 off{centre.x - prior.x, centre.y - prior.y, wrap_angle(centre.theta - prior.theta)};
  const auto step_m = static_cast<double>(window.step) * static_cast<double>(cell);
  const std::uint8_t* const field = grid.field_data();
  double best = -1e300;
  Pose2 best_pose = centre;
  for (std::int32_t turn = -window.turns; turn <= window.turns; ++turn) {
    const auto theta = static_cast<float>(turn) * window.turn_rad;
    const SearchPoints placed = place_points(grid, at, theta, stride, window.step * window.reach);
    for (std::int32_t dy = -window.reach; dy <= window.reach; ++dy) {
      for (std::int32_t dx = -window.reach; dx <= window.reach; ++dx) {
        // The prior's share first: it bounds what this pose can reach.
        const double penalty = 0.5 * quadratic_form(stiffness, {off.x + dx * step_m, off.y + dy * step_m,
                                                                off.theta + static_cast<double>(theta)});
        if (static_cast<double>(config_.scan_weight) - penalty <= best) {
          continue;
        }
        const std::int32_t column = at.column + window.step * dx;
        const std::int32_t row = at.row + window.step * dy;
        std::uint32_t sum = 0;
        const std::ptrdiff_t shift = window.step * (static_cast<std::ptrdiff_t>(dy) * grid.grid().side() + dx);
        for (std::size_t i = 0; i < placed.direct; ++i) {
          sum += field[static_cast<std::ptrdiff_t>(memory_.indices[i]) + shift];
        }
        for (std::size_t i = 0; i < placed.checked; ++i) {
          sum += grid.field(column + memory_.offsets[i].column, row + memory_.offsets[i].row);
        }
        const double score = per_point * static_cast<double>(sum) - penalty;
        if (score > best) {
          best = score;
          best_pose = {centre.x + dx * step_m, centre.y + dy * step_m, centre.theta + static_cast<double>(theta)};
        }
      }
    }
  }
  return best_pose;
}

MatchResult ScanMatcher::search(const LiveGrid& grid, const Pose2& prior, const Sym3& prior_information) const {
  const MatchResult near = refine(grid, prior, prior, prior_information);
  const SearchWindow window{static_cast<std::int32_t>(config_.search_distance_m / grid.cell_m()) / kSearchStep,
                            kSearchStep,
                            static_cast<std::int32_t>(config_.search_angle_rad / config_.search_angle_step_rad),
                            config_.search_angle_step_rad};
  const Pose2 start = correlate(grid, window, prior, prior, prior_information);
  const MatchResult far = refine(grid, start, prior, prior_information);
  const auto value = [&](const MatchResult& m) {
    const Pose2 e = between(prior, m.pose);
    return static_cast<double>(config_.scan_weight * m.score) - 0.5 * quadratic_form(prior_information, e);
  };
  return value(far) > value(near) + (near.good ? static_cast<double>(config_.search_gain) : 0.0) ? far : near;
}

MatchResult ScanMatcher::recover(const LiveGrid& grid, const Pose2& prior, const MatchResult& ordinary) const {
  MatchResult found;
  found.pose = prior;
  if (!(config_.recovery_distance_m > 0.0F) || 4 * count_ < config_.search_points) {
    return found;
  }
  // Half the window counts as one deviation: at its edge the prior costs a sixtieth of what the scan can weigh.
  const auto m = 0.5 * static_cast<double>(config_.recovery_distance_m);
  const auto rad = 0.5 * static_cast<double>(config_.recovery_angle_rad) + 1e-3;
  const Sym3 weak = diagonal(1.0 / (m * m), 1.0 / (m * m), 1.0 / (rad * rad));
  const float turn = config_.recovery_angle_step_rad;
  const SearchWindow wide{static_cast<std::int32_t>(config_.recovery_distance_m / grid.cell_m()) / kRecoveryStep,
                          kRecoveryStep, static_cast<std::int32_t>(config_.recovery_angle_rad / turn), turn};
  const SearchWindow close{kRecoveryStep - 1, 1, kRecoveryFiner, turn / static_cast<float>(kRecoveryFiner)};
  const Pose2 place = correlate(grid, wide, prior, prior, weak);
  found = refine(grid, correlate(grid, close, place, prior, weak), prior, weak);
  found.recovered = true;
  found.good = found.good && found.inlier_share >= config_.recovery_inlier_share &&
               found.score >= ordinary.score + config_.recovery_gain;
  return found;
}

bool ScanMatcher::ends_in_free(const LiveGrid& grid, const Ray& beam) const {
  if (!grid.grid().window().contains(beam.column_to, beam.row_to)) {
    return false;
  }
  const std::size_t end = grid.grid().index(beam.column_to, beam.row_to);
  return grid.grid().cell(end).observations >= kFreeObservations && grid.field_data()[end] == 0;
}

/// The cells at the beam's end are left out: walls are rough there.
bool ScanMatcher::goes_through(const LiveGrid& grid, const Ray& beam) const {
  bool through = false;
  visit_ray(beam, grid.grid().window(), [&](std::int32_t column, std::int32_t row, bool /*hit*/) {
    const std::int32_t dc = column - beam.column_to;
    const std::int32_t dr = row - beam.row_to;
    const std::size_t at = grid.grid().index(column, row);
    // The field first, which is 0 nearly everywhere.
    through = through || (grid.field_data()[at] >= kSolidField && dc * dc + dr * dr > kBeamEnd * kBeamEnd &&
                          solidity(grid.grid().cell(at)) >= kSolid);
  });
  return through;
}

MapAgreement ScanMatcher::compare(const LiveGrid& grid, const Pose2& pose) const {
  MapAgreement out;
  if (count_ == 0 || config_.search_points == 0) {
    return out;
  }
  const GridPose at = grid_pose(pose, grid.cell_m());
  const auto cell_column = [&](const Point2f& q) {
    return at.column + floor_cell(at.x_cells + at.cos * q.x - at.sin * q.y);
  };
  const auto cell_row = [&](const Point2f& q) { return at.row + floor_cell(at.y_cells + at.sin * q.x + at.cos * q.y); };
  const auto agrees = [&](const Point2f& q) {
    return static_cast<float>(grid.field(cell_column(q), cell_row(q))) > kInlierField * 255.0F;
  };
  const std::size_t stride = search_stride();
  for (std::size_t i = 0; i < count_; i += stride) {
    ++out.beams;
    out.agreeing = static_cast<std::uint16_t>(out.agreeing + (agrees(memory_.points[i]) ? 1 : 0));
  }
  if (kSomeBeams * (out.beams - out.agreeing) <= out.beams) {
    return out;
  }
  for (std::size_t i = 0; i < count_; i += stride) {
    const Point2f q = memory_.points[i];
    const Ray beam{cell_column(origin_), cell_row(origin_), cell_column(q), cell_row(q), true};
    if (agrees(q)) {
      continue;
    }
    if (goes_through(grid, beam)) {
      ++out.through;
    } else if (ends_in_free(grid, beam)) {
      ++out.short_of;
    }
  }
  return out;
}

}  // namespace mellin
