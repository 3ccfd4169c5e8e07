#include "mellin/spectral/matcher.hpp"

#include <doctest.h>

#include <cmath>
#include <cstring>
#include <initializer_list>
#include <utility>
#include <vector>

#include "tests/golden/spectral.hpp"
#include "tests/support/matcher_bench.hpp"
#include "tests/support/trials.hpp"

using namespace mellin;
using namespace mellin::test;

namespace {

Picture golden_picture(const std::uint8_t (&bytes)[48 * 48]) { return {bytes, bytes + 48 * 48}; }

bool same_bits(const HypothesisList& a, const HypothesisList& b) {
  if (a.size() != b.size()) {
    return false;
  }
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (a[i].a_T_b.x != b[i].a_T_b.x || a[i].a_T_b.y != b[i].a_T_b.y || a[i].a_T_b.theta != b[i].a_T_b.theta ||
        a[i].peak != b[i].peak || a[i].rotation_peak != b[i].rotation_peak) {
      return false;
    }
  }
  return true;
}

}  // namespace

TEST_SUITE("matcher") {
  TEST_CASE("hypotheses equal those of a numpy implementation in double precision") {
    const auto check = []([[maybe_unused]] const char* name, const MatcherConfig& config, const auto& expected) {
      CAPTURE(name);
      Bench bench(config);
      const Picture picture_a = golden_picture(golden::kPictureA);
      const Picture picture_b = golden_picture(golden::kPictureB);
      Features a = bench.carve();
      Features b = bench.carve();
      REQUIRE(bench.matcher.extract({picture_a.data(), picture_a.size()}, a, golden::kMaskA) == Status::ok);
      REQUIRE(bench.matcher.extract({picture_b.data(), picture_b.size()}, b, golden::kMaskB) == Status::ok);
      REQUIRE(bench.matcher.match(a, b) == Status::ok);
      const HypothesisList& found = bench.matcher.hypotheses();
      REQUIRE(found.size() == std::size(expected));
      for (std::size_t i = 0; i < found.size(); ++i) {
        CHECK(found[i].a_T_b.x == doctest::Approx(expected[i][0]).epsilon(1e-3));
        CHECK(found[i].a_T_b.y == doctest::Approx(expected[i][1]).epsilon(1e-3));
        CHECK(found[i].a_T_b.theta == doctest::Approx(expected[i][2]).epsilon(1e-4));
        CHECK(static_cast<double>(found[i].peak) == doctest::Approx(expected[i][3]).epsilon(1e-3));
        CHECK(static_cast<double>(found[i].rotation_peak) == doctest::Approx(expected[i][4]).epsilon(1e-4));
        CHECK(static_cast<double>(found[i].scale) == doctest::Approx(expected[i][5]).epsilon(1e-4));
      }
    };
    MatcherConfig rings = config_of(48);
    rings.peak_fit = PeakFit::centre_of_mass;
    check("rings, observed free space", rings, golden::kFreeSpace);
    rings.free_weight = 0.0F;
    check("rings", rings, golden::kHypotheses);
    MatcherConfig linear = rings;
    linear.rotation = RotationMode::linear_polar;
    linear.high_pass = HighPass::none;
    linear.com_radius = 2;
    check("linear polar", linear, golden::kLinearPolar);
    MatcherConfig logarithmic = config_of(48);
    logarithmic.free_weight = 0.0F;
    logarithmic.rotation = RotationMode::log_polar;
    logarithmic.peak_fit = PeakFit::gaussian;
    check("log-polar", logarithmic, golden::kLogPolar);
    MatcherConfig masked = rings;
    masked.masked = true;
    check("masked", masked, golden::kMasked);
    MatcherConfig paper = paper_matcher(48);
    paper.pixel_m = 1.0F;
    check("the paper's", paper, golden::kPaper);
  }

  TEST_CASE("a picture against itself: no motion, peaks near 1") {
    for (const std::uint16_t side : std::initializer_list<std::uint16_t>{48, 50, 54}) {
      Bench bench(config_of(side));
      const Picture picture = centred(golden_picture(golden::kPictureA), 48, side);
      const HypothesisList found = bench.match(picture, picture);
      CHECK(std::hypot(found[0].a_T_b.x, found[0].a_T_b.y) < 1e-3);
      CHECK(std::fabs(found[0].a_T_b.theta) < 1e-4);
      CHECK(static_cast<double>(found[0].rotation_peak) == doctest::Approx(1.0).epsilon(1e-4));
      CHECK(found[0].peak > 0.95F);
      CHECK(found[0].peak < 1.001F);
    }
  }

  TEST_CASE("whole pixels of motion come back as such, in metres") {
    Bench bench(config_of(96, 0.4F));
    const Picture still = centred(golden_picture(golden::kPictureA), 48, 96);
    for (const auto& [dx, dy] : {std::pair{5, 0}, {0, -7}, {-20, 11}, {23, 23}, {-24, -24}}) {
      const HypothesisList found = bench.match(moved(still, 96, dx, dy), still);
      CHECK(error_of(found[0].a_T_b, {0.4 * dx, 0.4 * dy, 0.0}).metres < 0.01 * 0.4);
      CHECK(error_of(found[0].a_T_b, {0.4 * dx, 0.4 * dy, 0.0}).radians < 1e-3);
    }
  }

  TEST_CASE("exact quarter turns about the grid's centre have no translation, at even sides of any kind") {
    for (const std::uint16_t side : std::initializer_list<std::uint16_t>{60, 64, 90}) {
      CAPTURE(side);
      Bench bench(config_of(side));
      const Picture still = centred(golden_picture(golden::kPictureA), 48, side);
      Picture turned = still;
      for (int quarter = 1; quarter < 4; ++quarter) {
        CAPTURE(quarter);
        turned = quarter_turned(turned, side);
        const HypothesisList found = bench.match(turned, still);
        CHECK(std::hypot(found[0].a_T_b.x, found[0].a_T_b.y) < 0.02);
        CHECK(std::fabs(wrap_angle(found[0].a_T_b.theta - quarter * kHalfPi)) < 2e-3);
        CHECK(found[0].peak > 0.9F);
      }
    }
  }

  TEST_CASE("offices rendered at two poses are registered over the full circle to less than a pixel and a bin") {
    const std::uint16_t grid = 384;
    const std::uint16_t side = 96;
    const double pixel = 0.4;
    Bench bench(config_of(side, static_cast<float>(pixel)));
    Random random(11, 0);
    for (int i = 0; i < test::trials(36); ++i) {
      CAPTURE(i);
      const std::vector<Wall> walls = office(static_cast<std::uint64_t>(i) / 6);
      const Pose2 w_T_a{4.0 * random.uniform() - 2.0, 3.0 * random.uniform() - 1.5, kTwoPi * random.uniform()};
      const Pose2 a_T_b{8.0 * random.uniform() - 4.0, 8.0 * random.uniform() - 4.0,
                        wrap_angle((i * 10.0 + 10.0 * random.uniform()) * kPi / 180.0)};
      const Picture a = digest_of(render(walls, w_T_a, grid, 0.1, 17.0), grid, side);
      const Picture b = digest_of(render(walls, compose(w_T_a, a_T_b), grid, 0.1, 17.0), grid, side);
      const HypothesisList found = bench.match(a, b);
      REQUIRE_FALSE(found.empty());
      CHECK(error_of(found[0].a_T_b, a_T_b).metres < pixel);
      CHECK(error_of(found[0].a_T_b, a_T_b).radians < kPi / side);

      const HypothesisList swapped = bench.match(b, a);
      REQUIRE_FALSE(swapped.empty());
      const Error disagreement = error_of(inverse(swapped[0].a_T_b), found[0].a_T_b);
      CHECK(disagreement.metres < pixel);
      CHECK(disagreement.radians < kPi / side);
    }
  }

  TEST_CASE("at the grid's own resolution the error is of the order of a cell") {
    const std::uint16_t side = 384;
    const double pixel = 0.1;
    Bench bench(config_of(side, static_cast<float>(pixel)));
    Random random(12, 0);
    for (int i = 0; i < test::trials(6); ++i) {
      CAPTURE(i);
      const std::vector<Wall> walls = office(static_cast<std::uint64_t>(i));
      const Pose2 a_T_b{6.0 * random.uniform() - 3.0, 6.0 * random.uniform() - 3.0, wrap_angle(i + random.uniform())};
      const Picture a = digest_of(render(walls, {}, side, pixel, 17.0), side, side);
      const Picture b = digest_of(render(walls, a_T_b, side, pixel, 17.0), side, side);
      const HypothesisList found = bench.match(a, b);
      REQUIRE_FALSE(found.empty());
      CHECK(error_of(found[0].a_T_b, a_T_b).metres < 1.5 * pixel);
      CHECK(error_of(found[0].a_T_b, a_T_b).radians < kPi / side);
    }
  }

  TEST_CASE("unrelated offices have much lower peaks than the same one") {
    Bench bench(config_of(96, 0.4F));
    const auto picture = [](std::uint64_t seed, const Pose2& pose) {
      return digest_of(render(office(seed), pose, 384, 0.1, 17.0), 384, 96);
    };
    const float same = bench.match(picture(1, {}), picture(1, {2.0, 1.0, 0.7}))[0].peak;
    for (std::uint64_t seed = 2; seed < 2U + static_cast<std::uint64_t>(test::trials(6)); ++seed) {
      CHECK(bench.match(picture(1, {}), picture(seed, {2.0, 1.0, 0.7}))[0].peak < 0.5F * same);
    }
  }

  TEST_CASE("steps of any size, and features kept for one role only, give the same bits") {
    const Picture a = centred(golden_picture(golden::kPictureA), 48, 50);
    const Picture b = centred(golden_picture(golden::kPictureB), 48, 50);
    Bench whole(config_of(50));
    const HypothesisList expected = whole.match(a, b);
    REQUIRE_FALSE(expected.empty());
    for (const std::uint16_t lines : std::initializer_list<std::uint16_t>{1, 3, 8, 13, 1000}) {
      MatcherConfig config = config_of(50);
      config.lines_per_step = lines;
      Bench sliced(config);
      CHECK(same_bits(sliced.match(a, b), expected));
    }
    const Features as_a = whole.extract(a, FeatureUse::as_a);
    const Features as_b = whole.extract(b, FeatureUse::as_b);
    CHECK(as_a.image.empty());
    CHECK(as_b.filter.empty());
    REQUIRE(whole.matcher.match(as_a, as_b) == Status::ok);
    CHECK(same_bits(whole.matcher.hypotheses(), expected));
  }

  TEST_CASE("a step is as short as configured, and a job ends once") {
    MatcherConfig config = config_of(48);
    config.lines_per_step = 8;
    Bench bench(config);
    const Picture picture = golden_picture(golden::kPictureA);
    CHECK(bench.matcher.step());
    Features features = bench.carve();
    REQUIRE(bench.matcher.begin_extract({picture.data(), picture.size()}, features) == Status::ok);
    int steps = 1;
    while (!bench.matcher.step()) {
      CHECK_FALSE(features.ready);
      ++steps;
    }
    // Load 6, edges (2 margins of 2 and twice 48 rows) 13, rows 6, columns 25 / 8 = 4, whitening 4, rings 3, scaling 3.
    CHECK(steps == 39);
    CHECK(features.ready);
    CHECK(bench.matcher.step());
  }

  TEST_CASE("fewer peaks and a threshold on rotations give a prefix of the work") {
    Bench bench(config_of(48));
    const Features a = bench.extract(golden_picture(golden::kPictureA));
    const Features b = bench.extract(golden_picture(golden::kPictureB));
    REQUIRE(bench.matcher.match(a, b) == Status::ok);
    const HypothesisList all = bench.matcher.hypotheses();
    REQUIRE(all.size() == 4);
    MatchOptions options;
    options.max_peaks = 1;
    REQUIRE(bench.matcher.match(a, b, options) == Status::ok);
    REQUIRE(bench.matcher.hypotheses().size() == 2);
    CHECK(bench.matcher.hypotheses()[0].peak == all[0].peak);
    options = {};
    options.min_rotation_peak = 0.6F;
    REQUIRE(bench.matcher.match(a, b, options) == Status::ok);
    CHECK(bench.matcher.hypotheses().size() == 2);
    options.min_rotation_peak = 0.9F;
    REQUIRE(bench.matcher.match(a, b, options) == Status::ok);
    CHECK(bench.matcher.hypotheses().empty());
  }

  TEST_CASE("what a configuration needs is known at compile time, and bytes used are bytes required") {
    constexpr MatcherConfig config = config_of(96);
    constexpr std::size_t coefficient = 2 * sizeof(float);
    static_assert(required_bytes(config, FeatureUse::as_b) ==
                  96 * 96 * sizeof(float) + 48 * 49 * coefficient);  // picture and rings
    static_assert(required_bytes(config, FeatureUse::both) - required_bytes(config, FeatureUse::as_b) ==
                  96 * 49 * coefficient);                               // filter
    static_assert(required_bytes(config) > 2 * 96 * 49 * coefficient);  // two spectra at least
    std::vector<double> words(required_bytes(config) / sizeof(double));
    Arena arena(Span<std::byte>(reinterpret_cast<std::byte*>(words.data()), required_bytes(config)));
    Matcher matcher;
    CHECK(matcher.init(config, Matcher::carve(arena, config)) == Status::ok);
    CHECK(arena.ok());
    CHECK(arena.use().total() == required_bytes(config));
  }

  TEST_CASE("observed free space counts against obstacles, the unobserved not at all") {
    MatcherConfig config = config_of(48);
    config.free_weight = 0.5F;
    Bench bench(config);
    Picture picture = golden_picture(golden::kPictureA);
    picture[20 * 48 + 20] = 255;
    picture[20 * 48 + 21] = 51;
    picture[20 * 48 + 22] = 0;
    std::vector<std::uint8_t> observed(mask_bytes(48), 0xFF);
    observed[(30 * 48 + 16) / 8] = 0;
    picture[30 * 48 + 16] = 51;
    Features features = bench.carve();
    REQUIRE(bench.matcher.extract({picture.data(), picture.size()}, features, {observed.data(), observed.size()}) ==
            Status::ok);
    CHECK(features.image[20 * 48 + 20] == doctest::Approx(1.0));
    CHECK(features.image[20 * 48 + 21] == doctest::Approx(0.2 - 0.5 * 0.8));
    CHECK(features.image[20 * 48 + 22] == doctest::Approx(-0.5));
    CHECK(features.image[30 * 48 + 16] == doctest::Approx(0.2));

    // Without a mask, or with no weight, it is the paper's picture: free and unobserved are the same.
    const Features paper = bench.extract(picture);
    CHECK(paper.image[20 * 48 + 22] == 0.0F);
    config.free_weight = 0.0F;
    Bench weightless(config);
    Features same = weightless.carve();
    REQUIRE(weightless.matcher.extract({picture.data(), picture.size()}, same, {observed.data(), observed.size()}) ==
            Status::ok);
    CHECK(std::equal(same.image.begin(), same.image.end(), paper.image.begin()));
    CHECK(std::memcmp(same.filter.data(), paper.filter.data(), same.filter.size() * sizeof(Complex)) == 0);

    // Free space without an obstacle is no structure, whatever its outline.
    const Picture flat(48 * 48, 0);
    CHECK(bench.matcher.extract({flat.data(), flat.size()}, features, {observed.data(), observed.size()}) ==
          Status::degenerate);
  }

  TEST_CASE("pictures without structure are degenerate and match nothing") {
    Bench bench(config_of(48));
    const Features good = bench.extract(golden_picture(golden::kPictureA));
    for (const std::uint8_t value : std::initializer_list<std::uint8_t>{0, 1, 128, 255}) {
      const Picture flat(48 * 48, value);
      Features features = bench.carve();
      CHECK(bench.matcher.extract({flat.data(), flat.size()}, features) == Status::degenerate);
      CHECK_FALSE(features.ready);
      CHECK(bench.matcher.match(good, features) == Status::degenerate);
      CHECK(bench.matcher.hypotheses().empty());
      CHECK(bench.matcher.match(features, good) == Status::degenerate);
    }
    // A flat picture written into features that were ready takes their readiness away.
    Features reused = good;
    const Picture flat(48 * 48, 0);
    CHECK(bench.matcher.extract({flat.data(), flat.size()}, reused) == Status::degenerate);
    CHECK_FALSE(reused.ready);
  }

  TEST_CASE("pictures with little or ambiguous structure give finite numbers") {
    const std::size_t side = 48;
    std::vector<Picture> pictures;
    const auto draw = [&](auto inside) {
      Picture picture(side * side);
      for (std::size_t i = 0; i < picture.size(); ++i) {
        const std::size_t row = i / side;
        const double x = static_cast<double>(i % side) - 23.5;
        const double y = static_cast<double>(row) - 23.5;
        picture[i] = inside(x, y) ? 255 : 0;
      }
      pictures.push_back(picture);
    };
    draw([](double x, double y) { return x == 3.5 && y == -8.5; });                           // one cell
    draw([](double x, double y) { return x == -23.5 && y == -23.5; });                        // in the corner
    draw([](double, double y) { return y == 4.5; });                                          // a straight wall
    draw([](double x, double y) { return std::fabs(std::hypot(x, y) - 12.0) < 0.7; });        // a circle
    draw([](double x, double y) { return std::fmax(std::fabs(x), std::fabs(y)) == 10.5; });   // a square
    draw([](double x, double y) { return static_cast<int>(x + 23.5 + y + 23.5) % 2 == 0; });  // a chessboard
    draw([](double x, double) { return x == -23.5; });                                        // the border
    pictures.push_back(Picture(side * side, 254));
    pictures.back()[700] = 255;  // the least contrast there is
    pictures.push_back(golden_picture(golden::kPictureA));
    Bench bench(config_of(side));
    for (const Picture& a : pictures) {
      for (const Picture& b : pictures) {
        Features fa = bench.carve();
        Features fb = bench.carve();
        const Status extracted_a = bench.matcher.extract({a.data(), a.size()}, fa);
        const Status extracted_b = bench.matcher.extract({b.data(), b.size()}, fb);
        const Status matched = bench.matcher.match(fa, fb);
        CHECK((matched == Status::ok) == (extracted_a == Status::ok && extracted_b == Status::ok));
        CHECK(all_finite(bench.matcher.hypotheses()));
      }
    }
    // A square looks the same at each quarter turn: the one that is true must be among the hypotheses.
    const HypothesisList square = bench.match(pictures[4], pictures[4]);
    bool identity = false;
    for (const Hypothesis& h : square) {
      identity = identity || (translation(h.a_T_b) < 0.1 && std::fabs(h.a_T_b.theta) < 0.01);
    }
    CHECK(identity);
  }

  TEST_CASE("the query's kept turns, however many, and every vector unit give the same bits") {
    MatcherConfig config = config_of(96, 0.4F);
    config.turns_per_bin = 4;
    std::vector<Picture> stored;
    for (int i = 0; i < 6; ++i) {
      stored.push_back(digest_of(render(office(1), {2.0 * i, -1.0 * i, 0.35 * i}, 384, 0.1, 17.0), 384, 96));
    }
    const Picture queries[] = {stored[2], digest_of(render(office(1), {1.0, 2.0, 0.3}, 384, 0.1, 17.0), 384, 96)};
    const auto run = [&](std::uint16_t kept, VectorUnit unit) {
      config.kept_turns = kept;
      Bench bench(config, unit);
      std::vector<Hypothesis> all;
      std::vector<Features> features;
      for (const Picture& picture : stored) {
        features.push_back(bench.extract(picture));
      }
      Features query = bench.carve();
      for (int pass = 0; pass < 2; ++pass) {  // the second query lies where the first did
        const Picture& picture = queries[pass];
        REQUIRE(bench.matcher.extract({picture.data(), picture.size()}, query) == Status::ok);
        bench.matcher.keep_turned(query);
        for (const Features& other : features) {
          REQUIRE(bench.matcher.match(other, query) == Status::ok);
          all.insert(all.end(), bench.matcher.hypotheses().begin(), bench.matcher.hypotheses().end());
        }
      }
      return all;
    };
    const std::vector<Hypothesis> plain = run(0, VectorUnit::portable);
#ifdef MELLIN_ON_TARGET
    constexpr std::uint16_t kMany = 40;  // a spectrum takes 37 kB
#else
    constexpr std::uint16_t kMany = 384;
#endif
    for (const std::uint16_t kept : {std::uint16_t{0}, std::uint16_t{1}, std::uint16_t{5}, kMany}) {
      CAPTURE(kept);
      const std::vector<Hypothesis> found = run(kept, best_vector_unit());
      REQUIRE(found.size() == plain.size());
      for (std::size_t i = 0; i < found.size(); ++i) {
        CHECK(found[i].a_T_b.x == plain[i].a_T_b.x);
        CHECK(found[i].a_T_b.y == plain[i].a_T_b.y);
        CHECK(found[i].a_T_b.theta == plain[i].a_T_b.theta);
        CHECK(found[i].peak == plain[i].peak);
        const double steps = plain[i].a_T_b.theta / (kPi / (96 * 4));
        CHECK(std::fabs(steps - std::round(steps)) < 1e-6);
      }
    }
  }

  TEST_CASE("hypotheses are sorted and distinct") {
    Bench bench(config_of(96, 0.4F));
    const HypothesisList found = bench.match(digest_of(render(office(3), {}, 384, 0.1, 17.0), 384, 96),
                                             digest_of(render(office(4), {1.0, 2.0, 0.3}, 384, 0.1, 17.0), 384, 96));
    for (std::size_t i = 1; i < found.size(); ++i) {
      CHECK(found[i - 1].peak >= found[i].peak);
      for (std::size_t k = 0; k < i; ++k) {
        const Error difference = error_of(found[i].a_T_b, found[k].a_T_b);
        CHECK((difference.metres >= 0.4 || difference.radians >= kPi / 96));
      }
    }
  }

  TEST_CASE("other settings: without low-pass, without high-pass, centre of mass off and wide") {
    for (int variant = 0; variant < test::trials(4); ++variant) {
      CAPTURE(variant);
      MatcherConfig config = config_of(96, 0.4F);
      config.lowpass_sigma = variant == 0 ? 0.0F : 0.25F;
      config.high_pass = variant == 1 ? HighPass::none : HighPass::radius;
      config.peak_fit = variant < 2 ? PeakFit::gaussian : PeakFit::centre_of_mass;
      config.com_radius = static_cast<std::uint8_t>(variant == 2 ? 0 : (variant == 3 ? 3 : 1));
      Bench bench(config);
      const Pose2 a_T_b{1.7, -2.2, 2.5};
      const HypothesisList found = bench.match(digest_of(render(office(1), {}, 384, 0.1, 17.0), 384, 96),
                                               digest_of(render(office(1), a_T_b, 384, 0.1, 17.0), 384, 96));
      CHECK(error_of(found[0].a_T_b, a_T_b).metres < 2 * 0.4);
      CHECK(error_of(found[0].a_T_b, a_T_b).radians < 2 * kPi / 96);
    }
  }

  TEST_CASE("configurations outside their limits and too little memory are refused") {
    const auto with = [](auto change) {
      MatcherConfig config;
      change(config);
      return config;
    };
    CHECK(is_valid(MatcherConfig{}));
    const MatcherConfig wrong[] = {with([](auto& c) { c.side = 98; }),
                                   with([](auto& c) { c.pixel_m = 0.0F; }),
                                   with([](auto& c) { c.pixel_m = NAN; }),
                                   with([](auto& c) { c.peak_share = 1.5F; }),
                                   with([](auto& c) { c.max_peaks = 7; }),
                                   with([](auto& c) { c.max_peaks = 0; }),
                                   with([](auto& c) { c.com_radius = 4; }),
                                   with([](auto& c) { c.lowpass_sigma = -1.0F; }),
                                   with([](auto& c) { c.whitening_floor = 0.0F; }),
                                   with([](auto& c) { c.edge_margin = NAN; }),
                                   with([](auto& c) { c.rotation = static_cast<RotationMode>(4); }),
                                   with([](auto& c) { c.high_pass = static_cast<HighPass>(3); }),
                                   with([](auto& c) { c.peak_fit = static_cast<PeakFit>(2); }),
                                   with([](auto& c) { c.preprocessing = static_cast<Preprocessing>(3); }),
                                   with([](auto& c) { c.min_peak = -0.1F; }),
                                   with([](auto& c) { c.min_overlap = 0.0F; }),
                                   with([](auto& c) { c.turns_per_bin = 9; }),
                                   with([](auto& c) { c.kept_turns = 1; }),
                                   with([](auto& c) {
                                     c.turns_per_bin = 2;
                                     c.kept_turns = 2 * 96 + 1;
                                   })};
    for (const MatcherConfig& config : wrong) {
      Matcher matcher;
      CHECK(matcher.init(config, {}) == Status::invalid_config);
    }
    Matcher matcher;
    CHECK(matcher.init(MatcherConfig{}, {}) == Status::insufficient_memory);
  }
}
