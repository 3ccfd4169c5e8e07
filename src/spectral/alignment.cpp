#include "mellin/spectral/alignment.hpp"

#include <algorithm>
#include <cmath>

#include "spectral/obstacles.hpp"

namespace mellin {
namespace {

constexpr float kStageShrink = 0.9F;      // each iteration narrows the reach by this, down to final_m
constexpr float kSecondWayReach = 2.0F;   // reach at the start of the second way, in final_m
constexpr double kDamping = 1e-3;         // least share of the mean stiffness added to each axis
constexpr double kDampingStep = 8.0;      // it grows by this where a step makes things worse, and shrinks again
constexpr double kConvergedXy = 1e-3;     // m
constexpr double kConvergedTheta = 2e-4;  // rad
constexpr std::uint32_t kFewestInliers = 30;
constexpr float kNormalWindow_m = 0.3F;       // half side of the window that a wall's direction is taken from …
constexpr float kFewestCellsInWindow = 2.0F;  // … and in cells: 3 x 3 hold three of a thin wall, too few
constexpr float kMostCellsInWindow = 16.0F;
constexpr float kStraightness = 0.1F;  // largest ratio of the scatter across to the scatter along a wall
constexpr float kFewestInWindow = 4.0F;

bool valid(const AlignmentConfig& c) {
  const float positive[] = {c.capture_m, c.final_m, c.point_sigma_m, c.correlation_m, c.floor_xy_m, c.floor_theta_rad};
  for (const float value : positive) {
    if (!(value > 0.0F) || !std::isfinite(value)) {
      return false;
    }
  }
  return c.max_side > 0 && c.max_points > 0 && c.rows_per_step > 0 && c.max_iterations > 0 && c.occupied_from > 0 &&
         c.final_m <= c.capture_m;
}

bool fits(const Alignment::SideMemory& memory, const AlignmentConfig& config) {
  return memory.field.size() == static_cast<std::size_t>(config.max_side) * config.max_side &&
         memory.points.size() == config.max_points;
}

bool valid(const GridView& grid, std::uint16_t max_side) {
  return grid.side >= 2 && grid.side % 2 == 0 && grid.side <= max_side &&
         grid.cells.size() == static_cast<std::size_t>(grid.side) * grid.side && grid.cell_m > 0.0F &&
         std::isfinite(grid.cell_m);
}

/// Unit normal of the wall through (column, row): the minor axis of the obstacles in the window round it; (0, 0) where
/// they do not lie along a line.
Point2f wall_normal(const GridView& grid, int column, int row, int reach, std::uint8_t from) {
  float n = 0.0F;
  float sx = 0.0F;
  float sy = 0.0F;
  float sxx = 0.0F;
  float sxy = 0.0F;
  float syy = 0.0F;
  for (int r = std::max(0, row - reach); r <= std::min(grid.side - 1, row + reach); ++r) {
    const std::uint8_t* const cells = grid.cells.data() + static_cast<std::ptrdiff_t>(r) * grid.side;
    for (int c = std::max(0, column - reach); c <= std::min(grid.side - 1, column + reach); ++c) {
      if (is_obstacle(cells[c], from)) {
        const auto dx = static_cast<float>(c - column);
        const auto dy = static_cast<float>(r - row);
        n += 1.0F;
        sx += dx;
        sy += dy;
        sxx += dx * dx;
        sxy += dx * dy;
        syy += dy * dy;
      }
    }
  }
  if (n < kFewestInWindow) {
    return {};
  }
  const float xx = sxx - sx * sx / n;
  const float xy = sxy - sx * sy / n;
  const float yy = syy - sy * sy / n;
  const float half_trace = 0.5F * (xx + yy);
  const float half_difference = 0.5F * (xx - yy);
  const float spread = std::sqrt(half_difference * half_difference + xy * xy);
  if (half_trace - spread > kStraightness * (half_trace + spread)) {
    return {};
  }
  // The minor axis is orthogonal to the major one, (spread + half_difference, xy) or (xy, spread - half_difference);
  // the longer of the two is the better conditioned.
  Point2f normal =
      half_difference >= 0.0F ? Point2f{-xy, spread + half_difference} : Point2f{spread - half_difference, -xy};
  const float length = std::sqrt(normal.x * normal.x + normal.y * normal.y);
  if (!(length > 0.0F)) {
    return {};
  }
  return {normal.x / length, normal.y / length};
}

/// Adds the residual of a point across its normal to a stiffness over (x, y, theta).
void add_witness(Sym3& sum, const AlignmentPoint& p, double weight) {
  const float nx = p.normal_x;
  const float ny = p.normal_y;
  const float lever = p.x * ny - p.y * nx;
  sum.xx += weight * static_cast<double>(nx * nx);
  sum.xy += weight * static_cast<double>(nx * ny);
  sum.xt += weight * static_cast<double>(nx * lever);
  sum.yy += weight * static_cast<double>(ny * ny);
  sum.yt += weight * static_cast<double>(ny * lever);
  sum.tt += weight * static_cast<double>(lever * lever);
}

Pose2 multiply(const Sym3& m, const Pose2& v) {
  return {m.xx * v.x + m.xy * v.y + m.xt * v.theta, m.xy * v.x + m.yy * v.y + m.yt * v.theta,
          m.xt * v.x + m.yt * v.y + m.tt * v.theta};
}

double hypotenuse(double a, double b) { return std::sqrt(a * a + b * b); }

/// Information of a measurement with information `m` and an independent error of covariance diag(xx, xx, tt) on top:
/// (m^-1 + S)^-1 = m - m (m + S^-1)^-1 m, which a singular m does not disturb.
Sym3 with_floor(const Sym3& m, double deviation_xy, double deviation_theta) {
  const double wxy = 1.0 / (deviation_xy * deviation_xy);
  Sym3 inner;
  if (!invert(m + diagonal(wxy, wxy, 1.0 / (deviation_theta * deviation_theta)), inner)) {
    return {};
  }
  const Pose2 c0 = multiply(inner, {m.xx, m.xy, m.xt});
  const Pose2 c1 = multiply(inner, {m.xy, m.yy, m.yt});
  const Pose2 c2 = multiply(inner, {m.xt, m.yt, m.tt});
  const Pose2 r0 = multiply(m, c0);
  const Pose2 r1 = multiply(m, c1);
  const Pose2 r2 = multiply(m, c2);
  return {m.xx - r0.x, m.xy - r1.x, m.xt - r2.x, m.yy - r1.y, m.yt - r2.y, m.tt - r2.theta};
}

/// `m` less as much of `part` as leaves it positive definite, in eighths.
Sym3 less(const Sym3& m, const Sym3& part) {
  Sym3 inverse;
  for (int eighths = 8; eighths > 0; --eighths) {
    const Sym3 rest = m + scale(part, -0.125 * eighths);
    if (invert(rest, inverse)) {
      return rest;
    }
  }
  return m;
}

}  // namespace

Status Alignment::init(const AlignmentConfig& config, const Memory& memory) {
  if (!valid(config)) {
    return Status::invalid_config;
  }
  if (!fits(memory.a, config) || !fits(memory.b, config) || memory.field.below.size() != config.max_side ||
      memory.field.runs.size() != config.max_side) {
    return Status::insufficient_memory;
  }
  config_ = config;
  a_ = {};
  b_ = {};
  a_.memory = memory.a;
  b_.memory = memory.b;
  field_memory_ = memory.field;
  stage_ = Stage::idle;
  return Status::ok;
}

Status Alignment::set_side(Side& side, const GridView& grid) {
  for (Side* const each : {&a_, &b_}) {
    if (each == &side || !config_.keep_both) {
      each->has_field = false;
      each->has_points = false;
    }
  }
  side.grid = {};
  stage_ = Stage::idle;
  if (side.memory.field.empty() || !valid(grid, config_.max_side)) {
    return Status::invalid_argument;
  }
  side.grid = grid;
  return Status::ok;
}

Status Alignment::begin(const GridView& a, const GridView& b, const Pose2& a_T_b) {
  const Status first = set_a(a);
  const Status second = set_b(b);
  return first != Status::ok ? first : (second != Status::ok ? second : begin(a_T_b));
}

Status Alignment::begin(const Pose2& a_T_b) {
  if (a_.grid.side == 0 || b_.grid.side == 0 || !is_finite(a_T_b)) {
    return Status::invalid_argument;
  }
  result_ = {};
  result_.converged = true;
  evidence_ = {};
  backward_ = false;
  start_way(a_, b_, a_T_b, config_.capture_m);
  return Status::ok;
}

void Alignment::start_way(Side& onto, Side& from, const Pose2& onto_T_from, float reach_m) {
  onto_ = &onto;
  from_ = &from;
  onto_T_from_ = onto_T_from;
  trial_ = onto_T_from;
  reach_m_ = reach_m;
  iterations_ = 0;
  damping_ = kDamping;
  settled_ = false;
  next_stage();
}

/// What this way lacks first: the field, the points, or nothing any more.
void Alignment::next_stage() {
  if (!onto_->has_field) {
    begin_field();
  } else if (!from_->has_points) {
    begin_points();
  } else {
    stage_ = Stage::iterate;
  }
}

void Alignment::begin_field() {
  const GridView& grid = onto_->grid;
  if (!config_.keep_both) {
    from_->has_field = false;  // it gives way
  }
  field_.begin(grid, config_.capture_m, config_.occupied_from,
               onto_->memory.field.first(static_cast<std::size_t>(grid.side) * grid.side), field_memory_);
  stage_ = Stage::field;
}

void Alignment::begin_points() {
  if (!config_.keep_both) {
    onto_->has_points = false;  // they give way
  }
  from_->obstacles = 0;
  from_->point_count = 0;
  seen_ = 0;
  row_ = 0;
  stage_ = Stage::count;
}

bool Alignment::step() {
  switch (stage_) {
    case Stage::field:
      if (field_.step(config_.rows_per_step)) {
        onto_->has_field = true;
        next_stage();
      }
      break;
    case Stage::count:
      count_obstacles();
      break;
    case Stage::points:
      collect_points();
      break;
    case Stage::iterate:
      iterate();
      break;
    case Stage::idle:
    case Stage::done:
      break;
  }
  return stage_ != Stage::idle && stage_ != Stage::done;
}

int Alignment::slice_end() const { return std::min<int>(from_->grid.side, row_ + config_.rows_per_step); }

void Alignment::count_obstacles() {
  const std::size_t side = from_->grid.side;
  const int end = slice_end();
  const std::uint8_t* const cells = from_->grid.cells.data();
  std::uint32_t obstacles = 0;
  for (std::size_t i = static_cast<std::size_t>(row_) * side; i < static_cast<std::size_t>(end) * side; ++i) {
    obstacles += is_obstacle(cells[i], config_.occupied_from) ? 1U : 0U;
  }
  from_->obstacles += obstacles;
  row_ = end;
  if (row_ == from_->grid.side) {
    row_ = 0;
    stage_ = Stage::points;
  }
}

void Alignment::collect_points() {
  const GridView& grid = from_->grid;
  const int end = slice_end();
  const std::uint32_t wanted = std::min<std::uint32_t>(from_->obstacles, config_.max_points);
  const int reach =
      static_cast<int>(std::clamp(kNormalWindow_m / grid.cell_m, kFewestCellsInWindow, kMostCellsInWindow));
  const float half = 0.5F * static_cast<float>(grid.side);
  for (int row = row_; row < end; ++row) {
    const std::uint8_t* const cells = grid.cells.data() + static_cast<std::ptrdiff_t>(row) * grid.side;
    for (int column = 0; column < grid.side; ++column) {
      if (!is_obstacle(cells[column], config_.occupied_from)) {
        continue;
      }
      // Obstacle k is taken where k * wanted / obstacles steps up: evenly, and exactly `wanted` of them.
      const std::uint64_t due = (static_cast<std::uint64_t>(seen_) + 1) * wanted / from_->obstacles;
      ++seen_;
      if (due == from_->point_count) {
        continue;
      }
      const Point2f at = centre_of_hits(grid, column, row);
      const Point2f normal = wall_normal(grid, column, row, reach, config_.occupied_from);
      from_->memory.points[from_->point_count++] = {(at.x - half) * grid.cell_m, (at.y - half) * grid.cell_m, normal.x,
                                                    normal.y};
    }
  }
  row_ = end;
  if (row_ == grid.side) {
    from_->has_points = true;
    next_stage();
  }
}

/// Distance field and its gradient at a point of a, bilinear between the centres of four cells.
Alignment::Sample Alignment::sample(float x_m, float y_m) const {
  const GridView& onto = onto_->grid;
  const std::uint8_t* const field = onto_->memory.field.data();
  const float half = 0.5F * static_cast<float>(onto.side) - 0.5F;
  const float x = x_m / onto.cell_m + half;
  const float y = y_m / onto.cell_m + half;
  const auto limit = static_cast<float>(onto.side - 1);
  if (!(x >= 0.0F && y >= 0.0F && x < limit && y < limit)) {
    return {};
  }
  const auto column = static_cast<std::size_t>(x);
  const auto row = static_cast<std::size_t>(y);
  const std::size_t at = row * onto.side + column;
  const std::uint8_t v00 = field[at];
  const std::uint8_t v10 = field[at + 1];
  const std::uint8_t v01 = field[at + onto.side];
  const std::uint8_t v11 = field[at + onto.side + 1];
  Sample sample;
  sample.observed = onto.cells[at] != kUnobserved;
  if (v00 == kFieldBeyond || v10 == kFieldBeyond || v01 == kFieldBeyond || v11 == kFieldBeyond) {
    return sample;
  }
  const float fx = x - static_cast<float>(column);
  const float fy = y - static_cast<float>(row);
  const float low = static_cast<float>(v00) + fx * static_cast<float>(v10 - v00);
  const float high = static_cast<float>(v01) + fx * static_cast<float>(v11 - v01);
  const float metres = config_.capture_m / kFieldUnitsAtReach;
  sample.near = true;
  sample.distance_m = (low + fy * (high - low)) * metres;
  sample.gradient_x =
      (static_cast<float>(v10 - v00) * (1.0F - fy) + static_cast<float>(v11 - v01) * fy) * metres / onto.cell_m;
  sample.gradient_y = (high - low) * metres / onto.cell_m;
  return sample;
}

/// Robust cost at the trial pose with its Gauss-Newton system: Tukey's biweight, in iteratively reweighted form.
Alignment::System Alignment::linearise(const Pose2& onto_T_from) const {
  const SinCos turn = sincos(onto_T_from.theta);
  const auto c = static_cast<float>(turn.cos);
  const auto s = static_cast<float>(turn.sin);
  const auto tx = static_cast<float>(onto_T_from.x);
  const auto ty = static_cast<float>(onto_T_from.y);
  const float reach2 = reach_m_ * reach_m_;
  System system;
  for (std::size_t i = 0; i < from_->point_count; ++i) {
    const AlignmentPoint& p = from_->memory.points[i];
    const Sample at = sample(c * p.x - s * p.y + tx, s * p.x + c * p.y + ty);
    const float d2 = at.distance_m * at.distance_m;
    if (!at.near || d2 >= reach2) {
      system.cost += 1.0;
      continue;
    }
    const float gx = c * at.gradient_x + s * at.gradient_y;
    const float gy = -s * at.gradient_x + c * at.gradient_y;
    const float inside = 1.0F - d2 / reach2;
    const float tukey = inside * inside;
    system.cost += static_cast<double>(1.0F - tukey * inside);
    add_witness(system.stiffness, {p.x, p.y, gx, gy}, static_cast<double>(tukey));
    const float force = tukey * at.distance_m;
    system.pull.x -= static_cast<double>(force * gx);
    system.pull.y -= static_cast<double>(force * gy);
    system.pull.theta -= static_cast<double>(force * (p.x * gy - p.y * gx));
  }
  return system;
}

/// One step of Levenberg and Marquardt from the best pose so far. Costs compare within the last stage only, whose reach
/// stays.
void Alignment::iterate() {
  const bool last_stage = reach_m_ <= config_.final_m;
  const System trial = linearise(trial_);
  ++iterations_;
  if (settled_ && trial.cost > best_.cost) {
    damping_ *= kDampingStep;
  } else {
    best_ = trial;
    onto_T_from_ = trial_;
    damping_ = std::max(kDamping, damping_ / kDampingStep);
    settled_ = last_stage;
  }
  const double xy = damping_ * 0.5 * (best_.stiffness.xx + best_.stiffness.yy);
  Sym3 inner;
  if (!invert(best_.stiffness + diagonal(xy, xy, damping_ * best_.stiffness.tt), inner)) {
    finish_way(false);
    return;
  }
  const Pose2 move = multiply(inner, best_.pull);
  trial_ = compose(onto_T_from_, move);
  const bool converged = last_stage && translation(move) < kConvergedXy && std::fabs(move.theta) < kConvergedTheta;
  if (converged || iterations_ >= config_.max_iterations) {
    finish_way(converged);
    return;
  }
  reach_m_ = std::max(config_.final_m, reach_m_ * kStageShrink);
}

/// Adds the evidence of the way that has ended, and starts the other one or ends the job.
void Alignment::finish_way(bool converged) {
  result_.converged = result_.converged && converged;
  result_.iterations = static_cast<std::uint16_t>(result_.iterations + iterations_);
  result_.points = static_cast<std::uint16_t>(result_.points + from_->point_count);
  add_evidence();
  if (!backward_) {
    result_.a_T_b = onto_T_from_;
    if (config_.both_ways) {
      backward_ = true;
      start_way(*from_, *onto_, inverse(onto_T_from_), std::min(config_.capture_m, kSecondWayReach * config_.final_m));
      return;
    }
  } else {
    const Pose2 apart = between(result_.a_T_b, inverse(onto_T_from_));
    result_.disagreement_m = static_cast<float>(translation(apart));
    result_.disagreement_rad = static_cast<float>(std::fabs(apart.theta));
    result_.a_T_b = compose(result_.a_T_b, {0.5 * apart.x, 0.5 * apart.y, 0.5 * apart.theta});
  }
  summarise();
}

/// Counts the inliers at the pose that this way has found; each wall point among them is a witness of b's pose across
/// the wall.
void Alignment::add_evidence() {
  const SinCos turn = sincos(onto_T_from_.theta);
  const auto c = static_cast<float>(turn.cos);
  const auto s = static_cast<float>(turn.sin);
  const auto tx = static_cast<float>(onto_T_from_.x);
  const auto ty = static_cast<float>(onto_T_from_.y);
  // All points within correlation_m of wall are one witness, and both ways see the same walls.
  const double cells_a_point =
      from_->point_count > 0 ? static_cast<double>(from_->obstacles) / static_cast<double>(from_->point_count) : 1.0;
  const double metres_a_point = cells_a_point * static_cast<double>(from_->grid.cell_m);
  const double sigma = static_cast<double>(config_.point_sigma_m);
  const double weight = std::min(1.0, metres_a_point / static_cast<double>(config_.correlation_m)) / (sigma * sigma) *
                        (config_.both_ways ? 0.5 : 1.0);
  for (std::size_t i = 0; i < from_->point_count; ++i) {
    AlignmentPoint p = from_->memory.points[i];
    const AlignmentPoint there{c * p.x - s * p.y + tx, s * p.x + c * p.y + ty, c * p.normal_x - s * p.normal_y,
                               s * p.normal_x + c * p.normal_y};
    const Sample at = sample(there.x, there.y);
    const bool inlier = at.near && at.distance_m < config_.final_m;
    evidence_.shared += at.observed || inlier ? 1U : 0U;
    if (inlier) {
      ++evidence_.inliers;
      evidence_.squares += static_cast<double>(at.distance_m * at.distance_m);
      // Witnesses speak in b's frame: it is the points' own on the first way, that of the field on the second.
      const AlignmentPoint& w = backward_ ? there : p;
      add_witness(evidence_.across, w, weight);
      add_witness(evidence_.along, {w.x, w.y, -w.normal_y, w.normal_x}, weight);
    }
  }
}

void Alignment::summarise() {
  const Evidence& e = evidence_;
  result_.inlier_share = e.shared > 0 ? static_cast<float>(e.inliers) / static_cast<float>(e.shared) : 0.0F;
  result_.rms_m = e.inliers > 0 ? static_cast<float>(std::sqrt(e.squares / e.inliers)) : 0.0F;
  const double xy =
      hypotenuse(static_cast<double>(config_.floor_xy_m), 0.5 * static_cast<double>(result_.disagreement_m));
  const double theta =
      hypotenuse(static_cast<double>(config_.floor_theta_rad), 0.5 * static_cast<double>(result_.disagreement_rad));
  // The fewer points find an obstacle, the more of those that do have found it by chance.
  const double trust = static_cast<double>(result_.inlier_share) * static_cast<double>(result_.inlier_share);
  const double slant = static_cast<double>(config_.normal_sigma_rad) * static_cast<double>(config_.normal_sigma_rad);
  result_.information = with_floor(scale(less(e.across, scale(e.along, slant)), trust), xy, theta);
  stage_ = Stage::done;
}

Result<AlignmentResult> Alignment::result() const {
  if (stage_ != Stage::done) {
    return Status::busy;
  }
  if (evidence_.inliers < kFewestInliers) {
    return Status::degenerate;
  }
  return result_;
}

}  // namespace mellin
