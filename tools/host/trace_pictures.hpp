// The pictures of a registration's stages, as the paper's Fig. 1 has them.
#pragma once

#include <vector>

#include "host/grid_image.hpp"
#include "host/plot.hpp"
#include "host/png_image.hpp"
#include "host/registration_trace.hpp"

namespace mellin::host {

/// (a) A grid as map_server shows it.
Picture draw_grid(const OccupancyImage& grid);
/// (a) What is transformed: obstacles dark, free space light, what says nothing in between. Also (e), B turned.
Picture draw_matched(const std::vector<float>& image, std::size_t side);
/// (b) Magnitudes on a logarithmic scale, zero frequency in the middle.
Picture draw_spectrum(const std::vector<float>& magnitudes, std::size_t side);
/// (c) Rows of equal frequency, the lowest at the foot, the angle to the right; three standard deviations either way.
Picture draw_polar(const std::vector<float>& polar, std::size_t side);
/// (d) The correlation over the angle, with the rotations that are tried.
PlotPanel plot_rotation(const RegistrationTrace& trace);
/// (f) No shift in the middle, `brightest` white, peaks circled, the highest yellow.
Picture draw_surface(const RegistrationTrace& trace, const TracedCandidate& candidate, float brightest);
/// (f) The surface round its highest peak at 400 %, the peak in the middle; as large as the surface.
Picture draw_peak(const RegistrationTrace& trace, const TracedCandidate& candidate, float brightest);
/// (g) A blue and B orange in A's frame, obstacles of both dark, free space of both white.
Picture draw_overlay(const OccupancyImage& a, const OccupancyImage& b, const Pose2& a_T_b, double resolution_m);

}  // namespace mellin::host
