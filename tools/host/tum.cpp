#include "host/tum.hpp"

#include <array>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <sstream>
#include <stdexcept>

namespace mellin::host {

std::vector<StampedPose> read_tum(const std::string& path) {
  std::ifstream in(path);
  if (!in) {
    throw std::runtime_error(path + ": cannot be opened");
  }
  std::vector<StampedPose> poses;
  std::string line;
  for (int number = 1; std::getline(in, line); ++number) {
    if (line.empty() || line[0] == '#') {
      continue;
    }
    std::istringstream fields(line);
    StampedPose pose;
    std::array<double, 7> v{};
    fields >> pose.stamp;
    bool good = true;
    for (double& value : v) {
      good = static_cast<bool>(fields >> value) && std::isfinite(value) && good;
    }
    try {
      pose.seconds = std::stod(pose.stamp);
    } catch (const std::exception&) {
      good = false;
    }
    if (!good) {
      throw std::runtime_error(path + ":" + std::to_string(number) + ": expected 8 finite numbers, found: " + line);
    }
    pose.pose = {v[0], v[1], 2.0 * std::atan2(v[5], v[6])};
    poses.push_back(pose);
  }
  return poses;
}

void write_tum(const std::string& path, const std::vector<StampedPose>& poses) {
  std::ofstream out(path);
  for (const StampedPose& p : poses) {
    std::array<char, 160> text{};
    std::snprintf(text.data(), text.size(), " %.6f %.6f 0 0 0 %.9f %.9f\n", p.pose.x, p.pose.y,
                  std::sin(p.pose.theta / 2), std::cos(p.pose.theta / 2));
    out << p.stamp << text.data();
  }
  out.flush();
  if (!out) {
    throw std::runtime_error(path + ": cannot be written");
  }
}

}  // namespace mellin::host
