// A page that walks through a registration as the paper's Fig. 1 does, with all its pictures and numbers.
#pragma once

#include <string>

#include "host/grid_image.hpp"
#include "host/registration_trace.hpp"

namespace mellin::host {

struct ExplainedGrids {
  std::string name_a;
  std::string name_b;
  OccupancyImage a;
  OccupancyImage b;
  double resolution_m = 0.05;
};

/// Writes index.html and the PNG pictures that it links to into `folder`, which is made where it is missing. Throws
/// std::runtime_error (std::filesystem::filesystem_error among them) where it cannot.
void write_explanation(const ExplainedGrids& grids, const RegistrationTrace& trace, const std::string& folder);

}  // namespace mellin::host
