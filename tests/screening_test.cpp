// The screening cascade on submaps of the simulated floor: what its stages drop, and that they change nothing else.
#include "mellin/collection/screening.hpp"

#include <doctest.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "support/carved.hpp"
#include "support/submaps.hpp"

using namespace mellin;

namespace {

constexpr std::uint32_t kSubmaps = 5;

/// Submap 1 is 0's place with other scans, turned by 1.1; the others lie elsewhere; the last is empty.
const std::vector<std::vector<std::uint8_t>>& grids() {
  static const std::vector<std::vector<std::uint8_t>> made = [] {
    const std::vector<host::PosedScan> scans = test::simulated_scans(3);
    std::vector<std::vector<std::uint8_t>> out;
    out.push_back(test::submap(scans, 0, 20, 2, 0.0).cells);
    out.push_back(test::submap(scans, 1, 20, 2, 1.1).cells);
    out.push_back(test::submap(scans, scans.size() / 2, 40, 1, 0.4).cells);
    out.push_back(test::submap(scans, scans.size() - 40, 40, 1, -2.0).cells);
    out.emplace_back(out[0].size(), kUnobserved);
    return out;
  }();
  return made;
}

using Pair = std::pair<std::uint32_t, std::uint32_t>;
constexpr Pair kPairs[] = {{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}};

ScreeningConfig plain() {
  ScreeningConfig config;
  config.max_submaps = kSubmaps;
  config.min_rotation_peak = 0.0F;
  config.verified = 255;
  return config;
}

class Bench {
 public:
  explicit Bench(const ScreeningConfig& config) {
    REQUIRE(screening_.init(config, test::give<SpectralScreening>(words_, config)) == Status::ok);
    for (std::uint32_t i = 0; i < kSubmaps; ++i) {
      REQUIRE(screening_.begin_describe(i, {{grids()[i].data(), grids()[i].size()}, 768, 0.05F}) == Status::ok);
      finish();
    }
  }
  const PlaceHypotheses& compare(std::uint32_t a, std::uint32_t b, bool thorough = false) {
    (void)screening_.begin_compare(a, b, thorough);
    finish();
    return screening_.hypotheses();
  }
  CompareEnd end() const { return screening_.compare_end(); }

 private:
  void finish() {
    for (int i = 0; i < 1'000'000; ++i) {
      if (screening_.step()) {
        return;
      }
    }
    FAIL("a job that does not end");
  }
  std::vector<std::uint64_t> words_;
  SpectralScreening screening_;
};

bool same_bits(const PlaceHypotheses& a, const PlaceHypotheses& b) {
  bool same = a.size() == b.size();
  for (std::size_t i = 0; same && i < a.size(); ++i) {
    same = a[i].a_T_b.x == b[i].a_T_b.x && a[i].a_T_b.y == b[i].a_T_b.y && a[i].a_T_b.theta == b[i].a_T_b.theta &&
           a[i].peak == b[i].peak && a[i].agreement == b[i].agreement;
  }
  return same;
}

/// Whether all pairs give the same in both, in the order in which a collection asks.
bool same_results(const ScreeningConfig& one, const ScreeningConfig& other) {
  Bench first(one);
  Bench second(other);
  bool same = true;
  for (std::uint32_t b = 0; b < kSubmaps; ++b) {
    for (std::uint32_t a = 0; a < b; ++a) {
      same = same && same_bits(first.compare(a, b), second.compare(a, b)) && first.end() == second.end();
    }
  }
  return same;
}

}  // namespace

TEST_SUITE("screening") {
  TEST_CASE("half a digest: obstacles thickened and halved, masks by the majority of the observed pixels") {
    constexpr std::uint16_t kSide = 8;
    std::vector<std::uint8_t> obstacles(64, 0);
    std::vector<std::uint8_t> observed(8, 0);
    std::vector<std::uint8_t> free(8, 0);
    obstacles[2 * 8 + 3] = 100;  // thickened: columns 2 to 4, rows 1 to 3
    observed[0] = 0b00000011;    // row 0: columns 0 and 1
    observed[2] = 0b00111101;    // row 2: columns 0, 2 to 5
    observed[3] = 0b00111100;
    free[0] = 0b00000011;
    free[2] = 0b00110101;  // column 3 holds the obstacle
    free[3] = 0b00111100;
    std::vector<std::uint8_t> half(16 + 4);
    const Span<std::uint8_t> bytes{half.data(), half.size()};
    std::vector<float> scratch(64);
    const DigestOut out{bytes.first(16), bytes.subspan(16, 2), bytes.subspan(18, 2), 4};
    const DigestView digest{{obstacles.data(), 64}, {observed.data(), 8}, {free.data(), 8}, kSide, 0.4F};
    REQUIRE(halve_digest(digest, {scratch.data(), 64}, out) == Status::ok);
    // Means of four: (1, 0) has two of its pixels set, (1, 1) all four, (2, 0) one, (2, 1) two; the largest is 255.
    const std::vector<std::uint8_t> expected = {0, 128, 64, 0, 0, 255, 128, 0, 0, 0, 0, 0, 0, 0, 0, 0};
    CHECK(std::vector<std::uint8_t>(half.begin(), half.begin() + 16) == expected);
    // (0, 0) has two observed, (0, 1) only one, (1, 1) and (2, 1) all four, one of (1, 1) not free.
    CHECK(half[16] == 0b01100001);
    CHECK(half[17] == 0);
    CHECK(half[18] == 0b01000001);
    CHECK(half[19] == 0);
    CHECK(halve_digest(digest, {scratch.data(), 63}, out) == Status::invalid_argument);
  }

  TEST_CASE("stages that drop nothing change nothing, and neither does caching") {
    ScreeningConfig staged = plain();
    staged.coarse_peaks = 2;
    CHECK(same_results(plain(), staged));
    ScreeningConfig uncached = plain();
    uncached.min_rotation_peak = 0.35F;
    uncached.cache_features = false;
    ScreeningConfig cached = uncached;
    cached.cache_features = true;
    CHECK(same_results(uncached, cached));
    ScreeningConfig kept = cached;
    kept.coarse_peaks = 1;
    kept.coarse_peak = 0.15F;
    kept.matcher.turns_per_bin = 4;
    ScreeningConfig made_anew = kept;
    kept.matcher.kept_turns = 384;
    CHECK(same_results(kept, made_anew));
  }

  TEST_CASE("peaks one after the other find what they find together") {
    ScreeningConfig by_one = plain();
    by_one.matcher.max_peaks = 3;
    ScreeningConfig together = by_one;
    by_one.first_peaks = 1;
    Bench first(by_one);
    Bench second(together);
    for (std::uint32_t b = 1; b < 4; ++b) {
      for (std::uint32_t a = 0; a < b; ++a) {
        CHECK(same_bits(first.compare(a, b), second.compare(a, b)));
        CHECK(first.end() == CompareEnd::compared);
      }
    }
  }

  TEST_CASE("each stage drops the pairs below its threshold, and none where it shall be thorough") {
    ScreeningConfig strict = plain();  // its hypotheses are what the stage judges by
    ScreeningConfig config = plain();
    float* threshold = nullptr;
    bool by_peak = false;
    CompareEnd expected = CompareEnd::coarse;
    SUBCASE("coarse peak") {
      config.coarse_peaks = strict.coarse_peaks = 2;
      strict.coarse_agreement = 1.0F;
      threshold = &config.coarse_peak;
      by_peak = true;
    }
    SUBCASE("coarse agreement") {
      config.coarse_peaks = strict.coarse_peaks = 2;
      strict.coarse_agreement = 1.0F;
      threshold = &config.coarse_agreement;
    }
    SUBCASE("first peaks") {
      config.matcher.peak_share = 0.0F;
      config.matcher.max_peaks = 6;
      config.first_peaks = 1;
      strict.matcher.max_peaks = 1;
      threshold = &config.further_agreement;
      expected = CompareEnd::first_peaks;
    }
    std::vector<float> judged;
    Bench judge(strict);
    for (const Pair& pair : kPairs) {
      const PlaceHypotheses& found = judge.compare(pair.first, pair.second);
      REQUIRE_FALSE(found.empty());
      judged.push_back(by_peak ? found[0].peak : found[0].agreement);
    }
    const auto [least, most] = std::minmax_element(judged.begin(), judged.end());
    *threshold = 0.5F * (*least + *most);
    REQUIRE(*least < *threshold);
    Bench bench(config);
    for (std::size_t i = 0; i < judged.size(); ++i) {
      (void)bench.compare(kPairs[i].first, kPairs[i].second);
      CHECK(bench.end() == (judged[i] < *threshold ? expected : CompareEnd::compared));
      (void)bench.compare(kPairs[i].first, kPairs[i].second, true);
      CHECK(bench.end() == CompareEnd::compared);
    }
  }

  TEST_CASE("pairs without a rotation that stands out are dropped, a place seen again is not") {
    ScreeningConfig config = plain();
    Bench all(config);
    config.min_rotation_peak = 0.6F;
    Bench bench(config);
    const PlaceHypotheses seen_again = all.compare(0, 1);
    CHECK(bench.compare(0, 1)[0].agreement == seen_again[0].agreement);
    CHECK(bench.end() == CompareEnd::compared);
    int dropped = 0;
    for (const Pair& pair : kPairs) {
      const bool empty = bench.compare(pair.first, pair.second).empty();
      CHECK(bench.end() == (empty ? CompareEnd::rotation : CompareEnd::compared));
      dropped += empty ? 1 : 0;
      CHECK(same_bits(bench.compare(pair.first, pair.second, true), all.compare(pair.first, pair.second)));
      CHECK(bench.end() == CompareEnd::compared);
    }
    CHECK(dropped > 0);
  }

  TEST_CASE("fewer hypotheses are looked at where the strongest stands out") {
    ScreeningConfig config = plain();
    Bench all(config);
    config.verified_share = 1.0F;
    Bench strongest(config);
    CHECK(all.compare(2, 3).size() > 1);
    CHECK(strongest.compare(2, 3).size() == 1);
  }

  TEST_CASE("an empty submap matches nothing, with a coarse stage as without") {
    ScreeningConfig config = plain();
    config.coarse_peaks = 1;
    config.coarse_agreement = 0.1F;
    Bench bench(config);
    CHECK(bench.compare(0, 4).empty());
    CHECK(bench.compare(4, 4).empty());
  }

  TEST_CASE("a coarse stage without cached features, or of a side that is none of a transform, is refused") {
    ScreeningConfig config = plain();
    config.coarse_peaks = 1;
    config.cache_features = false;
    std::vector<std::uint64_t> words;
    SpectralScreening screening;
    CHECK(screening.init(config, test::give<SpectralScreening>(words, config)) == Status::invalid_config);
    config.cache_features = true;
    config.grid_side = 384;
    config.matcher.side = 48;
    CHECK(screening.init(config, test::give<SpectralScreening>(words, config)) == Status::invalid_config);
  }
}
