// A drive on the simulated floor to which something happens: a hand, a slipping wheel, people, a failing sensor. Made
// by editing the scans of an ordinary drive, so that the truth stays known.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "host/simulator.hpp"
#include "mellin/core/random.hpp"

namespace mellin::test {

class DisturbedDrive {
 public:
  explicit DisturbedDrive(const host::SimOptions& options)
      : scans_(host::simulate(options, 0).scans), no_return_(static_cast<float>(host::no_return_value(options))) {}

  const std::vector<host::SimScan>& scans() const { return scans_; }
  const host::SimScan& operator[](std::size_t i) const { return scans_[i]; }
  std::size_t size() const { return scans_.size(); }

  /// The scan after `from` that is so far from it as the crow flies.
  std::size_t away(std::size_t from, double distance_m) const {
    std::size_t to = from;
    while (to + 1 < scans_.size() &&
           translation(between(scans_[from].world_T_base, scans_[to].world_T_base)) < distance_m) {
      ++to;
    }
    return to;
  }

  /// Somebody lifts or pushes the robot from where it scans at `at` to where it would have been at `to`: the wheels
  /// stand still, and no scan is taken on the way.
  void carry(std::size_t at, std::size_t to) {
    move_odometry(to, scans_[at].odometry_T_base);
    scans_.erase(begin(at + 1), begin(to));
  }

  /// The wheels turn so far after the scan `at`, and the robot stands.
  void slip(std::size_t at, const Pose2& way) { move_odometry(at + 1, compose(scans_[at].odometry_T_base, way), at); }

  /// The robot stands for so many more scans at `at`.
  void stand(std::size_t at, std::size_t count) {
    const host::SimScan stop = scans_[at];
    scans_.insert(begin(at + 1), count, stop);
  }

  /// No beam of the scans [first, end) comes back.
  void blind(std::size_t first, std::size_t end) {
    for (std::size_t i = first; i < end; ++i) {
      std::fill(scans_[i].ranges.begin(), scans_[i].ranges.end(), no_return_);
    }
  }

  /// A third of the beams of the scans [first, end) do not come back: at random, or a sector that is another one in
  /// each scan.
  void lose_a_third(std::size_t first, std::size_t end, bool sector, std::uint64_t seed) {
    Random random(seed, 7);
    for (std::size_t i = first; i < end; ++i) {
      std::vector<float>& ranges = scans_[i].ranges;
      const auto start = static_cast<std::size_t>(random.uniform() * static_cast<double>(ranges.size()));
      for (std::size_t b = 0; b < ranges.size(); ++b) {
        const bool lost =
            sector ? (b + ranges.size() - start) % ranges.size() < ranges.size() / 3 : random.uniform() < 1.0 / 3.0;
        ranges[b] = lost ? no_return_ : ranges[b];
      }
    }
  }

  /// So many people, each 0.5 m wide, walk to and fro before the laser in the scans [first, end), 0.8 to 2 m off.
  void people(std::size_t first, std::size_t end, std::size_t count, std::uint64_t seed) {
    Random random(seed, 9);
    std::vector<double> phases(3 * count);
    for (double& phase : phases) {
      phase = random.uniform();
    }
    for (std::size_t i = first; i < end; ++i) {
      std::vector<float>& ranges = scans_[i].ranges;
      const double beam = kPi / static_cast<double>(ranges.size());
      for (std::size_t p = 0; p < count; ++p) {
        const double distance = 0.8 + 1.2 * phases[3 * p];
        const double swing = 0.05 + 0.1 * phases[3 * p + 1];
        const double centre =
            kHalfPi + 1.4 * std::sin(kTwoPi * phases[3 * p + 2] + swing * static_cast<double>(i - first));
        for (std::size_t b = 0; b < ranges.size(); ++b) {
          const double across = distance * std::fabs(static_cast<double>(b) * beam - centre);
          if (across < 0.25 && static_cast<double>(ranges[b]) > distance) {
            ranges[b] = static_cast<float>(distance);
          }
        }
      }
    }
  }

 private:
  std::vector<host::SimScan>::iterator begin(std::size_t at) {
    return scans_.begin() + static_cast<std::ptrdiff_t>(at);
  }
  /// Moves the odometry of the scans from `first` on as a whole, so that that of `pivot` (`first` itself) becomes
  /// `odometry`.
  void move_odometry(std::size_t first, const Pose2& odometry) { move_odometry(first, odometry, first); }
  void move_odometry(std::size_t first, const Pose2& odometry, std::size_t pivot) {
    const Pose2 before = scans_[pivot].odometry_T_base;
    for (std::size_t i = first; i < scans_.size(); ++i) {
      scans_[i].odometry_T_base = compose(odometry, between(before, scans_[i].odometry_T_base));
    }
  }

  std::vector<host::SimScan> scans_;
  float no_return_;
};

}  // namespace mellin::test
