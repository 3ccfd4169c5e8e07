#include "mellin/grid/image.hpp"

#include <doctest.h>

#include <cmath>
#include <cstring>
#include <vector>

#include "mellin/grid/digest.hpp"
#include "tests/golden/spectral.hpp"

using namespace mellin;

namespace {

struct Image {
  explicit Image(std::uint16_t of_side) : pixels(std::size_t{of_side} * of_side), side(of_side) {}
  template <std::size_t N>
  Image(std::uint16_t of_side, const double (&values)[N]) : Image(of_side) {
    REQUIRE(N == pixels.size());
    for (std::size_t i = 0; i < N; ++i) {
      pixels[i] = static_cast<float>(values[i]);
    }
  }
  ImageView view() { return {{pixels.data(), pixels.size()}, side}; }

  std::vector<float> pixels;
  std::uint16_t side;
};

template <std::size_t N>
double largest_difference(const std::vector<float>& values, const double (&expected)[N]) {
  REQUIRE(values.size() == N);
  double largest = 0.0;
  for (std::size_t i = 0; i < N; ++i) {
    largest = std::max(largest, std::fabs(static_cast<double>(values[i]) - expected[i]));
  }
  return largest;
}

/// A grid drawn in characters, the lowest row last: '#' occupied, '.' free, ' ' unobserved, digits tenths.
struct Cells {
  Cells(std::uint16_t of_side, const char* drawing) : bytes(std::size_t{of_side} * of_side), side(of_side) {
    REQUIRE(std::strlen(drawing) == bytes.size());
    for (std::size_t r = 0; r < side; ++r) {
      for (std::size_t c = 0; c < side; ++c) {
        const char sign = drawing[(side - 1U - r) * side + c];
        const int value = sign == '#' ? 254 : (sign == '.' ? 0 : (sign == ' ' ? 255 : (sign - '0') * 254 / 10));
        bytes[r * side + c] = static_cast<std::uint8_t>(value);
      }
    }
  }
  GridView view() const { return {{bytes.data(), bytes.size()}, side, 0.05F}; }

  std::vector<std::uint8_t> bytes;
  std::uint16_t side;
};

struct Digest {
  explicit Digest(std::uint16_t side)
      : obstacles(std::size_t{side} * side), observed(mask_bytes(side)), free(observed) {
    out = {{obstacles.data(), obstacles.size()}, {observed.data(), observed.size()}, {free.data(), free.size()}, side};
  }
  std::vector<std::uint8_t> obstacles;
  std::vector<std::uint8_t> observed;
  std::vector<std::uint8_t> free;
  DigestOut out;
};

Status make(const GridView& grid, Digest& digest, Preprocessing preprocessing = Preprocessing::erosion) {
  std::vector<float> scratch(DigestMaker::scratch_size(grid.side, digest.out.side, preprocessing));
  return make_digest(grid, {scratch.data(), scratch.size()}, digest.out, preprocessing);
}

}  // namespace

TEST_SUITE("image") {
  TEST_CASE("obstacles are the share of hits, unobserved cells are free") {
    const Cells cells(2,
                      "# "
                      ".5");
    Image image(2);
    REQUIRE(obstacle_image(cells.view(), image.view()) == Status::ok);
    CHECK(image.view().at(0, 0) == 0.0F);
    CHECK(image.view().at(1, 0) == 0.5F);
    CHECK(image.view().at(0, 1) == 1.0F);
    CHECK(image.view().at(1, 1) == 0.0F);
  }

  TEST_CASE("thickening, blurring and the cyclic edge blur equal OpenCV and scipy") {
    Image image(16, golden::kImage);
    Image out(16);
    REQUIRE(thicken(image.view(), out.view()) == Status::ok);
    CHECK(largest_difference(out.pixels, golden::kThickened) < 1e-6);

    std::vector<float> lines(RowBlur::scratch_size(16, 1));
    REQUIRE(blur(image.view(), out.view(), {lines.data(), lines.size()}) == Status::ok);
    CHECK(largest_difference(out.pixels, golden::kBlurred) < 1e-6);

    std::vector<float> scratch(EdgeBlur::scratch_size(16, 3));
    EdgeBlur edges;
    REQUIRE(edges.begin(image.view(), 3, {scratch.data(), scratch.size()}) == Status::ok);
    while (!edges.step(5)) {
    }
    CHECK(largest_difference(image.pixels, golden::kEdgeBlurred) < 1e-6);
  }

  TEST_CASE("the edge blur keeps a constant picture and makes a step across the seam smaller") {
    Image image(32);
    std::vector<float> scratch(EdgeBlur::scratch_size(32, 4));
    EdgeBlur edges;
    std::fill(image.pixels.begin(), image.pixels.end(), 0.75F);
    REQUIRE(edges.begin(image.view(), 4, {scratch.data(), scratch.size()}) == Status::ok);
    CHECK(edges.step(1000));
    for (const float pixel : image.pixels) {
      REQUIRE(static_cast<double>(pixel) == doctest::Approx(0.75).epsilon(1e-6));
    }
    for (std::size_t i = 0; i < image.pixels.size(); ++i) {
      image.pixels[i] = i % 32 < 16 ? 0.0F : 1.0F;
    }
    REQUIRE(edges.begin(image.view(), 4, {scratch.data(), scratch.size()}) == Status::ok);
    edges.step(1000);
    for (std::size_t r = 0; r < 32; ++r) {
      CHECK(std::fabs(image.view().at(0, r) - image.view().at(31, r)) < 0.3F);
      if (r >= 4 && r < 28) {  // inside the margin nothing changes
        CHECK(image.view().at(4, r) == 0.0F);
        CHECK(image.view().at(27, r) == 1.0F);
      }
    }
  }

  TEST_CASE("halving takes means, also in place and fused with thickening") {
    const double values[] = {1, 2, 0, 0, 3, 6, 0, 4, 0, 0, 8, 8, 0, 0, 8, 8};
    Image image(4, values);
    Image half(2);
    REQUIRE(halve(image.view(), half.view()) == Status::ok);
    CHECK(half.pixels == std::vector<float>{3, 1, 0, 8});
    Image in_place(4, values);
    REQUIRE(halve(in_place.view(), {{in_place.pixels.data(), 4}, 2}) == Status::ok);
    CHECK(std::vector<float>(in_place.pixels.begin(), in_place.pixels.begin() + 4) == half.pixels);

    Image noise(16, golden::kImage);
    Image thick(16, golden::kThickened);
    Image expected(8);
    REQUIRE(halve(thick.view(), expected.view()) == Status::ok);
    REQUIRE(thicken_and_halve(noise.view(), {{noise.pixels.data(), 64}, 8}, 0, 8) == Status::ok);
    for (std::size_t i = 0; i < 64; ++i) {
      CHECK(static_cast<double>(noise.pixels[i]) ==
            doctest::Approx(static_cast<double>(expected.pixels[i])).epsilon(1e-6));
    }
  }

  TEST_CASE("normalising makes the largest pixel 1 and leaves an empty picture alone") {
    const double values[] = {0.25, 0.5, 0, 0.125};
    Image image(2, values);
    CHECK(normalise(image.view()) == 0.5F);
    CHECK(image.pixels == std::vector<float>{0.5F, 1.0F, 0.0F, 0.25F});
    Image empty(2);
    CHECK(normalise(empty.view()) == 0.0F);
    CHECK(empty.pixels == std::vector<float>(4, 0.0F));
  }

  TEST_CASE("a digest equals OpenCV's dilating, halving and normalising; masks equal numpy's") {
    Digest digest(8);
    const GridView grid{{golden::kCells, sizeof golden::kCells}, 32, 0.1F};
    REQUIRE(make(grid, digest) == Status::ok);
    for (std::size_t i = 0; i < 64; ++i) {
      CHECK(std::fabs(digest.obstacles[i] / 255.0 - golden::kDigestErosion[i]) <= 0.5 / 255 + 1e-6);
    }
    CHECK(std::memcmp(digest.observed.data(), golden::kObserved, 8) == 0);
    CHECK(std::memcmp(digest.free.data(), golden::kFree, 8) == 0);
  }

  TEST_CASE("every preprocessing equals OpenCV's, halved and at the grid's own side") {
    const GridView grid{{golden::kCells, sizeof golden::kCells}, 32, 0.1F};
    const auto check = [&](Preprocessing preprocessing, std::uint16_t side, const double* expected) {
      CAPTURE(static_cast<int>(preprocessing));
      CAPTURE(side);
      Digest digest(side);
      REQUIRE(make(grid, digest, preprocessing) == Status::ok);
      double largest = 0.0;
      for (std::size_t i = 0; i < digest.obstacles.size(); ++i) {
        largest = std::fmax(largest, std::fabs(digest.obstacles[i] / 255.0 - expected[i]));
      }
      CHECK(largest <= 0.5 / 255 + 1e-6);
    };
    check(Preprocessing::none, 8, golden::kDigestNone);
    check(Preprocessing::none, 32, golden::kFullNone);
    check(Preprocessing::erosion, 8, golden::kDigestErosion);
    check(Preprocessing::erosion, 32, golden::kFullErosion);
    check(Preprocessing::blur, 8, golden::kDigestBlur);
    check(Preprocessing::blur, 32, golden::kFullBlur);
  }

  TEST_CASE("a digest of a drawn grid") {
    const Cells cells(4,
                      "#.  "
                      "..  "
                      "..3 "
                      "...2");
    Digest digest(2);
    REQUIRE(make(cells.view(), digest) == Status::ok);
    // Lower left: free, one column touched by the 0.3 beside it. Upper left: all four cells beside the obstacle.
    CHECK(digest.obstacles[2] == 255);
    CHECK(digest.obstacles[0] < digest.obstacles[1]);
    CHECK(mask_bit({digest.observed.data(), 1}, 0));
    CHECK(mask_bit({digest.observed.data(), 1}, 1));
    CHECK(mask_bit({digest.observed.data(), 1}, 2));
    CHECK_FALSE(mask_bit({digest.observed.data(), 1}, 3));
    CHECK(digest.free[0] == 0b0001);
  }

  TEST_CASE("at the grid's own side a digest is the thickened, normalised picture") {
    const Cells cells(4,
                      "...."
                      "    "
                      "..5."
                      "....");
    Digest digest(4);
    REQUIRE(make(cells.view(), digest) == Status::ok);
    const std::vector<std::uint8_t> expected = {0, 255, 255, 255, 0, 255, 255, 255, 0, 255, 255, 255, 0, 0, 0, 0};
    CHECK(digest.obstacles == expected);
    CHECK(digest.observed[0] == 0xFF);
    CHECK(digest.observed[1] == 0b11110000);
  }

  TEST_CASE("slices of any size give the same digest, and a side that is no multiple of eight bits works") {
    std::vector<std::uint8_t> bytes(48 * 48);
    for (std::size_t i = 0; i < bytes.size(); ++i) {
      bytes[i] = static_cast<std::uint8_t>(i * 2654435761U >> 13U);
    }
    const GridView grid{{bytes.data(), bytes.size()}, 48, 0.1F};
    Digest whole(6);
    Digest sliced(6);
    REQUIRE(make(grid, whole) == Status::ok);
    std::vector<float> scratch(DigestMaker::scratch_size(48, 6));
    DigestMaker maker;
    REQUIRE(maker.begin(grid, {scratch.data(), scratch.size()}, sliced.out) == Status::ok);
    int steps = 1;
    while (!maker.step(1)) {
      ++steps;
    }
    CHECK(steps == 6 + 24 + 12 + 6 + 6);
    CHECK(sliced.obstacles == whole.obstacles);
    CHECK(sliced.observed == whole.observed);
    CHECK(sliced.free == whole.free);

    scratch.resize(DigestMaker::scratch_size(48, 6, Preprocessing::blur));
    REQUIRE(make(grid, whole, Preprocessing::blur) == Status::ok);
    REQUIRE(maker.begin(grid, {scratch.data(), scratch.size()}, sliced.out, Preprocessing::blur) == Status::ok);
    while (!maker.step(1)) {
    }
    CHECK(sliced.obstacles == whole.obstacles);
  }

  TEST_CASE("what is blurred has room for the mirrored border") {
    const std::vector<std::uint8_t> bytes(4 * 4, 1);
    Digest digest(2);
    CHECK(make({{bytes.data(), bytes.size()}, 4, 0.1F}, digest) == Status::ok);
#ifdef NDEBUG
    CHECK(make({{bytes.data(), bytes.size()}, 4, 0.1F}, digest, Preprocessing::blur) == Status::invalid_argument);
#endif
  }

  TEST_CASE("a grid with nothing observed gives an empty digest") {
    const std::vector<std::uint8_t> bytes(32 * 32, kUnobserved);
    Digest digest(8);
    REQUIRE(make({{bytes.data(), bytes.size()}, 32, 0.1F}, digest) == Status::ok);
    CHECK(digest.obstacles == std::vector<std::uint8_t>(64, 0));
    CHECK(digest.observed == std::vector<std::uint8_t>(8, 0));
    CHECK(digest.free == std::vector<std::uint8_t>(8, 0));
  }

  TEST_CASE("a digest's memory is counted as it is handed out") {
    MeasureArena measure;
    DigestOut::carve(measure, 50);
    CHECK(measure.use().by_part[static_cast<std::size_t>(Part::digests)] == 2504 + 320 + 320);
  }

#ifdef NDEBUG
  TEST_CASE("sizes that do not hold are refused") {
    Image image(16);
    Image other(12);
    Digest digest(12);
    const std::vector<std::uint8_t> bytes(32 * 32, 0);
    CHECK(thicken(image.view(), other.view()) == Status::invalid_argument);
    CHECK(halve(image.view(), other.view()) == Status::invalid_argument);
    CHECK(make({{bytes.data(), bytes.size()}, 32, 0.1F}, digest) == Status::invalid_argument);
    EdgeBlur edges;
    CHECK(edges.begin(image.view(), 5, {other.pixels.data(), 144}) == Status::invalid_argument);
    CHECK(edges.step(1));
  }
#endif
}
