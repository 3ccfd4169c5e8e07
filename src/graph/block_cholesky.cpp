#include "mellin/graph/block_cholesky.hpp"

#include <algorithm>
#include <cassert>

#include "mellin/core/math.hpp"

namespace mellin {
namespace {

constexpr std::uint32_t kNone = 0xFFFFFFFFU;

/// c -= a b^T
inline void subtract_product(double* c, const double* a, const double* b) {
  for (int row = 0; row < 3; ++row) {
    for (int col = 0; col < 3; ++col) {
      c[3 * row + col] -= a[3 * row] * b[3 * col] + a[3 * row + 1] * b[3 * col + 1] + a[3 * row + 2] * b[3 * col + 2];
    }
  }
}

/// d -= a a^T, the lower triangle
inline void subtract_square(double* d, const double* a) {
  d[0] -= a[0] * a[0] + a[1] * a[1] + a[2] * a[2];
  d[1] -= a[3] * a[0] + a[4] * a[1] + a[5] * a[2];
  d[2] -= a[3] * a[3] + a[4] * a[4] + a[5] * a[5];
  d[3] -= a[6] * a[0] + a[7] * a[1] + a[8] * a[2];
  d[4] -= a[6] * a[3] + a[7] * a[4] + a[8] * a[5];
  d[5] -= a[6] * a[6] + a[7] * a[7] + a[8] * a[8];
}

/// Cholesky factor in place, with the reciprocals of its diagonal. False where d is not positive definite.
bool factor_diagonal(double* d) {
  if (!(d[0] > 0.0)) {
    return false;
  }
  d[0] = 1.0 / sqrt(d[0]);
  d[1] *= d[0];
  d[3] *= d[0];
  const double d11 = d[2] - d[1] * d[1];
  if (!(d11 > 0.0)) {
    return false;
  }
  d[2] = 1.0 / sqrt(d11);
  d[4] = (d[4] - d[3] * d[1]) * d[2];
  const double d22 = d[5] - d[3] * d[3] - d[4] * d[4];
  if (!(d22 > 0.0)) {
    return false;
  }
  d[5] = 1.0 / sqrt(d22);
  return is_finite(d[0]) && is_finite(d[2]) && is_finite(d[5]);
}

/// x = l^-1 x
inline void solve_lower(const double* l, double* x) {
  x[0] *= l[0];
  x[1] = (x[1] - l[1] * x[0]) * l[2];
  x[2] = (x[2] - l[3] * x[0] - l[4] * x[1]) * l[5];
}

/// x = l^-T x
inline void solve_lower_transposed(const double* l, double* x) {
  x[2] *= l[5];
  x[1] = (x[1] - l[4] * x[2]) * l[2];
  x[0] = (x[0] - l[1] * x[1] - l[3] * x[2]) * l[0];
}

}  // namespace

Status BlockCholesky::init(const BlockCholeskyLimits& limits, const Memory& memory) {
  if (memory.diagonal.size() < limits.variables || memory.blocks.size() < limits.fill) {
    return Status::insufficient_memory;
  }
  memory_ = memory;
  return ordering_.init(limits, memory.ordering);
}

void BlockCholesky::clear() {
  for (std::uint32_t i = 0; i < ordering_.variables(); ++i) {
    memory_.diagonal[i] = Lower3{};
  }
  for (std::uint32_t i = 0; i < ordering_.fill(); ++i) {
    memory_.blocks[i] = Block3{};
  }
}

void BlockCholesky::add_diagonal(std::uint32_t variable, const Lower3& block) {
  double* const d = memory_.diagonal[ordering_.position(variable)].m;
  for (int i = 0; i < 6; ++i) {
    d[i] += block.m[i];
  }
}

void BlockCholesky::add_off_diagonal(std::uint32_t pair, const BlockPair& variables, const Block3& block) {
  double* const to = memory_.blocks[ordering_.slot(pair)].m;
  const bool rows_of_a = ordering_.position(variables.a) > ordering_.position(variables.b);
  for (int row = 0; row < 3; ++row) {
    for (int col = 0; col < 3; ++col) {
      to[3 * row + col] += rows_of_a ? block.m[3 * row + col] : block.m[3 * col + row];
    }
  }
}

void BlockCholesky::damp(double factor) {
  for (std::uint32_t i = 0; i < ordering_.variables(); ++i) {
    double* const d = memory_.diagonal[i].m;
    d[0] *= 1.0 + factor;
    d[2] *= 1.0 + factor;
    d[5] *= 1.0 + factor;
  }
}

// While factorising, the columns that have still to update column j form a list: scratch(0) holds its first, scratch(1)
// the next of each, scratch(2) the block of each column at which row j stands. scratch(3) finds the block of a row in
// the open column.

void BlockCholesky::begin_factorise() {
  column_ = 0;
  open_ = false;
  Span<std::uint32_t> first = ordering_.scratch(0);
  for (std::uint32_t i = 0; i < ordering_.variables(); ++i) {
    first[i] = kNone;
  }
}

Status BlockCholesky::factorise(std::uint32_t budget) {
  std::uint32_t products = 0;
  Span<std::uint32_t> first = ordering_.scratch(0);
  while (column_ < ordering_.variables()) {
    if (products >= budget) {
      return Status::busy;
    }
    if (!open_) {
      open_column();
    }
    while (first[column_] != kNone && products < budget) {
      const std::uint32_t source = first[column_];
      products += ordering_.begin_of(source + 1) - ordering_.scratch(2)[source];
      update_from(source);
    }
    if (first[column_] != kNone) {
      return Status::busy;
    }
    products += ordering_.begin_of(column_ + 1) - ordering_.begin_of(column_) + 1;
    if (!close_column()) {
      return Status::degenerate;
    }
  }
  return Status::ok;
}

void BlockCholesky::open_column() {
  Span<std::uint32_t> block_of_row = ordering_.scratch(3);
  for (std::uint32_t s = ordering_.begin_of(column_); s < ordering_.begin_of(column_ + 1); ++s) {
    block_of_row[ordering_.row(s)] = s;
  }
  open_ = true;
}

/// Subtracts the outer product of a finished column's blocks from the open one, and lists it for its next row.
void BlockCholesky::update_from(std::uint32_t source) {
  Span<std::uint32_t> first = ordering_.scratch(0);
  Span<std::uint32_t> next = ordering_.scratch(1);
  Span<std::uint32_t> at = ordering_.scratch(2);
  const std::uint32_t* const rows = ordering_.rows().data();
  const std::uint32_t* const block_of_row = ordering_.scratch(3).data();
  Block3* const blocks = memory_.blocks.data();
  first[column_] = next[source];
  const std::uint32_t here = at[source];
  const std::uint32_t end = ordering_.begin_of(source + 1);
  const Block3 factor = blocks[here];
  subtract_square(memory_.diagonal[column_].m, factor.m);
  for (std::uint32_t s = here + 1; s < end; ++s) {
    subtract_product(blocks[block_of_row[rows[s]]].m, blocks[s].m, factor.m);
  }
  if (here + 1 < end) {
    at[source] = here + 1;
    next[source] = first[rows[here + 1]];
    first[rows[here + 1]] = source;
  }
}

bool BlockCholesky::close_column() {
  double* const diagonal = memory_.diagonal[column_].m;
  if (!factor_diagonal(diagonal)) {
    return false;
  }
  const std::uint32_t begin = ordering_.begin_of(column_);
  const std::uint32_t end = ordering_.begin_of(column_ + 1);
  for (std::uint32_t s = begin; s < end; ++s) {
    for (int row = 0; row < 3; ++row) {
      solve_lower(diagonal, memory_.blocks[s].m + 3 * row);
    }
  }
  if (begin < end) {
    const std::uint32_t target = ordering_.row(begin);
    ordering_.scratch(2)[column_] = begin;
    ordering_.scratch(1)[column_] = ordering_.scratch(0)[target];
    ordering_.scratch(0)[target] = column_;
  }
  open_ = false;
  ++column_;
  return true;
}

void BlockCholesky::solve(Span<double> x) const {
  const std::uint32_t n = ordering_.variables();
  for (std::uint32_t j = 0; j < n; ++j) {
    double* const xj = x.data() + 3 * static_cast<std::size_t>(j);
    solve_lower(memory_.diagonal[j].m, xj);
    for (std::uint32_t s = ordering_.begin_of(j); s < ordering_.begin_of(j + 1); ++s) {
      const double* const b = memory_.blocks[s].m;
      double* const xi = x.data() + 3 * static_cast<std::size_t>(ordering_.row(s));
      for (int row = 0; row < 3; ++row) {
        xi[row] -= b[3 * row] * xj[0] + b[3 * row + 1] * xj[1] + b[3 * row + 2] * xj[2];
      }
    }
  }
  for (std::uint32_t j = n; j-- > 0;) {
    double* const xj = x.data() + 3 * static_cast<std::size_t>(j);
    for (std::uint32_t s = ordering_.begin_of(j); s < ordering_.begin_of(j + 1); ++s) {
      const double* const b = memory_.blocks[s].m;
      const double* const xi = x.data() + 3 * static_cast<std::size_t>(ordering_.row(s));
      for (int col = 0; col < 3; ++col) {
        xj[col] -= b[col] * xi[0] + b[3 + col] * xi[1] + b[6 + col] * xi[2];
      }
    }
    solve_lower_transposed(memory_.diagonal[j].m, xj);
  }
}

void BlockCholesky::project(std::uint32_t u, const Block3* b_u, std::uint32_t v, const Block3* b_v, Span<double> work,
                            Block3& out) const {
  const std::uint32_t n = ordering_.variables();
  // Y is kept transposed, one block a column of L, so that its columns are solved as rows.
  const auto y_of = [&work](std::uint32_t column) { return work.data() + 9 * static_cast<std::size_t>(column); };
  for (const std::uint32_t start : {u, v}) {
    for (std::uint32_t j = start; j < n; j = ordering_.parent(j)) {
      std::fill_n(y_of(j), 9, 0.0);
    }
  }
  const auto place = [&y_of](std::uint32_t column, const Block3* b) {
    for (int i = 0; b != nullptr && i < 9; ++i) {
      y_of(column)[i] += b->m[3 * (i % 3) + i / 3];
    }
  };
  place(u, b_u);
  place(v, b_v);
  out = Block3{};
  std::uint32_t j = std::min(u, v);
  std::uint32_t other = std::max(u, v);
  while (j < n) {
    double* const y = y_of(j);
    for (int c = 0; c < 3; ++c) {
      solve_lower(memory_.diagonal[j].m, y + 3 * c);
    }
    for (std::uint32_t s = ordering_.begin_of(j); s < ordering_.begin_of(j + 1); ++s) {
      subtract_product(y_of(ordering_.row(s)), y, memory_.blocks[s].m);
    }
    for (int row = 0; row < 3; ++row) {
      for (int col = 0; col < 3; ++col) {
        out.m[3 * row + col] +=
            y[3 * row] * y[3 * col] + y[3 * row + 1] * y[3 * col + 1] + y[3 * row + 2] * y[3 * col + 2];
      }
    }
    if (other == j) {
      other = n;
    }
    j = ordering_.parent(j);
    if (other < j) {
      std::swap(j, other);
    }
  }
}

}  // namespace mellin
