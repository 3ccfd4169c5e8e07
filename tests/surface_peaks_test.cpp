// The highest peaks of a cyclic surface, drawn by hand.
#include "mellin/spectral/surface_peaks.hpp"

#include <doctest.h>

#include <vector>

using namespace mellin;

namespace {

constexpr std::size_t kSide = 32;

class Surface {
 public:
  float& at(std::size_t row, std::size_t column) { return values_[row * kSide + column]; }
  SurfacePeaks peaks(std::size_t most) {
    SurfacePeaks peaks;
    peaks.begin(kSide, most);
    for (std::size_t r = 0; r < kSide; ++r) {
      peaks.add_row(r, {values_.data() + r * kSide, kSide});
    }
    return peaks;
  }

 private:
  std::vector<float> values_ = std::vector<float>(kSide * kSide);
};

}  // namespace

TEST_SUITE("surface_peaks") {
  TEST_CASE("the highest peaks, in order, and no more than asked for") {
    Surface surface;
    surface.at(5, 5) = 0.4F;
    surface.at(5, 20) = 0.9F;
    surface.at(25, 5) = 0.6F;
    surface.at(18, 18) = 0.2F;
    const SurfacePeaks three = surface.peaks(3);
    REQUIRE(three.size() == 3);
    CHECK(three[0].value == 0.9F);
    CHECK(three[0].row == 5);
    CHECK(three[0].column == 20);
    CHECK(three[1].value == 0.6F);
    CHECK(three[2].value == 0.4F);
    CHECK(surface.peaks(8).size() == 4);
  }

  TEST_CASE("one hump is one peak, also across the border of the cyclic surface") {
    Surface surface;
    surface.at(31, 10) = 0.5F;
    surface.at(0, 11) = 0.8F;  // seen first, beside 31
    surface.at(10, 0) = 0.7F;
    surface.at(11, 30) = 0.6F;
    const SurfacePeaks peaks = surface.peaks(8);
    REQUIRE(peaks.size() == 2);
    CHECK(peaks[0].value == 0.8F);
    CHECK(peaks[1].value == 0.7F);
  }

  TEST_CASE("a higher peak takes the place of all that it covers") {
    Surface surface;
    surface.at(8, 8) = 0.3F;
    surface.at(8, 12) = 0.4F;
    surface.at(10, 10) = 0.5F;  // within two of both
    surface.at(20, 20) = 0.1F;
    const SurfacePeaks peaks = surface.peaks(2);
    REQUIRE(peaks.size() == 2);
    CHECK(peaks[0].value == 0.5F);
  }

  TEST_CASE("a plateau has its first pixel, nothing over zero has none") {
    Surface surface;
    surface.at(7, 14) = 0.5F;
    surface.at(7, 15) = 0.5F;
    surface.at(20, 3) = -0.2F;
    const SurfacePeaks peaks = surface.peaks(4);
    REQUIRE(peaks.size() == 1);
    CHECK(peaks[0].column == 14);
    CHECK(Surface().peaks(4).size() == 0);
  }
}
