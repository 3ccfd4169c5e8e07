#include "mellin/mapping/submap_builder.hpp"

namespace mellin {

void SubmapBuilder::reset() {
  stage_ = Stage::idle;
  ended_ = EndedStretch{};
  count_from_here();
}

void SubmapBuilder::count_from_here() {
  any_frozen_ = false;
  taken_ = 0;
  new_scans_ = 0;
  path_m_ = 0.0;
  new_path_m_ = 0.0;
  new_drift_ = Sym3{};
}

bool SubmapBuilder::stretch_ended(const LocalMapper& mapper) {
  const bool worth_it = any_frozen_ || taken_ >= config_.min_scans;
  const bool kept = !ended_.waits && (worth_it || new_scans_ == 0);
  const std::uint32_t end = mapper.stretch_begin();
  const std::uint32_t first = end - (taken_ < end ? taken_ : end);
  const auto stretch = static_cast<std::uint16_t>(mapper.stretch() - 1);
  ended_ = {worth_it && new_scans_ > 0, {first, end, middle_, any_frozen_, stretch}};
  count_from_here();
  return kept;
}

SubmapBuilder::Range SubmapBuilder::open_range(const LocalMapper& mapper) const {
  return {mapper.first_remembered(), mapper.scans().end(), middle_, any_frozen_, mapper.stretch()};
}

/// Its scans leave the memory one by one: only those count that stay as long as the live map's own.
SubmapBuilder::Range SubmapBuilder::ended_range(const LocalMapper& mapper) const {
  Range range = ended_.range;
  const std::uint32_t end = mapper.scans().end();
  const std::uint32_t staying = end > config_.max_scans ? end - config_.max_scans : 0;
  range.first = range.first > staying ? range.first : staying;
  return range;
}

bool SubmapBuilder::scan_taken(const LocalMapper& mapper) {
  const std::uint32_t newest = mapper.scans().end() - 1;
  const Pose2 pose = mapper.scan_pose(newest);
  const double step = taken_ == 0 ? 0.0 : translation(between(last_pose_, pose));
  last_pose_ = pose;
  ++taken_;
  ++new_scans_;
  path_m_ += step;
  new_path_m_ += step;
  new_drift_ = new_drift_ + mapper.scan_drift(newest);
  const bool uncertain = new_scans_ >= config_.min_scans && too_uncertain(scale(new_drift_, new_scans_));
  if (!any_frozen_) {
    return uncertain || taken_ >= config_.max_scans || path_m_ >= static_cast<double>(config_.max_path_m);
  }
  return uncertain || new_scans_ >= config_.every_scans || new_path_m_ >= static_cast<double>(config_.every_path_m);
}

bool SubmapBuilder::too_uncertain(const Sym3& drift) const {
  const double share = static_cast<double>(config_.drift_share) * static_cast<double>(config_.drift_share);
  const double m = static_cast<double>(config_.max_drift_m);
  const double rad = static_cast<double>(config_.max_drift_rad);
  return share * drift.xx > m * m || share * drift.yy > m * m || share * drift.tt > rad * rad;
}

std::uint32_t SubmapBuilder::scans_in_reach(const LocalMapper& mapper, const Range& range) const {
  const std::uint32_t end = range.end;
  std::uint32_t count = 1;
  double path = 0.0;
  Sym3 drift;
  while (count < config_.max_scans && end - count > range.first) {
    const std::uint32_t next = end - count;
    path += translation(between(mapper.scan_pose(next - 1), mapper.scan_pose(next)));
    drift = drift + mapper.scan_drift(next);
    if (path > static_cast<double>(config_.max_path_m) ||
        (count >= config_.min_scans && too_uncertain(scale(drift, count)))) {
      break;
    }
    ++count;
  }
  return count;
}

Status SubmapBuilder::begin(const LocalMapper& mapper, Span<std::uint8_t> cells) {
  if (active()) {
    return Status::busy;
  }
  const bool ended = ended_.waits;
  ended_.waits = false;
  const Range range = ended ? ended_range(mapper) : open_range(mapper);
  const std::uint32_t end = range.end;
  if (end <= range.first) {
    return ended ? Status::not_found : Status::degenerate;
  }
  first_before_ = first_scan_;
  count_before_ = range.any_frozen ? scan_count_ : 0;
  swap_poses();
  scan_count_ = scans_in_reach(mapper, range);
  first_scan_ = end - scan_count_;
  Pose2 low = mapper.scan_pose(first_scan_);
  Pose2 high = low;
  for (std::uint32_t i = 1; i < scan_count_; ++i) {
    const Pose2 pose = mapper.scan_pose(first_scan_ + i);
    low = {pose.x < low.x ? pose.x : low.x, pose.y < low.y ? pose.y : low.y, 0.0};
    high = {pose.x > high.x ? pose.x : high.x, pose.y > high.y ? pose.y : high.y, 0.0};
  }
  const Pose2 centre{0.5 * (low.x + high.x), 0.5 * (low.y + high.y), 0.0};
  for (std::uint32_t i = 0; i < scan_count_; ++i) {
    memory_.poses[i] = between(centre, mapper.scan_pose(first_scan_ + i));
  }
  session_T_newest_ = mapper.scan_pose(end - 1);
  const std::uint32_t middle = first_scan_ + scan_count_ / 2;
  from_before_ = SubmapStep{};
  from_before_.drift =
      range.any_frozen ? drift_since(mapper, centre, range.middle < range.first ? range.first : range.middle, middle)
                       : Sym3{};
  rendered_stretch_ = range.stretch;
  header_ = SubmapHeader{};
  header_.stamp_us = mapper.scans().stamp_us(end - 1);
  header_.first_scan = first_scan_;
  header_.scan_count = scan_count_;
  cells_ = cells;
  next_row_ = 0;
  smoother_.begin(first_scan_, memory_.poses.first(scan_count_));
  stage_ = Stage::smooth;
  if (ended) {
    return Status::ok;
  }
  middle_ = middle;
  any_frozen_ = true;
  new_scans_ = 0;
  new_path_m_ = 0.0;
  new_drift_ = Sym3{};
  return Status::ok;
}

void SubmapBuilder::swap_poses() {
  const Span<Pose2> poses = memory_.poses;
  memory_.poses = memory_.poses_before;
  memory_.poses_before = poses;
}

/// The submap's place, when its scans have theirs: where the newest of them is stays as the local mapper has it.
void SubmapBuilder::place() {
  header_.submap_T_robot = memory_.poses[scan_count_ - 1];
  header_.session_T_submap = compose(session_T_newest_, inverse(header_.submap_T_robot));
  from_before_.before_first_scan = first_before_;
  const std::uint32_t from = first_before_ > first_scan_ ? first_before_ : first_scan_;
  const std::uint32_t end_before = first_before_ + count_before_;
  const std::uint32_t end_here = first_scan_ + scan_count_;
  const std::uint32_t end = end_before < end_here ? end_before : end_here;
  if (count_before_ > 0 && end > from) {
    from_before_.shared_scans = end - from;
    from_before_.before_T_submap = measured_step(memory_.poses_before.subspan(from - first_before_, end - from),
                                                 memory_.poses.subspan(from - first_scan_, end - from));
  }
}

/// The motion that lays scans, as this submap has them, on where the one before has them: the mean of the turns, and of
/// the shifts that are left.
Pose2 SubmapBuilder::measured_step(Span<const Pose2> before, Span<const Pose2> here) {
  const auto count = static_cast<double>(here.size());
  const double first_turn = before[0].theta - here[0].theta;
  double turn = 0.0;
  for (std::size_t i = 0; i < here.size(); ++i) {
    turn += wrap_angle(before[i].theta - here[i].theta - first_turn);
  }
  Pose2 step{0.0, 0.0, wrap_angle(first_turn + turn / count)};
  double x = 0.0;
  double y = 0.0;
  for (std::size_t i = 0; i < here.size(); ++i) {
    const Pose2 turned = compose(step, here[i]);
    x += before[i].x - turned.x;
    y += before[i].y - turned.y;
  }
  step.x = x / count;
  step.y = y / count;
  return step;
}

Sym3 SubmapBuilder::drift_since(const LocalMapper& mapper, const Pose2& session_T_submap, std::uint32_t from,
                                std::uint32_t to) const {
  Sym3 sum;
  std::uint32_t count = 0;
  for (std::uint32_t number = from + 1; number <= to; ++number) {
    const Pose2 submap_T_robot = between(session_T_submap, mapper.scan_pose(number));
    sum = sum + carried(mapper.scan_drift(number), submap_T_robot);
    ++count;
  }
  const double share = static_cast<double>(config_.drift_share);
  return scale(sum, share * share * count);
}

Result<bool> SubmapBuilder::step(const ScanMemory& scans) {
  if (!active()) {
    return true;
  }
  if (!scans.holds(first_scan_)) {
    stage_ = Stage::idle;
    return Status::not_found;
  }
  if (stage_ == Stage::smooth && !smoother_.step(scans)) {
    place();
    stage_ = Stage::render;
  }
  if (stage_ == Stage::render) {
    render_band(scans);
    stage_ = next_row_ < config_.side ? Stage::render : Stage::idle;
  }
  return !active();
}

void SubmapBuilder::render_band(const ScanMemory& scans) {
  const std::int32_t half = config_.side / 2;
  const auto rows = static_cast<std::int32_t>(config_.side - next_row_ < config_.band_rows ? config_.side - next_row_
                                                                                           : config_.band_rows);
  for (CellCount& cell : memory_.band) {
    cell = CellCount{};
  }
  // World cells of this band: the submap's origin is the corner of cell (0, 0).
  const CellRect rect{-half, next_row_ - half, half, next_row_ - half + rows};
  for (std::uint32_t i = 0; i < scan_count_; ++i) {
    scans.visit_rays(first_scan_ + i, grid_pose(memory_.poses[i], config_.cell_m), config_.cell_m, [&](const Ray& ray) {
      visit_ray(ray, rect, [&](std::int32_t column, std::int32_t row, bool hit) {
        CellCount& cell = memory_.band[static_cast<std::size_t>(row - rect.row_min) * config_.side +
                                       static_cast<std::size_t>(column + half)];
        ++cell.observations;
        cell.hits = static_cast<std::uint16_t>(cell.hits + (hit ? 1 : 0));
      });
    });
  }
  const std::size_t first = std::size_t{next_row_} * config_.side;
  const std::size_t count = static_cast<std::size_t>(rows) * config_.side;
  for (std::size_t i = 0; i < count; ++i) {
    cells_[first + i] = submap_cell(memory_.band[i]);
  }
  next_row_ = static_cast<std::uint16_t>(next_row_ + rows);
}

}  // namespace mellin
