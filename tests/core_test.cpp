#include <doctest.h>

#include <cmath>
#include <string>

#include "mellin/core/arena.hpp"
#include "mellin/core/containers.hpp"
#include "mellin/core/log.hpp"
#include "mellin/core/math.hpp"
#include "mellin/core/random.hpp"
#include "mellin/core/se2.hpp"
#include "mellin/core/status.hpp"
#include "tests/support/trials.hpp"

using namespace mellin;

TEST_CASE("poses: composition, inverse and between belong together") {
  const Pose2 a{1.0, 2.0, 0.3};
  const Pose2 b{-0.5, 4.0, -2.9};
  const Pose2 ab = compose(a, b);
  const Pose2 back = between(a, ab);
  CHECK(back.x == doctest::Approx(b.x));
  CHECK(back.y == doctest::Approx(b.y));
  CHECK(back.theta == doctest::Approx(b.theta));
  const Pose2 none = compose(a, inverse(a));
  CHECK(none.x == doctest::Approx(0.0));
  CHECK(none.y == doctest::Approx(0.0));
  CHECK(none.theta == doctest::Approx(0.0));
  const Pose2 quarter = compose({0.0, 0.0, kHalfPi}, {1.0, 0.0, 0.0});
  CHECK(quarter.x == doctest::Approx(0.0));
  CHECK(quarter.y == doctest::Approx(1.0));
}

TEST_CASE("symmetric matrices: inverse times matrix is the identity, and what has none is refused") {
  const Sym3 m{4.0, 1.0, 0.5, 3.0, -0.2, 2.0};
  Sym3 inv;
  REQUIRE(invert(m, inv));
  CHECK(m.xx * inv.xx + m.xy * inv.xy + m.xt * inv.xt == doctest::Approx(1.0));
  CHECK(m.xx * inv.xy + m.xy * inv.yy + m.xt * inv.yt == doctest::Approx(0.0));
  CHECK(m.xt * inv.xt + m.yt * inv.yt + m.tt * inv.tt == doctest::Approx(1.0));
  CHECK_FALSE(invert(diagonal(1.0, 0.0, 1.0), inv));
  CHECK_FALSE(invert(diagonal(1.0, NAN, 1.0), inv));
}

TEST_CASE("covariance of a composition agrees with sampling") {
  const Pose2 ab{2.0, -1.0, 0.7};
  const Pose2 bc{3.0, 0.5, -0.4};
  const Sym3 cov_ab{1e-4, 2e-5, 1e-5, 4e-4, -1e-5, 9e-6};
  const Sym3 cov_bc = diagonal(1e-4, 2e-4, 4e-6);
  const Sym3 expected = compose_covariance(ab, cov_ab, bc, cov_bc);
  // Cholesky of cov_ab, to draw from it.
  const double l11 = std::sqrt(cov_ab.xx), l21 = cov_ab.xy / l11, l31 = cov_ab.xt / l11;
  const double l22 = std::sqrt(cov_ab.yy - l21 * l21), l32 = (cov_ab.yt - l31 * l21) / l22;
  const double l33 = std::sqrt(cov_ab.tt - l31 * l31 - l32 * l32);
  Random random(1, 2);
  const Pose2 mean = compose(ab, bc);
  double xx = 0.0, xt = 0.0, yy = 0.0, tt = 0.0;
  constexpr int kDraws = test::trials(200000);
  const double looser = std::sqrt(200000.0 / kDraws);  // the mean of fewer draws is less sure
  for (int i = 0; i < kDraws; ++i) {
    const double u = random.normal(), v = random.normal(), w = random.normal();
    const Pose2 first{ab.x + l11 * u, ab.y + l21 * u + l22 * v, ab.theta + l31 * u + l32 * v + l33 * w};
    const Pose2 second{bc.x + 1e-2 * random.normal(), bc.y + std::sqrt(2e-4) * random.normal(),
                       bc.theta + 2e-3 * random.normal()};
    const Pose2 c = compose(first, second);
    const double dx = c.x - mean.x, dy = c.y - mean.y, dt = wrap_angle(c.theta - mean.theta);
    xx += dx * dx, xt += dx * dt, yy += dy * dy, tt += dt * dt;
  }
  CHECK(xx / kDraws == doctest::Approx(expected.xx).epsilon(0.03 * looser));
  CHECK(xt / kDraws == doctest::Approx(expected.xt).epsilon(0.05 * looser));
  CHECK(yy / kDraws == doctest::Approx(expected.yy).epsilon(0.03 * looser));
  CHECK(tt / kDraws == doctest::Approx(expected.tt).epsilon(0.03 * looser));
  const Sym3 twice = inverse_covariance(inverse(ab), inverse_covariance(ab, cov_ab));
  CHECK(twice.xx == doctest::Approx(cov_ab.xx));
  CHECK(twice.xt == doctest::Approx(cov_ab.xt));
  CHECK(twice.yt == doctest::Approx(cov_ab.yt));
}

TEST_CASE("random numbers: a stream depends on its seed and name only, and is distributed as it says") {
  Random a(7, 1), b(7, 1), c(7, 2), d(8, 1);
  const std::uint64_t first = a.bits();
  CHECK(first == b.bits());
  CHECK(first != c.bits());
  CHECK(first != d.bits());
  double sum = 0.0, squares = 0.0, cubes = 0.0, fourth = 0.0;
  constexpr int kDraws = test::trials(400000);
  const double looser = std::sqrt(400000.0 / kDraws);
  for (int i = 0; i < kDraws; ++i) {
    const double x = a.normal();
    sum += x, squares += x * x, cubes += x * x * x, fourth += x * x * x * x;
  }
  CHECK(std::fabs(sum / kDraws) < 0.01 * looser);
  CHECK(squares / kDraws == doctest::Approx(1.0).epsilon(0.01 * looser));
  CHECK(std::fabs(cubes / kDraws) < 0.02 * looser);
  CHECK(fourth / kDraws == doctest::Approx(3.0).epsilon(0.02 * looser));
}

TEST_CASE("arena: what no size_t can count is measured as the largest, not as little") {
  constexpr std::size_t most = ~std::size_t{0};
  MeasureArena one;
  (void)one.take<double>(most / 8 + 1, Part::grid);  // 8 times that wraps to 0
  CHECK(one.use().total() == most);
  MeasureArena sum;
  (void)sum.take<std::uint8_t>(most / 2, Part::grid);
  (void)sum.take<std::uint8_t>(most / 2, Part::grid, Region::fast);
  (void)sum.take<std::uint8_t>(most / 2, Part::graph);
  CHECK(sum.use().bulk == most);
  CHECK(sum.use().total() == most);
  CHECK(sum.use().by_part[static_cast<int>(Part::graph)] >= most / 2);
  std::uint64_t memory[4];
  Arena arena({reinterpret_cast<std::byte*>(memory), sizeof memory});
  CHECK(arena.take<double>(most / 8 + 1, Part::grid).empty());
  CHECK_FALSE(arena.ok());
}

TEST_CASE("arena: what is measured is what is used, and one byte less is refused") {
  const auto carve = [](auto& arena) {
    (void)arena.template take<std::uint8_t>(13, Part::grid);
    (void)arena.template take<double>(3, Part::graph);
    return arena.template take<std::uint16_t>(5, Part::grid, Region::fast);
  };
  MeasureArena measure;
  CHECK(carve(measure).size() == 5);
  CHECK(measure.use().total() == 16 + 24 + 16);
  CHECK(measure.use().by_part[static_cast<int>(Part::grid)] == 32);
  alignas(kArenaAlignment) std::byte memory[56];
  Arena exact{Span<std::byte>(memory, 56)};
  CHECK(carve(exact).size() == 5);
  CHECK(exact.ok());
  CHECK(exact.use().total() == measure.use().total());
  Arena short_by_one{Span<std::byte>(memory, 55)};
  (void)carve(short_by_one);
  CHECK_FALSE(short_by_one.ok());
  Arena split{Span<std::byte>(memory, 40), Span<std::byte>(memory + 40, 16)};
  (void)carve(split);
  CHECK(split.ok());
}

TEST_CASE("arena: those who take turns in a workspace start at its beginning, and the largest decides its size") {
  const auto one = [](auto& arena) { return arena.template take<double>(5, Part::graph); };
  const auto other = [](auto& arena) {
    (void)arena.template take<std::uint8_t>(8, Part::spectral, Region::fast);
    return arena.template take<std::uint32_t>(3, Part::spectral);
  };
  const ArenaUse largest = larger(measured(one), measured(other));
  CHECK(largest.bulk == 40);
  CHECK(largest.fast == 8);
  MeasureArena measure;
  MeasureArena turn = measure.over(measure.take_workspace(largest));
  CHECK(one(turn).size() == 5);
  CHECK(measure.use().total() == 48);
  CHECK(measure.use().by_part[static_cast<int>(Part::workspace)] == 48);
  alignas(kArenaAlignment) std::byte memory[48];
  Arena arena{Span<std::byte>(memory, 48)};
  const Workspace workspace = arena.take_workspace(largest);
  CHECK(arena.ok());
  Arena first = arena.over(workspace);
  Arena second = arena.over(workspace);
  CHECK(static_cast<void*>(one(first).data()) == static_cast<void*>(memory));
  CHECK(static_cast<void*>(other(second).data()) == static_cast<void*>(memory));
  CHECK(first.ok());
  CHECK(second.ok());
}

TEST_CASE("ring: first in, first out across the seam") {
  int memory[3] = {};
  Ring<int> ring{Span<int>(memory)};
  ring.push(1);
  ring.push(2);
  ring.pop();
  ring.push(3);
  ring.push(4);
  CHECK(ring.full());
  CHECK(ring[0] == 2);
  CHECK(ring[1] == 3);
  CHECK(ring.back() == 4);
}

TEST_CASE("fixed list: sorted insertion drops the last when full") {
  FixedList<int, 3> list;
  CHECK(list.push(10));
  CHECK(list.push(20));
  CHECK(list.push(30));
  CHECK_FALSE(list.push(40));
  list.insert(1, 15);
  CHECK(list[0] == 10);
  CHECK(list[1] == 15);
  CHECK(list[2] == 20);
  list.insert(3, 99);
  CHECK(list[2] == 20);
}

TEST_CASE("log lines: numbers are written without printf, and long lines are cut") {
  LogLine line;
  line << "n=" << std::int64_t{-42} << " x=" << 1.25 << " y=" << -0.00005 << " z=" << NAN;
  CHECK(std::string(line.text()) == "n=-42 x=1.2500 y=-0.0001 z=nan");
  LogLine most;
  most << INT64_MIN;
  CHECK(std::string(most.text()) == "-9223372036854775808");
  LogLine cut;
  for (int i = 0; i < 100; ++i) {
    cut << "0123456789";
  }
  CHECK(std::string(cut.text()).size() == 159);
}
