#include "mellin/graph/block_cholesky.hpp"

#include <doctest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <vector>

#include "mellin/core/random.hpp"
#include "tests/support/trials.hpp"

using namespace mellin;

namespace {

/// A random symmetric positive definite block matrix: the normal equations of random couplings, and a solver on exactly
/// the memory that it measures.
struct Problem {
  std::uint32_t n;
  std::vector<BlockPair> pairs;
  std::vector<std::uint64_t> words;
  BlockCholesky cholesky;
  Eigen::MatrixXd dense;

  Problem(std::uint32_t variables, std::uint32_t couplings, std::uint32_t fill, std::uint64_t seed) : n(variables) {
    Random random(seed, 3);
    const auto any = [&] { return static_cast<std::uint32_t>(random.uniform() * n); };
    for (std::uint32_t k = 0; k < couplings; ++k) {
      pairs.push_back({any(), any()});  // some doubly, some with themselves: no block
    }
    const BlockCholeskyLimits limits = {n, couplings, fill};
    MeasureArena measure;
    (void)BlockCholesky::carve(measure, limits);
    words.resize(measure.use().total() / 8);
    Arena arena({reinterpret_cast<std::byte*>(words.data()), words.size() * 8});
    REQUIRE(cholesky.init(limits, BlockCholesky::carve(arena, limits)) == Status::ok);
    REQUIRE(arena.ok());
    REQUIRE(cholesky.ordering().begin(n, {pairs.data(), pairs.size()}) == Status::ok);
  }

  Status analyse(std::uint32_t budget) {
    Status status = Status::busy;
    while (status == Status::busy) {
      status = cholesky.ordering().analyse(budget);
    }
    return status;
  }

  void assemble(std::uint64_t seed) {
    Random random(seed, 4);
    dense = Eigen::MatrixXd::Zero(3 * n, 3 * n);
    cholesky.clear();
    for (std::uint32_t i = 0; i < n; ++i) {
      dense.block<3, 3>(3 * i, 3 * i) += Eigen::Matrix3d::Identity();
      cholesky.add_diagonal(i, {{1.0, 0.0, 1.0, 0.0, 0.0, 1.0}});
    }
    for (std::uint32_t k = 0; k < pairs.size(); ++k) {
      const auto [a, b] = pairs[k];
      if (a == b) {
        continue;
      }
      Eigen::Matrix<double, 3, 6> j;
      for (int i = 0; i < 18; ++i) {
        j(i / 6, i % 6) = random.normal();
      }
      const Eigen::Matrix<double, 6, 6> h = j.transpose() * j;
      dense.block<3, 3>(3 * a, 3 * a) += h.topLeftCorner<3, 3>();
      dense.block<3, 3>(3 * b, 3 * b) += h.bottomRightCorner<3, 3>();
      dense.block<3, 3>(3 * a, 3 * b) += h.topRightCorner<3, 3>();
      dense.block<3, 3>(3 * b, 3 * a) += h.bottomLeftCorner<3, 3>();
      cholesky.add_diagonal(a, {{h(0, 0), h(1, 0), h(1, 1), h(2, 0), h(2, 1), h(2, 2)}});
      cholesky.add_diagonal(b, {{h(3, 3), h(4, 3), h(4, 4), h(5, 3), h(5, 4), h(5, 5)}});
      Block3 off;
      for (int i = 0; i < 9; ++i) {
        off.m[i] = h(i / 3, 3 + i % 3);
      }
      cholesky.add_off_diagonal(k, pairs[k], off);
    }
  }

  Status factorise(std::uint32_t budget) {
    cholesky.begin_factorise();
    Status status = Status::busy;
    while (status == Status::busy) {
      status = cholesky.factorise(budget);
    }
    return status;
  }
};

/// A set of few numbers.
class NumberSet {
 public:
  void insert(std::uint32_t number) {
    const auto at = std::lower_bound(numbers_.begin(), numbers_.end(), number);
    if (at == numbers_.end() || *at != number) {
      numbers_.insert(at, number);
    }
  }
  const std::vector<std::uint32_t>& sorted() const { return numbers_; }

 private:
  std::vector<std::uint32_t> numbers_;
};

/// Blocks of L below the diagonal under an order, by elimination on sets.
std::size_t fill_by_sets(const Problem& p) {
  std::vector<NumberSet> later(p.n);
  for (const BlockPair& pair : p.pairs) {
    if (pair.a != pair.b) {
      const std::uint32_t a = p.cholesky.ordering().position(pair.a);
      const std::uint32_t b = p.cholesky.ordering().position(pair.b);
      later[std::min(a, b)].insert(std::max(a, b));
    }
  }
  std::size_t fill = 0;
  for (std::uint32_t j = 0; j < p.n; ++j) {
    const std::vector<std::uint32_t>& rows = later[j].sorted();
    fill += rows.size();
    for (std::size_t i = 1; i < rows.size(); ++i) {
      later[rows[0]].insert(rows[i]);
    }
  }
  return fill;
}

constexpr std::uint32_t kUnbounded = 0xFFFFFFFFU;

}  // namespace

TEST_CASE("the order is a permutation and the pattern is exactly that of its elimination") {
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    Problem p(5 + static_cast<std::uint32_t>(seed * 3), 4 + static_cast<std::uint32_t>(seed * 5), 8000, seed);
    REQUIRE(p.analyse(seed % 2 == 0 ? kUnbounded : 3) == Status::ok);
    const BlockOrdering& order = p.cholesky.ordering();
    NumberSet columns;
    for (std::uint32_t i = 0; i < p.n; ++i) {
      columns.insert(order.position(i));
      CHECK(order.variable(order.position(i)) == i);
    }
    CHECK(columns.sorted().size() == p.n);
    CHECK(columns.sorted().back() == p.n - 1);
    CHECK(order.fill() == fill_by_sets(p));
  }
}

TEST_CASE("a tree, a ring and a grid are ordered without needless fill") {
  const auto fill = [](const std::vector<BlockPair>& pairs, std::uint32_t n) {
    Problem p(n, static_cast<std::uint32_t>(pairs.size()), 4000, 0);
    p.pairs = pairs;
    REQUIRE(p.cholesky.ordering().begin(n, {p.pairs.data(), p.pairs.size()}) == Status::ok);
    REQUIRE(p.analyse(kUnbounded) == Status::ok);
    return p.cholesky.ordering().fill();
  };
  std::vector<BlockPair> tree;
  std::vector<BlockPair> ring;
  std::vector<BlockPair> grid;
  for (std::uint32_t i = 1; i < 60; ++i) {
    tree.push_back({i, (i - 1) / 2});
    ring.push_back({i - 1, i});
  }
  ring.push_back({59, 0});
  for (std::uint32_t i = 0; i < 400; ++i) {
    if (i % 20 != 19) {
      grid.push_back({i, i + 1});
    }
    if (i < 380) {
      grid.push_back({i, i + 20});
    }
  }
  CHECK(fill(tree, 60) == 59);        // none at all
  CHECK(fill(ring, 60) == 60 + 57);   // the least possible: one a vertex until a triangle is left
  CHECK(fill(grid, 400) < 400 * 10);  // row by row: 19 or 20 a column
}

TEST_CASE("solutions agree with a dense factorisation") {
  for (std::uint64_t seed = 0; seed < static_cast<std::uint64_t>(test::trials(20)); ++seed) {
    Problem p(4 + static_cast<std::uint32_t>(seed * 2), 6 + static_cast<std::uint32_t>(seed * 4), 2000, seed);
    REQUIRE(p.analyse(kUnbounded) == Status::ok);
    for (const std::uint32_t budget : {std::uint32_t{1}, kUnbounded}) {
      p.assemble(seed);
      REQUIRE(p.factorise(budget) == Status::ok);
      const Eigen::VectorXd right = Eigen::VectorXd::LinSpaced(3 * p.n, -1.0, 2.0);
      std::vector<double> x(3 * p.n);
      for (std::uint32_t i = 0; i < 3 * p.n; ++i) {
        x[3 * p.cholesky.ordering().position(i / 3) + i % 3] = right(i);
      }
      p.cholesky.solve({x.data(), x.size()});
      const Eigen::VectorXd exact = p.dense.llt().solve(right);
      double worst = 0.0;
      for (std::uint32_t i = 0; i < 3 * p.n; ++i) {
        worst = std::max(worst, std::abs(x[3 * p.cholesky.ordering().position(i / 3) + i % 3] - exact(i)));
      }
      CHECK(worst < 1e-10);
    }
  }
}

TEST_CASE("the projection of the inverse agrees with a dense inverse") {
  Problem p(30, 50, 600, 5);
  REQUIRE(p.analyse(kUnbounded) == Status::ok);
  p.assemble(5);
  REQUIRE(p.factorise(kUnbounded) == Status::ok);
  const Eigen::MatrixXd inverse = p.dense.inverse();
  std::vector<double> work(9 * p.n, 7.0);
  const Block3 b_u = {{1.0, 2.0, -1.0, 0.5, 0.0, 3.0, 0.0, -2.0, 1.0}};
  const Block3 b_v = {{0.0, 1.0, 1.0, -1.0, 2.0, 0.0, 4.0, 0.0, 1.0}};
  using RowMajor = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
  for (std::uint32_t u = 0; u < static_cast<std::uint32_t>(test::trials(static_cast<int>(p.n))); ++u) {
    for (std::uint32_t v = 0; v < p.n; ++v) {
      Eigen::MatrixXd b = Eigen::MatrixXd::Zero(3 * p.n, 3);
      b.block<3, 3>(3 * u, 0) += Eigen::Map<const RowMajor>(b_u.m);
      b.block<3, 3>(3 * v, 0) += Eigen::Map<const RowMajor>(b_v.m);
      const Eigen::Matrix3d exact = b.transpose() * inverse * b;
      Block3 out;
      p.cholesky.project(p.cholesky.ordering().position(u), &b_u, p.cholesky.ordering().position(v), &b_v,
                         {work.data(), work.size()}, out);
      REQUIRE((Eigen::Map<const RowMajor>(out.m) - exact).norm() < 1e-9 * (1.0 + exact.norm()));
    }
  }
}

TEST_CASE("a factor that does not fit is full, one block more than enough is not needed") {
  Problem roomy(40, 90, 2000, 9);
  REQUIRE(roomy.analyse(kUnbounded) == Status::ok);
  const std::uint32_t fill = roomy.cholesky.ordering().fill();
  Problem exact(40, 90, fill, 9);
  CHECK(exact.analyse(kUnbounded) == Status::ok);
  Problem tight(40, 90, fill - 1, 9);
  CHECK(tight.analyse(kUnbounded) == Status::full);
  CHECK(tight.cholesky.ordering().analyse(10) == Status::invalid_argument);
}

TEST_CASE("an indefinite matrix and wrong pairs are refused") {
  Problem p(6, 8, 100, 2);
  REQUIRE(p.analyse(kUnbounded) == Status::ok);
  p.assemble(2);
  p.cholesky.add_diagonal(3, {{-1e6, 0.0, 0.0, 0.0, 0.0, 0.0}});
  CHECK(p.factorise(kUnbounded) == Status::degenerate);
  const BlockPair outside[] = {{0, 6}};
  CHECK(p.cholesky.ordering().begin(6, outside) == Status::invalid_argument);
  CHECK(p.cholesky.ordering().begin(7, {}) == Status::invalid_argument);
}
