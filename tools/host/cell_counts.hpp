// A rectangle of cells that counts what the beams of scans at known poses say of them: the host's own ray casting,
// independent of the library's.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "mellin/core/se2.hpp"

namespace mellin::host {

/// A laser scan that knows where it was taken. Beam i points at first_rad + i * step_rad in the laser's frame; a range
/// that is not finite, not positive or at least max_m hit nothing and is left out.
struct PosedScan {
  Pose2 world_T_laser;
  std::vector<float> ranges_m;
  double first_rad = 0.0;
  double step_rad = 0.0;
  double max_m = 0.0;
};

struct PointM {
  double x = 0.0;
  double y = 0.0;
};

bool hit_something(const PosedScan& scan, std::size_t beam);

/// End point of a beam, m, in the frame that frame_T_laser leads to.
PointM end_point(const PosedScan& scan, std::size_t beam, const Pose2& frame_T_laser);

class CellCounts {
 public:
  /// Cell (0, 0) begins at (first_column * cell_m, first_row * cell_m) of the frame. Memory: 8 bytes a cell.
  CellCounts(std::size_t width, std::size_t height, double cell_m, double first_column, double first_row);

  /// Casts every beam that hit something: the cell of its end point is observed and hit, those before it are observed.
  /// What lies outside the rectangle is left out.
  void add(const PosedScan& scan, const Pose2& frame_T_laser);

  std::size_t width() const { return width_; }
  std::size_t height() const { return height_; }
  std::size_t size() const { return hits_.size(); }
  /// By row * width() + column.
  std::uint32_t hits(std::size_t cell) const { return hits_[cell]; }
  std::uint32_t observations(std::size_t cell) const { return observations_[cell]; }

 private:
  PointM to_cells(const PointM& p) const;
  void cast(const PointM& from, const PointM& to);
  void observe(std::int64_t column, std::int64_t row, bool hit);

  std::size_t width_;
  std::size_t height_;
  double cell_m_;
  double first_column_;
  double first_row_;
  std::vector<std::uint32_t> hits_;
  std::vector<std::uint32_t> observations_;
};

}  // namespace mellin::host
