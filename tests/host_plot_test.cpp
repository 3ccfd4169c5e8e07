// Line charts and tables.
#include <doctest.h>

#include <limits>
#include <stdexcept>

#include "host/plot.hpp"
#include "host/table.hpp"

using namespace mellin::host;

namespace {

std::size_t count(const std::string& text, const std::string& part) {
  std::size_t n = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) {
    ++n;
  }
  return n;
}

PlotPanel panel() { return {"A & B", {"x", 0.0, 2.0}, {"y", 0.0, 10.0}, {}, {}}; }

/// Path of the only curve of a chart.
std::string path_of(const std::string& svg) {
  const std::size_t clip = svg.find("clip-path");
  const std::size_t from = svg.find(" d=\"", clip) + 4;
  return svg.substr(from, svg.find('"', from) - from);
}

}  // namespace

TEST_SUITE("host_plot") {
  TEST_CASE("points lie where the axes have them, also on axes that fall") {
    PlotPanel rising = panel();
    rising.series.push_back({"", {{0, 0}, {2, 10}, {1, 5}}, 0, false});
    PlotPanel falling = rising;
    falling.x = {"x", 2.0, 0.0};
    const std::string there = path_of(to_svg("t", {rising}));
    const std::string back = path_of(to_svg("t", {falling}));
    // The corners of one are those of the other, left and right exchanged; the middle stays.
    const auto x_of = [](const std::string& path, int n) {
      std::size_t at = 0;
      for (int i = 0; i <= n; ++i) {
        at = path.find_first_of("ML", at) + 1;
      }
      return std::stod(path.substr(at));
    };
    CHECK(x_of(there, 0) < x_of(there, 2));
    CHECK(x_of(there, 2) == doctest::Approx(0.5 * (x_of(there, 0) + x_of(there, 1))));
    CHECK(x_of(back, 0) == x_of(there, 1));
    CHECK(x_of(back, 1) == x_of(there, 0));
    CHECK(x_of(back, 2) == x_of(there, 2));
  }

  TEST_CASE("what is not finite is left out, text is escaped, guides and dashes are drawn") {
    PlotPanel p = panel();
    p.series.push_back({"a<b", {{0, 1}, {1, std::numeric_limits<double>::quiet_NaN()}, {2, 1}}, 1, true});
    p.series.push_back({"empty", {}, 2, false});
    p.guides = {5.0};
    const std::string svg = to_svg("\"t\"", {p, panel()});
    CHECK(svg.rfind("<svg ", 0) == 0);
    CHECK(svg.substr(svg.size() - 7) == "</svg>\n");
    CHECK(svg.find("nan") == std::string::npos);
    CHECK(count(svg, "clip-path=") == 1);  // the empty series has no line …
    CHECK(count(svg, "empty") == 1);       // … but a legend
    CHECK(count(svg, "a&lt;b") == 1);
    CHECK(count(svg, "A &amp; B") == 2);
    CHECK(count(svg, "stroke-dasharray") == 2);
    CHECK(count(svg, "#888") == 1);
    const std::string path = path_of(svg);
    CHECK(count(path, "L") == 1);
  }

  TEST_CASE("a chart without panels is an empty page") { CHECK(to_svg("t", {}).find("</svg>") != std::string::npos); }

  TEST_CASE("tables: columns line up, CSV is quoted, rows have to fit") {
    Table table({"name", "n"});
    table.add({"a,b", "1"});
    table.add({"long name", "22"});
    CHECK(table.rows() == 2);
    CHECK(table.text() == "name       n\na,b        1\nlong name  22\n");
    CHECK(table.csv() == "name,n\n\"a,b\",1\nlong name,22\n");
    CHECK_THROWS_AS(table.add({"one"}), std::invalid_argument);
    CHECK(fixed(1.0 / 3.0, 2) == "0.33");
  }
}
