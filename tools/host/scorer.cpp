#include "host/scorer.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string_view>

#include "host/line_reader.hpp"

namespace mellin::host {
namespace {

constexpr double kRadian = 180.0 / kPi;
constexpr double kRevisitDistance_m = 3.0;
constexpr std::size_t kRevisitGap = 60;
constexpr std::size_t kRevisitPoses = 1500;

/// Errors of relative poses as they come.
class ErrorList {
 public:
  void add(const Pose2& estimated, const Pose2& expected) {
    translation_.push_back(std::hypot(estimated.x - expected.x, estimated.y - expected.y));
    rotation_.push_back(std::fabs(wrap_angle(estimated.theta - expected.theta)) * kRadian);
  }

  RelativeError statistics() const {
    RelativeError error;
    error.count = translation_.size();
    if (translation_.empty()) {
      return error;
    }
    error.mean_m = mean(translation_);
    error.deviation_m = deviation(translation_, error.mean_m);
    error.mean_deg = mean(rotation_);
    error.deviation_deg = deviation(rotation_, error.mean_deg);
    std::vector<double> sorted = translation_;
    std::sort(sorted.begin(), sorted.end());
    const std::size_t half = sorted.size() / 2;
    error.median_m = sorted.size() % 2 == 1 ? sorted[half] : (sorted[half - 1] + sorted[half]) / 2.0;
    error.max_m = sorted.back();
    return error;
  }

 private:
  static double mean(const std::vector<double>& values) {
    double sum = 0.0;
    for (const double value : values) {
      sum += value;
    }
    return sum / static_cast<double>(values.size());
  }

  static double deviation(const std::vector<double>& values, double mean) {
    double sum = 0.0;
    for (const double value : values) {
      sum += (value - mean) * (value - mean);
    }
    return std::sqrt(sum / static_cast<double>(values.size()));
  }

  std::vector<double> translation_;
  std::vector<double> rotation_;
};

void score_absolute(const PosePairs& pairs, TrajectoryScore& score) {
  const Pose2 truth_T_estimate = align(pairs);
  double squares = 0.0;
  double rotation_squares = 0.0;
  for (std::size_t i = 0; i < pairs.truth.size(); ++i) {
    const Pose2 error = between(pairs.truth[i], compose(truth_T_estimate, pairs.estimate[i]));
    const double distance = translation(error);
    squares += distance * distance;
    rotation_squares += error.theta * error.theta;
    score.ate_max_m = std::max(score.ate_max_m, distance);
  }
  const auto n = static_cast<double>(pairs.truth.size());
  score.ate_rmse_m = std::sqrt(squares / n);
  score.ate_rotation_rmse_deg = std::sqrt(rotation_squares / n) * kRadian;
}

RelativeError score_steps(const PosePairs& pairs) {
  ErrorList errors;
  for (std::size_t i = 1; i < pairs.truth.size(); ++i) {
    errors.add(between(pairs.estimate[i - 1], pairs.estimate[i]), between(pairs.truth[i - 1], pairs.truth[i]));
  }
  return errors.statistics();
}

RelativeError score_revisits(const PosePairs& pairs) {
  const std::size_t n = pairs.truth.size();
  const std::size_t stride = std::max<std::size_t>(1, n / kRevisitPoses);
  ErrorList errors;
  for (std::size_t i = 0; i < n; i += stride) {
    for (std::size_t j = i + stride; j < n; j += stride) {
      const bool near =
          std::hypot(pairs.truth[i].x - pairs.truth[j].x, pairs.truth[i].y - pairs.truth[j].y) < kRevisitDistance_m;
      if (near && j - i > kRevisitGap) {
        errors.add(between(pairs.estimate[i], pairs.estimate[j]), between(pairs.truth[i], pairs.truth[j]));
      }
    }
  }
  return errors.statistics();
}

/// The estimate at a time between two of its poses; false where the nearer one is farther than gap_s.
bool interpolate(const std::vector<StampedPose>& sorted, double seconds, double gap_s, Pose2& pose) {
  if (sorted.empty()) {
    return false;
  }
  const std::size_t last = sorted.size() - 1;
  const std::size_t after = std::min(std::max<std::size_t>(first_not_before(sorted, seconds), 1), last);
  const StampedPose& a = sorted[after == 0 ? 0 : after - 1];
  const StampedPose& b = sorted[after];
  const double share = std::clamp((seconds - a.seconds) / std::max(b.seconds - a.seconds, 1e-9), 0.0, 1.0);
  pose = {a.pose.x + share * (b.pose.x - a.pose.x), a.pose.y + share * (b.pose.y - a.pose.y),
          a.pose.theta + share * wrap_angle(b.pose.theta - a.pose.theta)};
  return std::min(std::fabs(seconds - a.seconds), std::fabs(b.seconds - seconds)) <= gap_s;
}

}  // namespace

TrajectoryScore score_trajectory(const std::vector<StampedPose>& estimate, const std::vector<StampedPose>& truth) {
  const PosePairs pairs = pair_by_stamp(estimate, truth);
  TrajectoryScore score;
  score.paired = pairs.truth.size();
  score.paired_share = static_cast<double>(score.paired) / static_cast<double>(std::max<std::size_t>(1, truth.size()));
  if (score.paired < 3) {
    return score;
  }
  score.scored = true;
  score_absolute(pairs, score);
  score.step = score_steps(pairs);
  score.revisit = score_revisits(pairs);
  return score;
}

std::vector<Relation> read_relations(const std::string& path) {
  LineReader lines(path);
  std::vector<Relation> relations;
  std::string line;
  std::vector<std::string_view> words;
  while (lines.next(line)) {
    split_words(line, words);
    if (words.empty() || words[0].front() == '#') {
      continue;
    }
    double v[8] = {};
    bool good = words.size() == 8;
    for (std::size_t i = 0; good && i < 8; ++i) {
      good = parse_number(words[i], v[i]);
    }
    if (!good || std::fabs(v[7]) > 1e5) {
      throw std::runtime_error(path + ":" + std::to_string(lines.number()) +
                               ": expected t1 t2 x y z roll pitch yaw, found: " + line.substr(0, 100));
    }
    relations.push_back({v[0], v[1], {v[2], v[3], v[7]}});
  }
  return relations;
}

RelativeError score_relations(const std::vector<StampedPose>& estimate, const std::vector<Relation>& relations,
                              double gap_s) {
  const std::vector<StampedPose> sorted = by_time(estimate);
  ErrorList errors;
  for (const Relation& relation : relations) {
    Pose2 from;
    Pose2 to;
    if (interpolate(sorted, relation.from_s, gap_s, from) && interpolate(sorted, relation.to_s, gap_s, to)) {
      errors.add(between(from, to), relation.from_T_to);
    }
  }
  return errors.statistics();
}

namespace {

nlohmann::ordered_json score_json(const TrajectoryScore& score, const std::optional<RelativeError>& relations,
                                  std::size_t relations_total) {
  nlohmann::ordered_json json;
  json["n"] = score.paired;
  json["paired"] = std::round(score.paired_share * 1e4) / 1e4;
  if (score.scored) {
    json["ate_rmse_m"] = score.ate_rmse_m;
    json["ate_max_m"] = score.ate_max_m;
    json["ate_rot_rmse_deg"] = score.ate_rotation_rmse_deg;
    json["rel_step_m"] = score.step.mean_m;
    json["rel_step_std_m"] = score.step.deviation_m;
    json["rel_step_deg"] = score.step.mean_deg;
  }
  if (score.revisit.count > 0) {
    json["revisits"] = score.revisit.count;
    json["rel_revisit_m"] = score.revisit.mean_m;
    json["rel_revisit_std_m"] = score.revisit.deviation_m;
    json["rel_revisit_deg"] = score.revisit.mean_deg;
    json["rel_revisit_max_m"] = score.revisit.max_m;
  }
  if (relations) {
    nlohmann::ordered_json& r = json["relations"];
    r["relations"] = relations->count;
    r["of"] = relations_total;
    if (relations->count > 0) {
      r["trans_m"] = relations->mean_m;
      r["trans_std_m"] = relations->deviation_m;
      r["trans_median_m"] = relations->median_m;
      r["rot_deg"] = relations->mean_deg;
      r["rot_std_deg"] = relations->deviation_deg;
      r["trans_max_m"] = relations->max_m;
    }
  }
  return json;
}

void append_text(const nlohmann::ordered_json& json, std::string& text) {
  for (const auto& [name, value] : json.items()) {
    if (value.is_object()) {
      append_text(value, text);
      continue;
    }
    char number[64];
    (void)std::snprintf(number, sizeof(number), "%-18s %.4g\n", name.c_str(), value.get<double>());
    text += number;
  }
}

}  // namespace

std::string to_json(const TrajectoryScore& score, const std::optional<RelativeError>& relations,
                    std::size_t relations_total) {
  return score_json(score, relations, relations_total).dump() + "\n";
}

std::string to_text(const TrajectoryScore& score, const std::optional<RelativeError>& relations,
                    std::size_t relations_total) {
  std::string text;
  append_text(score_json(score, relations, relations_total), text);
  return text;
}

}  // namespace mellin::host
