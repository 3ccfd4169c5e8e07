// Set-up, and the order of the passes; the passes themselves are in extract.cpp and match.cpp.
#include "mellin/spectral/matcher.hpp"

#include <algorithm>
#include <cassert>
#include <iterator>

#include "mellin/grid/digest.hpp"

namespace mellin {

namespace {

/// Along one axis; the filter of two axes is the product. Frequency i over side / 2 means i - side.
void fill_lowpass(float sigma, Span<float> lowpass) {
  const std::size_t side = lowpass.size();
  for (std::size_t i = 0; i < side; ++i) {
    const double frequency = static_cast<double>(std::min(i, side - i)) / static_cast<double>(side);
    const double x = sigma > 0.0F ? frequency / static_cast<double>(sigma) : 0.0;
    lowpass[i] = static_cast<float>(exp(-0.5 * x * x));
  }
}

bool fits(const Features& features, const MatcherConfig& config) {
  return (features.image.empty() || features.image.size() == Features::image_count(config)) &&
         (features.filter.empty() || features.filter.size() == Features::filter_count(config)) &&
         features.polar.size() == Features::polar_count(config);
}

}  // namespace

Status Matcher::init(const MatcherConfig& config, const Memory& memory, VectorUnit unit) {
  stage_ = Stage::idle;
  if (!is_valid(config)) {
    return Status::invalid_config;
  }
  const std::size_t side = config.side;
  const bool enough = memory.first.size() == spectrum_size(config.side) &&
                      memory.second.size() == memory.first.size() && memory.rows.size() == Fft2::kBlock * side &&
                      memory.lines.size() == 2 * (kFftLanes + 1) * side && memory.lowpass.size() == side &&
                      memory.masked.size() == (config.masked ? 7 * spectrum_size(config.side) : 0) &&
                      memory.masked_rows.size() == (config.masked ? 7 * Fft2::kBlock * side : 0) &&
                      memory.turns.size() == config.kept_turns * spectrum_size(config.side);
  if (!enough) {
    return Status::insufficient_memory;
  }
  const Status planned = fft_.init(config.side, memory.fft, unit);
  if (planned != Status::ok) {
    return planned;
  }
  const Status tabulated = rotation_.init(
      config, memory.rotation,
      {as_floats(memory.second).first(spectrum_size(config.side)), memory.rows, memory.lines, memory.first});
  if (tabulated != Status::ok) {
    return tabulated;
  }
  config_ = config;
  memory_ = memory;
  query_ = nullptr;
  margin_ = EdgeBlur::margin(config.side, config.edge_margin);
  fill_lowpass(config.lowpass_sigma, memory.lowpass);
  double sum = 0.0;
  for (const float weight : memory.lowpass) {
    sum += static_cast<double>(weight);
  }
  filter_scale_ = static_cast<float>(1.0 / (sum * sum));
  return Status::ok;
}

Status Matcher::begin_extract(Span<const std::uint8_t> obstacles, Features& out, Span<const std::uint8_t> observed) {
  const bool valid = fft_.side() > 0 && obstacles.size() == std::size_t{config_.side} * config_.side &&
                     fits(out, config_) && (observed.empty() || observed.size() == mask_bytes(config_.side));
  assert(valid);
  stage_ = Stage::idle;
  out.ready = false;
  if (out.image.data() == query_) {
    query_ = nullptr;
  }
  if (!valid) {
    return status_ = Status::invalid_argument;
  }
  picture_ = obstacles;
  observed_ = observed;
  out_ = &out;
  lowest_ = 255;
  highest_ = 0;
  sum_ = 0.0;
  std::fill(std::begin(moments_), std::end(moments_), 0.0);
  status_ = Status::ok;
  stage_ = Stage::load;
  line_ = 0;
  return Status::ok;
}

Status Matcher::begin_match(const Features& a, const Features& b, const MatchOptions& options) {
  const bool valid = fft_.side() > 0 && fits(a, config_) && fits(b, config_) && !a.filter.empty() && !b.image.empty();
  assert(valid);
  stage_ = Stage::idle;
  hypotheses_.clear();
  if (!valid) {
    return status_ = Status::invalid_argument;
  }
  if (!a.ready || !b.ready) {
    return status_ = Status::degenerate;
  }
  a_ = a;
  b_ = b;
  options_ = options;
  rotation_index_ = 0;
  rotation_.begin_estimate(a.polar, b.polar, options.min_rotation_peak);
  status_ = Status::ok;
  stage_ = Stage::estimate_rotation;
  line_ = 0;
  return Status::ok;
}

void Matcher::keep_turned(const Features& b) {
  stage_ = Stage::idle;
  query_ = memory_.turns.empty() ? nullptr : b.image.data();
  turns_ = 0;
  std::fill(memory_.turn_place.begin(), memory_.turn_place.end(), std::uint16_t{0});
}

bool Matcher::step() {
  if (stage_ == Stage::idle) {
    return true;
  }
  if (stage_ == Stage::describe_rotation || stage_ == Stage::estimate_rotation) {
    if (rotation_.step(fft_, config_.lines_per_step)) {
      stage_ = after(stage_);
    }
    return stage_ == Stage::idle;
  }
  const std::size_t all = lines_of(stage_);
  const std::size_t left = all - line_;
  const std::size_t count = config_.lines_per_step == 0 ? left : std::min<std::size_t>(left, config_.lines_per_step);
  run(stage_, line_, count);
  line_ += count;
  if (line_ == all) {
    stage_ = after(stage_);
    line_ = 0;
  }
  return stage_ == Stage::idle;
}

std::size_t Matcher::lines_of(Stage stage) const {
  const std::size_t side = config_.side;
  switch (stage) {
    case Stage::load:
    case Stage::picture_rows:
    case Stage::masked_rows:
    case Stage::masked_turned_rows:
    case Stage::masked_search:
    case Stage::turned_rows:
    case Stage::surface_rows:
      return side;
    case Stage::blur_edges:
      return EdgeBlur::lines(config_.side, margin_);
    case Stage::picture_columns:
    case Stage::masked_columns:
    case Stage::masked_turned_columns:
    case Stage::masked_correlation:
    case Stage::whiten:
    case Stage::turned_columns:
      return side / 2 + 1;
    case Stage::filter_columns:
      return side / 2;
    case Stage::locate_peak:
      return peaks_.size();
    case Stage::describe_rotation:
    case Stage::estimate_rotation:
    case Stage::idle:
      break;
  }
  return 1;
}

void Matcher::run(Stage stage, std::size_t first, std::size_t count) {
  switch (stage) {
    case Stage::load:
      return load_rows(first, count);
    case Stage::blur_edges:
      return blur_edges(first, count);
    case Stage::picture_rows:
      return transform_picture_rows(first, count);
    case Stage::picture_columns:
      return transform_picture_columns(first, count);
    case Stage::masked_rows:
      return transform_masked_rows(first, count);
    case Stage::masked_columns:
      return transform_masked_columns(first, count);
    case Stage::masked_turned_rows:
      return transform_masked_turned_rows(first, count);
    case Stage::masked_turned_columns:
      return transform_masked_turned_columns(first, count);
    case Stage::masked_correlation:
      return correlate_masked_columns(first, count);
    case Stage::masked_search:
      return search_masked_rows(first, count);
    case Stage::whiten:
      return whiten_columns(first, count);
    case Stage::turned_rows:
      return transform_turned_rows(first, count);
    case Stage::turned_columns:
      return whiten_turned_columns(first, count);
    case Stage::filter_columns:
      return filter_turned_columns(first, count);
    case Stage::surface_rows:
      return search_surface_rows(first, count);
    case Stage::locate_peak:
      for (std::size_t i = first; i < first + count; ++i) {
        locate_peak(peaks_[i]);
      }
      return;
    case Stage::describe_rotation:
    case Stage::estimate_rotation:
    case Stage::idle:
      return;
  }
}

/// What follows a finished pass; also ends a job that turns out to be without an answer.
Matcher::Stage Matcher::after(Stage stage) {
  switch (stage) {
    case Stage::load:
      if (lowest_ == highest_) {
        status_ = Status::degenerate;
        return Stage::idle;
      }
      return Stage::blur_edges;
    case Stage::blur_edges:
      return Stage::picture_rows;
    case Stage::picture_rows:
      end_curvature();
      return config_.masked ? Stage::masked_rows : Stage::picture_columns;
    case Stage::masked_rows:
      return out_->filter.empty() ? Stage::picture_columns : Stage::masked_columns;
    case Stage::masked_columns:
      return Stage::picture_columns;
    case Stage::picture_columns:
      end_magnitudes();
      rotation_.begin_describe(out_->polar);
      return out_->filter.empty() || config_.masked ? Stage::describe_rotation : Stage::whiten;
    case Stage::whiten:
      return Stage::describe_rotation;
    case Stage::describe_rotation:
      status_ = rotation_.status();
      out_->ready = status_ == Status::ok;
      return Stage::idle;
    case Stage::estimate_rotation:
      rotation_index_ = 0;
      return rotation_count() == 0 ? Stage::idle : begin_rotation();
    case Stage::turned_rows:
      return Stage::turned_columns;
    case Stage::turned_columns:
      keep_turn();
      return Stage::filter_columns;
    case Stage::masked_turned_rows:
      return Stage::masked_turned_columns;
    case Stage::filter_columns:
    case Stage::masked_turned_columns:
      half_turn_ = false;
      begin_surface();
      return config_.masked ? Stage::masked_correlation : Stage::surface_rows;
    case Stage::masked_correlation:
      return Stage::masked_search;
    case Stage::surface_rows:
    case Stage::masked_search:
      return Stage::locate_peak;
    case Stage::locate_peak:
      if (!half_turn_) {
        half_turn_ = true;
        begin_surface();
        return config_.masked ? Stage::masked_correlation : Stage::surface_rows;
      }
      return ++rotation_index_ == rotation_count() ? Stage::idle : begin_rotation();
    case Stage::idle:
      break;
  }
  return Stage::idle;
}

Status Matcher::extract(Span<const std::uint8_t> obstacles, Features& out, Span<const std::uint8_t> observed) {
  const Status begun = begin_extract(obstacles, out, observed);
  while (!step()) {
  }
  return begun == Status::ok ? status_ : begun;
}

Status Matcher::match(const Features& a, const Features& b, const MatchOptions& options) {
  const Status begun = begin_match(a, b, options);
  while (!step()) {
  }
  return begun == Status::ok ? status_ : begun;
}

}  // namespace mellin
