#include "mellin/graph/consistency.hpp"

#include <doctest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "graph_rig.hpp"
#include "tests/support/trials.hpp"

using namespace mellin;

namespace {

std::uint32_t count(std::uint64_t set) { return static_cast<std::uint32_t>(__builtin_popcountll(set)); }

bool is_clique(const LinkMatrix& links, std::uint64_t set) {
  for (int i = 0; i < 64; ++i) {
    if ((set >> i & 1U) != 0 && (set & ~links.rows[i]) != std::uint64_t{1} << i) {
      return false;
    }
  }
  return true;
}

/// The size of the largest clique, by trying all subsets.
std::uint32_t brute_force(const LinkMatrix& links, std::uint32_t vertices) {
  std::uint32_t best = 0;
  for (std::uint64_t set = 0; set < std::uint64_t{1} << vertices; ++set) {
    if (count(set) > best && is_clique(links, set)) {
      best = count(set);
    }
  }
  return best;
}

LinkMatrix random_links(std::uint32_t vertices, double density, std::uint64_t seed) {
  Random random(seed, 6);
  LinkMatrix links;
  for (std::uint32_t i = 0; i < vertices; ++i) {
    for (std::uint32_t j = i + 1; j < vertices; ++j) {
      if (random.uniform() < density) {
        links.rows[i] |= std::uint64_t{1} << j;
        links.rows[j] |= std::uint64_t{1} << i;
      }
    }
  }
  return links;
}

/// A map whose nodes are known exactly up to a covariance: nodes under 100 form one component, the others a second.
struct KnownMap {
  std::vector<Pose2> poses;
  Sym3 covariance = diagonal(1e-4, 1e-4, 1e-5);
  int calls = 0;

  static Status relative(void* context, NodeId from, NodeId to, RelativePose& out) {
    KnownMap& map = *static_cast<KnownMap*>(context);
    ++map.calls;
    if ((from < 100) != (to < 100)) {
      return Status::degenerate;
    }
    out = {between(map.poses[from], map.poses[to]), map.covariance};
    return Status::ok;
  }
  MapQuery query() { return {this, &relative, nullptr}; }
};

KnownMap two_sessions() {
  KnownMap map;
  for (int i = 0; i < 200; ++i) {
    map.poses.push_back({0.7 * (i % 100), 0.3 * (i % 7), 0.4 * i});
  }
  return map;
}

const Sym3 kMatch = diagonal(0.0025, 0.0025, 0.0004);

/// "b lies there in a" with the second session shifted by `offset` against the first.
LoopHypothesis hypothesis(const KnownMap& map, NodeId a, NodeId b, const Pose2& offset, std::uint32_t witness) {
  LoopHypothesis h;
  h.a = a;
  h.b = b;
  h.measured = {between(map.poses[a], compose(offset, map.poses[b])), kMatch};
  h.witness = witness;
  return h;
}

Span<const LoopHypothesis> span(const std::vector<LoopHypothesis>& all) { return {all.data(), all.size()}; }

}  // namespace

TEST_CASE("the maximum clique is that of a search over all subsets") {
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    const std::uint32_t vertices = 3 + static_cast<std::uint32_t>(seed % 11);
    const LinkMatrix links = random_links(vertices, 0.2 + 0.012 * static_cast<double>(seed), seed);
    std::uint32_t limit = 20000;
    const std::uint64_t clique = maximum_clique(links, (std::uint64_t{1} << vertices) - 1, limit);
    CHECK(is_clique(links, clique));
    CHECK(count(clique) == brute_force(links, vertices));
    CHECK(limit > 0);
  }
}

TEST_CASE("of the candidates only is a clique taken, and a planted one among 64 is found") {
  LinkMatrix links = random_links(64, 0.3, 99);
  const std::uint64_t planted = 0x8421084210842109U;
  for (int i = 0; i < 64; ++i) {
    if ((planted >> i & 1U) != 0) {
      links.rows[i] |= planted & ~(std::uint64_t{1} << i);
    }
  }
  std::uint32_t limit = 20000;
  CHECK(maximum_clique(links, ~std::uint64_t{0}, limit) == planted);
  CHECK(limit > 0);
  limit = 20000;
  const std::uint64_t within = 0xFFFFFFFF00000000U;
  const std::uint64_t clique = maximum_clique(links, within, limit);
  CHECK((clique & ~within) == 0);
  CHECK(count(clique) == count(planted & within));
}

TEST_CASE("at its limit the search still returns a clique no smaller than the greedy one") {
  const LinkMatrix links = random_links(64, 0.9, 5);
  std::uint32_t none = 0;
  const std::uint64_t greedy = maximum_clique(links, ~std::uint64_t{0}, none);
  std::uint32_t limit = 50;
  const std::uint64_t clique = maximum_clique(links, ~std::uint64_t{0}, limit);
  CHECK(limit == 0);
  CHECK(is_clique(links, greedy));
  CHECK(is_clique(links, clique));
  CHECK(count(greedy) > 5);
  CHECK(count(clique) >= count(greedy));
}

TEST_CASE("chi2 of the identity") {
  CHECK(identity_chi2({0.1, 0.0, 0.0}, diagonal(0.01, 1.0, 1.0)) == doctest::Approx(1.0));
  CHECK(identity_chi2({0.0, 0.0, kTwoPi + 0.2}, diagonal(1.0, 1.0, 0.01)) == doctest::Approx(4.0));
  CHECK(std::isinf(identity_chi2({}, diagonal(1.0, 0.0, 1.0))));
}

TEST_CASE("chi2 of a true pair follows its distribution, three degrees of freedom") {
  // Errors drawn with the covariances given: mean 3, variance 6, one in a hundred over 11.345.
  Random random(11, 0);
  const Pose2 a1 = {0.0, 0.0, 0.3};
  const Pose2 a2 = {3.0, 1.0, -1.0};
  const Pose2 b1 = {0.5, 0.2, 2.0};
  const Pose2 b2 = {2.5, 1.4, 0.5};
  const auto measure = [&](const Pose2& from, const Pose2& to, double metres, double radians) {
    const Pose2 exact = between(from, to);
    const Pose2 error = test::noise(random, metres, radians);
    return RelativePose{{exact.x + error.x, exact.y + error.y, exact.theta + error.theta},
                        diagonal(metres * metres, metres * metres, radians * radians)};
  };
  double sum = 0.0;
  int beyond = 0;
  constexpr int kDraws = test::trials(20000);
  const double looser = std::sqrt(20000.0 / kDraws);  // the mean of fewer draws is less sure
  for (int i = 0; i < kDraws; ++i) {
    const double chi2 = pair_chi2(measure(a1, b1, 0.05, 0.02), measure(b1, b2, 0.02, 0.01), measure(a2, b2, 0.04, 0.03),
                                  measure(a2, a1, 0.03, 0.01));
    sum += chi2;
    beyond += chi2 > 11.345 ? 1 : 0;
  }
  CHECK(sum / kDraws == doctest::Approx(3.0).epsilon(0.03 * looser));
  CHECK(std::fabs(static_cast<double>(beyond) / kDraws - 0.01) < 0.004 * looser);
  CHECK(hypothesis_chi2({{1.0, 0.0, 0.0}, diagonal(0.01, 0.01, 0.01)}, {{1.3, 0.0, 0.0}, diagonal(0.02, 0.01, 0.01)}) ==
        doctest::Approx(0.09 / (0.03)));
}

TEST_CASE("true hypotheses are told from scattered and from fewer agreeing false ones") {
  KnownMap map = two_sessions();
  Random random(4, 2);
  const Pose2 truth = {4.0, -2.0, 0.7};
  const Pose2 mirage = {-30.0, 11.0, -1.9};
  std::vector<LoopHypothesis> all;
  std::uint64_t right = 0;
  for (std::uint32_t i = 0; i < 30; ++i) {
    const NodeId a = 3 * i;
    const NodeId b = 100 + (37 * i) % 100;
    Pose2 offset = {20.0 * random.normal(), 20.0 * random.normal(), 3.0 * random.normal()};
    if (i % 5 == 1 || i % 5 == 3) {
      offset = compose(truth, test::noise(random, 0.002, 0.0005));
      right |= std::uint64_t{1} << i;
    } else if (i % 5 == 2) {
      offset = mirage;
    }
    all.push_back(hypothesis(map, a, b, offset, i));
    if (i % 3 == 0) {  // the ends may stand in either order
      LoopHypothesis& h = all.back();
      h.measured = {inverse(h.measured.a_T_b), inverse_covariance(h.measured.a_T_b, h.measured.covariance)};
      std::swap(h.a, h.b);
    }
  }
  const Result<ConsistentSet> set = find_consistent(span(all), map.query(), {});
  REQUIRE(set.ok());
  CHECK(set.value().members == right);
  CHECK(set.value().member_count == 12);
  CHECK(set.value().witness_count == 12);
  CHECK(set.value().exact);
  CHECK(map.calls <= 4 * 30 * 29 / 2);
}

TEST_CASE("hypotheses that share scans count as one witness") {
  KnownMap map = two_sessions();
  std::vector<LoopHypothesis> all;
  const Pose2 many_of_one = {9.0, 9.0, 1.0};
  const Pose2 few_of_several = {-5.0, 3.0, 0.0};
  for (std::uint32_t i = 0; i < 5; ++i) {
    all.push_back(hypothesis(map, 10 + i, 150 + i, many_of_one, 77));
  }
  for (std::uint32_t i = 0; i < 3; ++i) {
    all.push_back(hypothesis(map, 40 + 9 * i, 110 + 9 * i, few_of_several, i / 2));
  }
  const ConsistentSet set = find_consistent(span(all), map.query(), {}).value();
  CHECK(set.members == 0b11100000U);
  CHECK(set.member_count == 3);
  CHECK(set.witness_count == 2);

  // By a predicate that is not transitive: neighbours share scans, so of three in a row the outer two are independent.
  MapQuery query = map.query();
  query.share_scans = [](void*, const LoopHypothesis& first, const LoopHypothesis& second) {
    return std::abs(static_cast<int>(first.a) - static_cast<int>(second.a)) <= 1;
  };
  const ConsistentSet by_overlap = find_consistent(span(all).first(5), query, {}).value();
  CHECK(by_overlap.member_count == 5);
  CHECK(by_overlap.witness_count == 3);
  CHECK(by_overlap.witnesses == 0b10101U);
}

TEST_CASE("few or no hypotheses, and ones that cannot be") {
  KnownMap map = two_sessions();
  CHECK(find_consistent({}, map.query(), {}).value().member_count == 0);
  std::vector<LoopHypothesis> all = {hypothesis(map, 1, 101, {}, 0)};
  CHECK(find_consistent(span(all), map.query(), {}).value().witness_count == 1);
  CHECK(find_consistent(span(all), {}, {}).status() == Status::invalid_argument);
  ConsistencyOptions options;
  options.gate_chi2 = std::numeric_limits<double>::quiet_NaN();
  CHECK(find_consistent(span(all), map.query(), options).status() == Status::invalid_argument);
  all[0].measured.a_T_b.x = std::numeric_limits<double>::quiet_NaN();
  CHECK(find_consistent(span(all), map.query(), {}).status() == Status::bad_data);
  all[0] = hypothesis(map, 1, 101, {}, 0);
  all[0].measured.covariance = diagonal(0.0, 1.0, 1.0);
  CHECK(find_consistent(span(all), map.query(), {}).status() == Status::bad_data);
  all.assign(65, hypothesis(map, 1, 101, {}, 0));
  CHECK(find_consistent(span(all), map.query(), {}).status() == Status::invalid_argument);
  all.pop_back();
  const ConsistentSet same = find_consistent(span(all), map.query(), {}).value();
  CHECK(same.member_count == 64);
  CHECK(same.witness_count == 1);
}
