#include "mellin/mapping/scan_smoother.hpp"

#include "mapping/surface.hpp"

namespace mellin {
namespace {

constexpr std::uint8_t kOffsets[ScanSmoother::kMostPartners] = {1,  2,  3,  5, 8, 13,
                                                                21, 34, 55, 89};  // from a scan back to its partners
constexpr float kSameSide = 0.8F;      // cosine between normals of one surface, seen from the same side
constexpr float kGap_m = 0.35F;        // between a point and the nearest one on its line: beams meet far walls sparsely
constexpr int kWindow = 3;             // points on either side of the expected one that may be the nearest
constexpr float kHold = 1e8F;          // information that keeps the middle scan where it is
constexpr double kSettled_m = 5e-4;    // a solution that moves no scan further than this …
constexpr double kSettled_rad = 1e-4;  // … nor turns it so far is the last

/// The direction of (x, y) to 0.005 rad, by a cubic for the arc tangent: it only says where to look.
float rough_direction(float x, float y) {
  const float ax = x < 0.0F ? -x : x;
  const float ay = y < 0.0F ? -y : y;
  const float high = ax > ay ? ax : ay;
  if (high == 0.0F) {
    return 0.0F;
  }
  const float t = (ax > ay ? ay : ax) / high;
  const float eighth = t * (0.97239411F - 0.19194795F * t * t);
  const float quarter = ax > ay ? eighth : 1.57079633F - eighth;
  const float half = x < 0.0F ? 3.14159265F - quarter : quarter;
  return y < 0.0F ? -half : half;
}

std::size_t stride(const LaserConfig& laser, std::uint16_t points) {
  return (static_cast<std::size_t>(laser.beams) + points - 1) / points;
}

}  // namespace

/// A scan's place in float: metres from the middle scan.
struct ScanSmoother::Placed {
  float x;
  float y;
  float sin;
  float cos;

  Placed(const Pose2& pose, const Pose2& origin)
      : x(static_cast<float>(pose.x - origin.x)), y(static_cast<float>(pose.y - origin.y)) {
    const SinCos r = sincos(pose.theta);
    sin = static_cast<float>(r.sin);
    cos = static_cast<float>(r.cos);
  }
};

void ScanSmoother::begin(std::uint32_t first_scan, Span<Pose2> poses) {
  first_scan_ = first_scan;
  poses_ = poses;
  next_ = 0;
  iteration_ = 0;
  stage_ = config_.iterations == 0 || poses.size() < 3 ? Stage::idle : Stage::points;
  if (stage_ == Stage::idle) {
    return;
  }
  for (std::size_t i = 1; i < poses.size(); ++i) {
    memory_.steps[i] = between(poses[i - 1], poses[i]);
  }
}

bool ScanSmoother::step(const ScanMemory& scans) {
  switch (stage_) {
    case Stage::idle:
      return false;
    case Stage::points:
      collect(scans, next_);
      if (++next_ == poses_.size()) {
        stage_ = Stage::pairs;
        clear_system();
      }
      return true;
    case Stage::pairs:
      add_step(next_);
      for (std::size_t k = 0; k < config_.partners && kOffsets[k] <= next_; ++k) {
        add_pair(scans, next_, next_ - kOffsets[k]);
        add_pair(scans, next_ - kOffsets[k], next_);
      }
      if (++next_ == poses_.size()) {
        stage_ = Stage::solve;
      }
      return true;
    case Stage::solve:
      ++iteration_;
      if (!factorise() || !move() || iteration_ == config_.iterations) {
        stage_ = Stage::idle;
        return false;
      }
      stage_ = Stage::pairs;
      clear_system();
      return true;
  }
  return false;
}

/// The ends of a scan's beams, those at every stride-th beam with the lines through them.
void ScanSmoother::collect(const ScanMemory& scans, std::size_t scan) {
  const std::uint32_t number = first_scan_ + static_cast<std::uint32_t>(scan);
  const Span<const StoredRange> ranges = scans.ranges(number);
  const Span<const Point2f> directions = scans.directions(number);
  const Pose2& mount = scans.laser(number).base_T_laser;
  const auto mount_x = static_cast<float>(mount.x);
  const auto mount_y = static_cast<float>(mount.y);
  std::size_t count = 0;
  for (std::size_t beam = 0; beam < ranges.size(); ++beam) {
    if (ranges[beam] != 0) {
      const float length = static_cast<float>(ranges[beam]) * kRangeStep_m;
      memory_.ends[count++] = {mount_x + directions[beam].x * length, mount_y + directions[beam].y * length};
    }
  }
  const Span<const Point2f> ends = memory_.ends.first(count);
  const std::size_t every = stride(scans.laser(number), config_.points);
  std::size_t end = 0;
  for (std::size_t beam = 0; beam < ranges.size(); ++beam) {
    LinePoint point;
    if (ranges[beam] != 0 && beam % every == 0) {
      const Point2f normal = surface::normal(ends, end, 1.0F);
      point = {ends[end].x, ends[end].y, normal.x, normal.y};
    }
    end += ranges[beam] != 0 ? 1U : 0U;
    if (beam % every == 0) {
      memory_.points[scan * config_.points + beam / every] = point;
    }
  }
}

void ScanSmoother::clear_system() {
  next_ = 0;
  for (float& value : memory_.hessian) {
    value = 0.0F;
  }
  for (float& value : memory_.gradient) {
    value = 0.0F;
  }
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t middle = 3 * (poses_.size() / 2) + k;
    hessian(middle, middle) = kHold;
  }
}

/// The local mapper's word on the way from the scan before.
void ScanSmoother::add_step(std::size_t scan) {
  if (scan == 0) {
    return;
  }
  const Pose2& before = poses_[scan - 1];
  const Pose2& here = poses_[scan];
  const Pose2& step = memory_.steps[scan];
  const SinCos r = sincos(before.theta);
  const double along_x = r.cos * step.x - r.sin * step.y;
  const double along_y = r.sin * step.x + r.cos * step.y;
  const auto off_x = static_cast<float>(here.x - before.x - along_x);
  const auto off_y = static_cast<float>(here.y - before.y - along_y);
  const auto off_turn = static_cast<float>(wrap_angle(here.theta - before.theta - step.theta));
  const float w = 1.0F / (config_.step_sigma_m * config_.step_sigma_m);
  const float w_turn = 1.0F / (config_.step_sigma_rad * config_.step_sigma_rad);
  // Off = here - before - R(before) step, with the derivative (along_y, -along_x) by the turn of the one before.
  add_row(scan, {1.0F, 0.0F, 0.0F}, scan - 1, {-1.0F, 0.0F, static_cast<float>(along_y)}, off_x, w);
  add_row(scan, {0.0F, 1.0F, 0.0F}, scan - 1, {0.0F, -1.0F, static_cast<float>(-along_x)}, off_y, w);
  add_row(scan, {0.0F, 0.0F, 1.0F}, scan - 1, {0.0F, 0.0F, -1.0F}, off_turn, w_turn);
}

/// One residual with its derivatives by the poses of scans i and j.
void ScanSmoother::add_row(std::size_t i, const Row& by_i, std::size_t j, const Row& by_j, float residual,
                           float weight) {
  const Row& low = i < j ? by_i : by_j;
  const Row& high = i < j ? by_j : by_i;
  const std::size_t l = 3 * (i < j ? i : j);
  const std::size_t h = 3 * (i < j ? j : i);
  for (std::size_t r = 0; r < 3; ++r) {
    const float wl = weight * low.of[r];
    const float wh = weight * high.of[r];
    for (std::size_t c = 0; c <= r; ++c) {
      hessian(l + r, l + c) += wl * low.of[c];
      hessian(h + r, h + c) += wh * high.of[c];
    }
    for (std::size_t c = 0; c < 3; ++c) {
      hessian(h + r, l + c) += wh * low.of[c];
    }
    memory_.gradient[l + r] -= wl * residual;
    memory_.gradient[h + r] -= wh * residual;
  }
}

/// The point of a scan nearest to a place seen from its base that has a line; null where none is in reach.
const ScanSmoother::LinePoint* ScanSmoother::nearest(const ScanMemory& scans, std::size_t scan, float x,
                                                     float y) const {
  const LaserConfig& laser = scans.laser(first_scan_ + static_cast<std::uint32_t>(scan));
  const std::size_t every = stride(laser, config_.points);
  const auto slots = static_cast<int>((laser.beams + every - 1) / every);
  constexpr float kTurn = 6.28318531F;
  float bearing =
      rough_direction(x - static_cast<float>(laser.base_T_laser.x), y - static_cast<float>(laser.base_T_laser.y)) -
      static_cast<float>(laser.base_T_laser.theta) - laser.angle_min_rad;
  const float step = laser.angle_increment_rad * static_cast<float>(every);
  bearing -= bearing >= kTurn ? kTurn : 0.0F;
  bearing += bearing < -0.5F * kTurn ? kTurn : 0.0F;
  const int expected = static_cast<int>(bearing / step + 0.5F);
  const LinePoint* best = nullptr;
  float best_squared = kGap_m * kGap_m;
  const Span<const LinePoint> points = memory_.points.subspan(scan * config_.points, static_cast<std::size_t>(slots));
  for (int slot = expected - kWindow; slot <= expected + kWindow; ++slot) {
    if (slot < 0 || slot >= slots) {
      continue;
    }
    const LinePoint& point = points[static_cast<std::size_t>(slot)];
    const float dx = point.x - x;
    const float dy = point.y - y;
    const float distance = dx * dx + dy * dy;
    if (distance < best_squared && (point.normal_x != 0.0F || point.normal_y != 0.0F)) {
      best_squared = distance;
      best = &point;
    }
  }
  return best;
}

/// The points of scan i against the lines of scan j.
void ScanSmoother::add_pair(const ScanMemory& scans, std::size_t i, std::size_t j) {
  const Pose2& origin = poses_[poses_.size() / 2];
  const Placed a(poses_[i], origin);
  const Placed b(poses_[j], origin);
  const float worth = config_.independent_share / (config_.point_sigma_m * config_.point_sigma_m);
  const float reach = config_.reach_m * config_.reach_m;
  const std::size_t every = stride(scans.laser(first_scan_ + static_cast<std::uint32_t>(i)), config_.points);
  const std::size_t slots = (scans.laser(first_scan_ + static_cast<std::uint32_t>(i)).beams + every - 1) / every;
  for (const LinePoint& p : memory_.points.subspan(i * config_.points, slots)) {
    if (p.normal_x == 0.0F && p.normal_y == 0.0F) {
      continue;
    }
    const float rx = a.cos * p.x - a.sin * p.y;
    const float ry = a.sin * p.x + a.cos * p.y;
    const float sx = a.x + rx - b.x;  // from scan j's base, along the common axes
    const float sy = a.y + ry - b.y;
    const LinePoint* const q = nearest(scans, j, b.cos * sx + b.sin * sy, b.cos * sy - b.sin * sx);
    if (q == nullptr) {
      continue;
    }
    const float nx = b.cos * q->normal_x - b.sin * q->normal_y;
    const float ny = b.sin * q->normal_x + b.cos * q->normal_y;
    const float own_x = a.cos * p.normal_x - a.sin * p.normal_y;
    const float own_y = a.sin * p.normal_x + a.cos * p.normal_y;
    if (nx * own_x + ny * own_y < kSameSide) {
      continue;
    }
    const float line_x = b.cos * q->x - b.sin * q->y;
    const float line_y = b.sin * q->x + b.cos * q->y;
    const float residual = nx * (sx - line_x) + ny * (sy - line_y);
    if (residual * residual >= reach) {
      continue;
    }
    // Tukey's weight: what lies at the end of the reach may belong elsewhere.
    const float trust = 1.0F - residual * residual / reach;
    add_row(i, {nx, ny, ny * rx - nx * ry}, j, {-nx, -ny, nx * sy - ny * sx}, residual, worth * trust * trust);
  }
}

/// Cholesky factorisation in place. Returns false where the matrix is not positive definite.
bool ScanSmoother::factorise() {
  const std::size_t n = 3 * poses_.size();
  for (std::size_t row = 0; row < n; ++row) {
    float* const of_row = &hessian(row, 0);
    for (std::size_t column = 0; column <= row; ++column) {
      const float* const of_column = &hessian(column, 0);
      float sum = of_row[column];
      for (std::size_t k = 0; k < column; ++k) {
        sum -= of_row[k] * of_column[k];
      }
      if (column < row) {
        of_row[column] = sum / of_column[column];
      } else if (sum > 0.0F) {
        of_row[row] = sqrt(sum);
      } else {
        return false;
      }
    }
  }
  return true;
}

/// Solves and applies. Returns whether another iteration would change anything.
bool ScanSmoother::move() {
  const std::size_t n = 3 * poses_.size();
  const Span<float> v = memory_.gradient;
  for (std::size_t row = 0; row < n; ++row) {
    float sum = v[row];
    for (std::size_t k = 0; k < row; ++k) {
      sum -= hessian(row, k) * v[k];
    }
    v[row] = sum / hessian(row, row);
  }
  for (std::size_t row = n; row-- > 0;) {
    v[row] /= hessian(row, row);
    for (std::size_t k = 0; k < row; ++k) {
      v[k] -= hessian(row, k) * v[row];
    }
  }
  bool moved = false;
  for (std::size_t i = 0; i < poses_.size(); ++i) {
    const Pose2 by{static_cast<double>(v[3 * i]), static_cast<double>(v[3 * i + 1]), static_cast<double>(v[3 * i + 2])};
    poses_[i] = {poses_[i].x + by.x, poses_[i].y + by.y, wrap_angle(poses_[i].theta + by.theta)};
    moved |= by.x * by.x + by.y * by.y > kSettled_m * kSettled_m || by.theta * by.theta > kSettled_rad * kSettled_rad;
  }
  return moved;
}

}  // namespace mellin
