#include "host/plot.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "host/file.hpp"

namespace mellin::host {
namespace {

constexpr double kPanelWidth = 400.0;
constexpr double kPanelHeight = 400.0;
constexpr double kLeft = 60.0;
constexpr double kRight = 16.0;
constexpr double kTop = 64.0;
constexpr double kBottom = 52.0;
constexpr double kLegendLine = 16.0;
constexpr int kTicks = 5;

/// Colours that are told apart with any kind of sight (Okabe and Ito 2008).
constexpr std::array<const char*, 8> kColours{"#0072B2", "#D55E00", "#009E73", "#CC79A7",
                                              "#E69F00", "#56B4E9", "#000000", "#8A8A00"};

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", value);
  return text;
}

std::string text_at(double x, double y, const std::string& anchor, const std::string& text,
                    const std::string& more = {}) {
  return "<text x=\"" + number(x) + "\" y=\"" + number(y) + "\" text-anchor=\"" + anchor + "\"" + more + ">" +
         escape_html(text) + "</text>\n";
}

/// Where a panel lies on the page.
class Frame {
 public:
  Frame(const PlotPanel& panel, std::size_t index)
      : panel_(panel), left_(static_cast<double>(index) * kPanelWidth + kLeft) {}

  double left() const { return left_; }
  double width() const { return kPanelWidth - kLeft - kRight; }
  double height() const { return kPanelHeight - kTop - kBottom; }
  double x(double share) const { return left_ + share * width(); }
  double y(double share) const { return kTop + (1.0 - share) * height(); }
  /// Position along the axis, 0 to 1 within it.
  static double share(const PlotAxis& axis, double value) { return (value - axis.from) / (axis.to - axis.from); }
  const PlotPanel& panel() const { return panel_; }

 private:
  const PlotPanel& panel_;
  double left_;
};

std::string axes(const Frame& frame) {
  std::string out;
  for (int i = 0; i <= kTicks; ++i) {
    const double share = static_cast<double>(i) / kTicks;
    const PlotAxis& ax = frame.panel().x;
    const PlotAxis& ay = frame.panel().y;
    const std::string line = "<path stroke=\"#ddd\" fill=\"none\" d=\"M";
    out += line + number(frame.x(share)) + " " + number(frame.y(0)) + "V" + number(frame.y(1)) + "\"/>\n";
    out += line + number(frame.x(0)) + " " + number(frame.y(share)) + "H" + number(frame.x(1)) + "\"/>\n";
    out += text_at(frame.x(share), frame.y(0) + 16.0, "middle", number(ax.from + share * (ax.to - ax.from)));
    out += text_at(frame.x(0) - 6.0, frame.y(share) + 4.0, "end", number(ay.from + share * (ay.to - ay.from)));
  }
  out += "<rect fill=\"none\" stroke=\"#333\" x=\"" + number(frame.x(0)) + "\" y=\"" + number(frame.y(1)) +
         "\" width=\"" + number(frame.width()) + "\" height=\"" + number(frame.height()) + "\"/>\n";
  out += text_at(frame.x(0.5), frame.y(0) + 36.0, "middle", frame.panel().x.label);
  const double lx = frame.left() - 42.0;
  const double ly = frame.y(0.5);
  out += text_at(lx, ly, "middle", frame.panel().y.label,
                 " transform=\"rotate(-90 " + number(lx) + " " + number(ly) + ")\"");
  out += text_at(frame.x(0.5), kTop - 10.0, "middle", frame.panel().title, " font-weight=\"bold\"");
  return out;
}

std::string guides(const Frame& frame) {
  std::string out;
  for (const double y : frame.panel().guides) {
    const double at = frame.y(Frame::share(frame.panel().y, y));
    out += "<path stroke=\"#888\" fill=\"none\" d=\"M" + number(frame.x(0)) + " " + number(at) + "H" +
           number(frame.x(1)) + "\"/>\n";
  }
  return out;
}

std::string stroke(const PlotSeries& series) {
  return std::string("fill=\"none\" stroke-width=\"1.5\" stroke=\"") + kColours[series.colour % kColours.size()] +
         (series.dashed ? "\" stroke-dasharray=\"6 4\"" : "\"");
}

std::string line(const Frame& frame, const PlotSeries& series, const std::string& clip) {
  std::string path;
  for (const PlotPoint& point : series.points) {
    if (std::isfinite(point.x) && std::isfinite(point.y)) {
      // What lies far outside is only there to be cut.
      const double x = std::clamp(Frame::share(frame.panel().x, point.x), -10.0, 10.0);
      const double y = std::clamp(Frame::share(frame.panel().y, point.y), -10.0, 10.0);
      path += path.empty() ? 'M' : 'L';
      path += number(frame.x(x)) + " " + number(frame.y(y));
    }
  }
  return path.empty() ? "" : "<path clip-path=\"url(#" + clip + ")\" " + stroke(series) + " d=\"" + path + "\"/>\n";
}

/// Below the axes, so that it hides no curve.
std::string legend(const Frame& frame) {
  std::string out;
  double y = kPanelHeight + 4.0;
  for (const PlotSeries& series : frame.panel().series) {
    if (!series.label.empty()) {
      out += "<path " + stroke(series) + " d=\"M" + number(frame.left()) + " " + number(y - 4.0) + "h24\"/>\n";
      out += text_at(frame.left() + 30.0, y, "start", series.label);
      y += kLegendLine;
    }
  }
  return out;
}

}  // namespace

std::string to_svg(const std::string& title, const std::vector<PlotPanel>& panels) {
  std::size_t labels = 0;
  for (const PlotPanel& panel : panels) {
    labels = std::max(labels, static_cast<std::size_t>(
                                  std::count_if(panel.series.begin(), panel.series.end(),
                                                [](const PlotSeries& series) { return !series.label.empty(); })));
  }
  const double width = kPanelWidth * static_cast<double>(std::max<std::size_t>(panels.size(), 1));
  const double height = kPanelHeight + kLegendLine * static_cast<double>(labels);
  std::string out = "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"" + number(width) + "\" height=\"" +
                    number(height) + "\" font-family=\"sans-serif\" font-size=\"12\">\n";
  out += "<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n";
  out += text_at(0.5 * width, 24.0, "middle", title, " font-size=\"15\"");
  for (std::size_t i = 0; i < panels.size(); ++i) {
    const Frame frame(panels[i], i);
    const std::string clip = "panel" + std::to_string(i);
    out += "<clipPath id=\"" + clip + "\"><rect x=\"" + number(frame.x(0)) + "\" y=\"" + number(frame.y(1)) +
           "\" width=\"" + number(frame.width()) + "\" height=\"" + number(frame.height()) + "\"/></clipPath>\n";
    out += axes(frame) + guides(frame);
    for (const PlotSeries& series : panels[i].series) {
      out += line(frame, series, clip);
    }
    out += legend(frame);
  }
  return out + "</svg>\n";
}

}  // namespace mellin::host
