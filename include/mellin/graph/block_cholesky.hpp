// Cholesky factorisation of a symmetric positive definite matrix of 3 x 3 blocks in fixed memory, with an ordering that
// keeps the factor sparse. Works in slices. Useful alone: analyse a pattern once, then assemble, factorise and solve as
// often as wanted.
//
// Variables are the caller's indices 0 .. n-1; columns are the same in elimination order (position() maps). Vectors are
// in column order, three doubles a column.
//
// Method: minimum degree on the quotient graph with the approximate external degree of Amestoy, Davis and Duff (1996);
// the columns of the factor are its elements, so that ordering and symbolic factorisation are one pass in one array.
// Then left-looking block Cholesky (George and Liu 1981; Davis 2006, Section 4.8). L is kept with the reciprocals of
// its diagonal.
#pragma once

#include <cstddef>
#include <cstdint>

#include "mellin/core/arena.hpp"
#include "mellin/core/span.hpp"
#include "mellin/core/status.hpp"

namespace mellin {

/// A 3 x 3 matrix, row-major.
struct Block3 {
  double m[9] = {};
};

/// The lower triangle of a 3 x 3 matrix: 00, 10, 11, 20, 21, 22.
struct Lower3 {
  double m[6] = {};
};

/// Two variables coupled by an off-diagonal block; a == b means none.
struct BlockPair {
  std::uint32_t a = 0;
  std::uint32_t b = 0;
};

struct BlockCholeskyLimits {
  std::uint32_t variables = 0;
  std::uint32_t pairs = 0;
  std::uint32_t fill = 0;  ///< blocks of L below the diagonal
};

/// Orders the variables and finds the pattern of L. 16 bytes a pair, 44 a variable, 4 a block of fill.
class BlockOrdering {
 public:
  struct Memory {
    Span<std::uint32_t> begin;         ///< first block of each column, one more than columns
    Span<std::uint32_t> rows;          ///< row (in columns) of each block of L, ascending within a column
    Span<std::uint32_t> position;      ///< column of each variable
    Span<std::uint32_t> variable;      ///< variable of each column
    Span<std::uint32_t> slots;         ///< block of each pair
    Span<std::uint32_t> neighbours;    ///< of the quotient graph
    Span<std::uint32_t> list_begin;    ///< into neighbours
    Span<std::uint32_t> variables_in;  ///< adjacent variables in each list, they stand first …
    Span<std::uint32_t> elements_in;   ///< … then the elements
    Span<std::uint32_t> degree;
    Span<std::uint32_t> head;
    Span<std::uint32_t> next;
    Span<std::uint32_t> previous;
    Span<std::uint32_t> mark;
    Span<std::uint32_t> outside;
    Span<std::uint32_t> stamp;
  };

  template <class A>
  static constexpr Memory carve(A& arena, const BlockCholeskyLimits& limits) {
    const std::size_t n = limits.variables;
    Memory memory;
    memory.begin = arena.template take<std::uint32_t>(n + 1, Part::graph);
    memory.rows = arena.template take<std::uint32_t>(limits.fill, Part::graph);
    memory.position = arena.template take<std::uint32_t>(n, Part::graph);
    memory.variable = arena.template take<std::uint32_t>(n, Part::graph);
    memory.slots = arena.template take<std::uint32_t>(limits.pairs, Part::graph);
    memory.neighbours = arena.template take<std::uint32_t>(2 * static_cast<std::size_t>(limits.pairs), Part::graph);
    memory.list_begin = arena.template take<std::uint32_t>(n + 1, Part::graph);
    memory.variables_in = arena.template take<std::uint32_t>(n, Part::graph);
    memory.elements_in = arena.template take<std::uint32_t>(n, Part::graph);
    memory.degree = arena.template take<std::uint32_t>(n, Part::graph);
    memory.head = arena.template take<std::uint32_t>(n, Part::graph);
    memory.next = arena.template take<std::uint32_t>(n, Part::graph);
    memory.previous = arena.template take<std::uint32_t>(n, Part::graph);
    memory.mark = arena.template take<std::uint32_t>(n, Part::graph);
    memory.outside = arena.template take<std::uint32_t>(n, Part::graph);
    memory.stamp = arena.template take<std::uint32_t>(n, Part::graph);
    return memory;
  }

  /// ok; insufficient_memory where the spans are smaller than carve() takes.
  Status init(const BlockCholeskyLimits& limits, const Memory& memory);

  /// Starts the analysis of a pattern; `pairs` must stay until analyse() has ended. ok; invalid_argument where there
  /// are more variables or pairs than the limits, or a pair names a variable that does not exist. O(variables + pairs).
  Status begin(std::uint32_t variables, Span<const BlockPair> pairs);

  /// Goes on with it. ok: done; busy: call again; full: L has more blocks than the limit (start anew with fewer pairs).
  /// A call visits at most `budget` indices, plus those of one column of L and of the elements next to it.
  Status analyse(std::uint32_t budget);

  std::uint32_t variables() const { return count_; }
  /// Blocks of L below the diagonal.
  std::uint32_t fill() const { return used_; }
  std::uint32_t position(std::uint32_t variable) const { return memory_.position[variable]; }
  std::uint32_t variable(std::uint32_t column) const { return memory_.variable[column]; }
  /// Block of L at the place of a pair; its row is the later of the two columns.
  std::uint32_t slot(std::uint32_t pair) const { return memory_.slots[pair]; }
  std::uint32_t begin_of(std::uint32_t column) const { return memory_.begin[column]; }
  std::uint32_t row(std::uint32_t block) const { return memory_.rows[block]; }
  Span<const std::uint32_t> rows() const { return memory_.rows; }
  /// The next column that depends on this one (its parent in the elimination tree); variables() for a root.
  std::uint32_t parent(std::uint32_t column) const;

  /// Work space of the analysis that is free after it, an index a variable each (which: 0 to 3); Cholesky borrows it.
  Span<std::uint32_t> scratch(std::uint32_t which) const;

 private:
  enum class Phase : std::uint8_t { idle, eliminate, sort, locate, done };
  void build_lists(Span<const BlockPair> pairs);
  void enqueue(std::uint32_t variable);
  void dequeue(std::uint32_t variable);
  std::uint32_t take_minimum();
  Status eliminate(std::uint32_t pivot);
  bool gather(std::uint32_t pivot, std::uint32_t tag);
  void count_outside(std::uint32_t first, std::uint32_t tag);
  void update_neighbour(std::uint32_t variable, std::uint32_t pivot, std::uint32_t tag);
  void sort_column(std::uint32_t column);
  void locate(std::uint32_t pair);

  Memory memory_;
  BlockCholeskyLimits limits_;
  Span<const BlockPair> pairs_;
  Phase phase_ = Phase::idle;
  std::uint32_t count_ = 0;
  std::uint32_t used_ = 0;
  std::uint32_t cursor_ = 0;
  std::uint32_t minimum_ = 0;
  std::uint32_t tag_ = 0;
  std::uint32_t visits_ = 0;
};

/// The numbers on that pattern: 48 bytes a variable, 72 a block of fill.
class BlockCholesky {
 public:
  struct Memory {
    BlockOrdering::Memory ordering;
    Span<Lower3> diagonal;
    Span<Block3> blocks;
  };

  template <class A>
  static constexpr Memory carve(A& arena, const BlockCholeskyLimits& limits) {
    Memory memory;
    memory.ordering = BlockOrdering::carve(arena, limits);
    memory.diagonal = arena.template take<Lower3>(limits.variables, Part::graph, Region::fast);
    memory.blocks = arena.template take<Block3>(limits.fill, Part::graph);
    return memory;
  }

  /// As BlockOrdering::init().
  Status init(const BlockCholeskyLimits& limits, const Memory& memory);

  BlockOrdering& ordering() { return ordering_; }
  const BlockOrdering& ordering() const { return ordering_; }

  /// All zero, ready to be assembled. O(variables + fill).
  void clear();

  /// Adds to a variable's diagonal block.
  void add_diagonal(std::uint32_t variable, const Lower3& block);
  /// Adds the block with rows of pair.a and columns of pair.b, given transposed or not as it is stored.
  void add_off_diagonal(std::uint32_t pair, const BlockPair& variables, const Block3& block);
  /// Scales the diagonal by 1 + factor (Marquardt 1963).
  void damp(double factor);

  /// Factorises what was assembled. begin_factorise() once, then factorise() until it is not busy. ok: done; busy: call
  /// again; degenerate: not positive definite. A call multiplies at most `budget` blocks, plus one column's.
  void begin_factorise();
  Status factorise(std::uint32_t budget);

  /// Replaces x by (L L^T)^-1 x. Requires a finished factor. O(variables + fill).
  void solve(Span<double> x) const;

  /// Columns whose forward substitution a right-hand side at column `from` reaches form the path to the root. Computes
  /// Y^T Y, Y = L^-1 B, for B of three columns with the blocks `b_u` at column u and `b_v` at column v (u == v: their
  /// sum; a null pointer: zero), that is B^T (L L^T)^-1 B. `work`: nine doubles a variable. O(blocks in the columns on
  /// the two paths).
  void project(std::uint32_t u, const Block3* b_u, std::uint32_t v, const Block3* b_v, Span<double> work,
               Block3& out) const;

 private:
  void open_column();
  void update_from(std::uint32_t source);
  bool close_column();

  Memory memory_;
  BlockOrdering ordering_;
  std::uint32_t column_ = 0;
  bool open_ = false;
};

}  // namespace mellin
