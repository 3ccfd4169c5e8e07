#include "host/explain_registration.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <utility>
#include <vector>

#include "host/file.hpp"
#include "host/html_page.hpp"
#include "host/trace_pictures.hpp"

namespace mellin::host {
namespace {

constexpr double kDegrees = 180.0 / kPi;

Html degrees(double rad) { return number(rad * kDegrees, 2) + "&deg;"; }

/// Deviation of a variance.
Html spread(float variance, double unit, int digits) {
  return number(unit * std::sqrt(std::max(0.0, static_cast<double>(variance))), digits);
}

Html paragraph(const Html& text) { return "<p>" + text + "</p>\n"; }

/// Rows of cells; the first row is the heading.
Html table(const std::vector<std::vector<Html>>& rows) {
  Html html = "<table>\n";
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Html tag = i == 0 ? "th" : "td";
    html += "<tr>";
    for (const Html& cell : rows[i]) {
      html += "<" + tag + " class=\"n\">" + cell + "</" + tag + ">";
    }
    html += "</tr>\n";
  }
  return html + "</table>\n";
}

class Explanation {
 public:
  Explanation(const ExplainedGrids& grids, const RegistrationTrace& trace, std::string folder)
      : grids_(grids), trace_(trace), folder_(std::move(folder)) {}

  void write() {
    std::filesystem::create_directories(folder_);
    Html body = result();
    body += grids() + preprocessed() + spectra() + polar() + rotation() + candidates() + surfaces() + hypotheses();
    write_file(folder_ + "/index.html", html_page("Registration of " + grids_.name_b + " in " + grids_.name_a,
                                                  "Step by step, after Fig. 1 of Oberländer, Roennau, Dillmann: Fast "
                                                  "Mapping and Global Matching, ICAR 2013",
                                                  body));
  }

 private:
  /// Writes the picture; a link to it.
  Html figure(const std::string& name, const Picture& picture, const Html& caption, bool pixels = true) const {
    write_file(folder_ + "/" + name + ".png", encode_png(picture));
    return "<figure><a href=\"" + name + ".png\"><img" + (pixels ? Html(" class=\"px\"") : Html()) + " src=\"" + name +
           ".png\" alt=\"" + name + "\"></a><figcaption>" + caption + "</figcaption></figure>\n";
  }
  /// The same of both grids, side by side.
  static Html row(const Html& figures) { return "<div class=\"row\">\n" + figures + "</div>\n"; }

  Html result() const {
    if (trace_.hypotheses.empty()) {
      return section("Result", paragraph(reason_for_none()));
    }
    const GridHypothesis& best = trace_.hypotheses.front();
    const bool accepted = best.confidence >= kAcceptedConfidence;
    const Html tiles = "<div class=\"tiles\">" + tile(number(best.confidence, 3), "confidence (a match from 0.5 on)") +
                       tile(number(best.a_T_b.x, 3) + " m", "x") + tile(number(best.a_T_b.y, 3) + " m", "y") +
                       tile(degrees(best.a_T_b.theta), "heading") + tile(number(best.peak, 3), "peak") +
                       tile(number(best.agreement, 3), "agreement") + "</div>\n";
    return tiles + section(accepted ? "Result: a match" : "Result: no match; the best hypothesis is not likely enough",
                           overlay("overlay-1", best));
  }

  static Html tile(const Html& value, const Html& name) {
    return "<div class=\"tile\"><b>" + value + "</b><span>" + name + "</span></div>\n";
  }

  Html reason_for_none() const {
    if (!trace_.a.ready || !trace_.b.ready) {
      return "No hypothesis: " +
             Html(trace_.a.ready   ? "B shows"
                  : trace_.b.ready ? "A shows"
                                   : "both grids show") +
             " nothing to match by.";
    }
    return trace_.matches.empty() ? "No hypothesis: the spectra have no direction in common."
                                  : "No hypothesis: under none of the matcher's poses what both observed agrees.";
  }

  Html overlay(const std::string& name, const GridHypothesis& h) const {
    return figure(name, draw_overlay(grids_.a, grids_.b, h.a_T_b, grids_.resolution_m),
                  "A blue, B orange, obstacles of both dark; free space of both white, of one tinted.", false);
  }

  Html grids() const {
    const auto caption = [&](const char* letter, const std::string& name, const OccupancyImage& grid) {
      return Html(letter) + ": " + escape_html(name) + ", " + std::to_string(grid.width) + " x " +
             std::to_string(grid.height) + " cells of " + number(grids_.resolution_m, 3) + " m";
    };
    return section("(a) The two grids",
                   row(figure("a-grid-a", draw_grid(grids_.a), caption("A", grids_.name_a, grids_.a)) +
                       figure("a-grid-b", draw_grid(grids_.b), caption("B", grids_.name_b, grids_.b))));
  }

  Html preprocessed() const {
    const RegistrationConfig& config = trace_.pair.config;
    const std::size_t side = trace_.side();
    return section(
        "(a) As they are matched",
        paragraph("Padded to " + std::to_string(config.grid_side) + " cells, obstacles thickened, scaled to " +
                  std::to_string(side) + " pixels of " + number(static_cast<double>(config.matcher.pixel_m), 3) +
                  " m, normalised, made seamless along the border. Obstacles count 1 (dark), observed free "
                  "space " +
                  number(-static_cast<double>(config.matcher.free_weight), 1) +
                  " (light), what was not observed 0 (grey).") +
            row(figure("a-matched-a", draw_matched(trace_.a.image, side), "A") +
                figure("a-matched-b", draw_matched(trace_.b.image, side), "B")));
  }

  Html spectra() const {
    const std::size_t side = trace_.side();
    return section("(b) Magnitude spectra after the high-pass",
                   paragraph("They do not depend on where the picture lies, and turn with it. Zero frequency in the "
                             "middle, logarithmic for the eye. Straight walls are rays across them.") +
                       row(figure("b-spectrum-a", draw_spectrum(trace_.a.magnitudes, side), "A") +
                           figure("b-spectrum-b", draw_spectrum(trace_.b.magnitudes, side), "B")));
  }

  Html polar() const {
    const RotationMode mode = trace_.pair.config.matcher.rotation;
    const bool log_polar = mode == RotationMode::log_polar || mode == RotationMode::log_polar_scale;
    const Html axes = log_polar ? "360&deg; to the right, the logarithm of the frequency upwards"
                                : "180&deg; to the right, the frequency upwards";
    const Html means = mode == RotationMode::rings ? ", each ring without its mean" : "";
    return section("(c) The same in polar coordinates",
                   paragraph("A rotation has become a shift to the right: " + axes + means + ".") +
                       row(figure("c-polar-a", draw_polar(trace_.a.polar, trace_.side()), "A") +
                           figure("c-polar-b", draw_polar(trace_.b.polar, trace_.side()), "B")));
  }

  Html rotation() const {
    if (trace_.rotations.empty()) {
      return "";
    }
    std::vector<std::vector<Html>> rows = {{"rotation", "or", "correlation", "&sigma; of the angle", "scale"}};
    for (const RotationPeak& peak : trace_.rotations) {
      rows.push_back({degrees(wrap_angle(peak.angle_rad)), degrees(wrap_angle(peak.angle_rad + kPi)),
                      number(static_cast<double>(peak.strength), 3), spread(peak.variance, kDegrees, 2) + "&deg;",
                      number(static_cast<double>(peak.scale), 3)});
    }
    const Html svg = to_svg("Rotation of B to A", {plot_rotation(trace_)});
    write_file(folder_ + "/d-rotation.svg", svg);
    return section("(d) Rotation: how the polar pictures correlate",
                   "<img src=\"d-rotation.svg\" alt=\"correlation over the angle\">\n" +
                       paragraph("All peaks of at least " +
                                 number(100.0 * static_cast<double>(trace_.pair.config.matcher.peak_share), 0) +
                                 " % of the highest (grey line) are tried, at most " +
                                 std::to_string(trace_.pair.config.matcher.max_peaks) + ".") +
                       table(rows));
  }

  std::string number_of(const TracedCandidate& candidate) const {
    return std::to_string(&candidate - trace_.candidates.data() + 1);
  }

  Html candidates() const {
    Html figures;
    for (const TracedCandidate& candidate : trace_.candidates) {
      figures += figure("e-candidate-" + number_of(candidate), draw_matched(candidate.turned, trace_.side()),
                        "B turned by " + degrees(candidate.angle_rad));
    }
    return figures.empty() ? "" : section("(e) B turned by each rotation and by 180&deg; more", row(figures));
  }

  Html surfaces() const {
    const TracedCandidate* const best = trace_.best_candidate();
    if (best == nullptr) {
      return "";
    }
    const float brightest = best->peaks[0].value;
    Html figures =
        figure("f-peak", draw_peak(trace_, *best, brightest), "<b>The highest peak at 400 %</b>: " + caption(*best));
    for (const TracedCandidate& candidate : trace_.candidates) {
      figures += figure("f-surface-" + number_of(candidate), draw_surface(trace_, candidate, brightest),
                        (&candidate == best ? "<b>The best</b>: " : "") + caption(candidate));
    }
    return section("(f) Translation: the phase-only matched filter of A with each",
                   paragraph("No shift in the middle; the highest of all is white. The highest peak of each is circled "
                             "yellow, the next ones that become hypotheses orange.") +
                       row(figures));
  }

  Html caption(const TracedCandidate& candidate) const {
    Html text = degrees(candidate.angle_rad);
    if (!candidate.peaks.empty()) {
      const Fft2::Peak& peak = candidate.peaks[0];
      const auto pixel_m = static_cast<double>(trace_.pair.config.matcher.pixel_m);
      text += ", peak " + number(static_cast<double>(peak.value), 3) + " at a shift of " +
              number(trace_.shift(peak.column) * pixel_m, 1) + " m, " + number(trace_.shift(peak.row) * pixel_m, 1) +
              " m";
    }
    return text;
  }

  Html hypotheses() const {
    std::vector<std::vector<Html>> matches = {
        {"", "x", "y", "heading", "peak", "rotation's", "&sigma; x", "&sigma; y", "&sigma; heading"}};
    for (const Hypothesis& h : trace_.matches) {
      const Pose2 pose = trace_.pair.between_corners(h.a_T_b);
      matches.push_back({std::to_string(matches.size()), number(pose.x, 2), number(pose.y, 2), degrees(pose.theta),
                         number(static_cast<double>(h.peak), 3), number(static_cast<double>(h.rotation_peak), 3),
                         spread(h.covariance.xx, 1.0, 2), spread(h.covariance.yy, 1.0, 2),
                         spread(h.covariance.tt, kDegrees, 2) + "&deg;"});
    }
    std::vector<std::vector<Html>> rows = {{"", "x", "y", "heading", "confidence", "peak", "agreement"}};
    Html overlays;
    for (const GridHypothesis& h : trace_.hypotheses) {
      const std::string name = std::to_string(rows.size());
      rows.push_back({name, number(h.a_T_b.x, 3), number(h.a_T_b.y, 3), degrees(h.a_T_b.theta), number(h.confidence, 4),
                      number(h.peak, 3), number(h.agreement, 3)});
      if (rows.size() > 2) {
        overlays += "<h2>Hypothesis " + name + ", confidence " + number(h.confidence, 4) + "</h2>\n" +
                    overlay("overlay-" + name, h);
      }
    }
    Html html;
    if (matches.size() > 1) {
      html += section("The matcher's hypotheses",
                      paragraph("Poses of B's lower left corner in A, m; surfaces are cyclic, so a shift may also be "
                                "one the other way: what was observed decides.") +
                          table(matches));
    }
    if (!trace_.hypotheses.empty()) {
      html += section("(g) Verified, aligned on the obstacles, judged",
                      paragraph("Poses of B's lower left corner in A, m. The agreement is of what both observed, times "
                                "the share of obstacles that lie on each other; the confidence is the probability that "
                                "the pose is right, and depends on how much better it is than its rivals.") +
                          table(rows) + overlays);
    }
    return html;
  }

  const ExplainedGrids& grids_;
  const RegistrationTrace& trace_;
  std::string folder_;
};

}  // namespace

void write_explanation(const ExplainedGrids& grids, const RegistrationTrace& trace, const std::string& folder) {
  Explanation(grids, trace, folder).write();
}

}  // namespace mellin::host
