#include "mellin/graph/consistency.hpp"

namespace mellin {
namespace {

using Set = std::uint64_t;

Set bit(std::uint32_t i) { return Set{1} << i; }

std::uint32_t count(Set set) { return static_cast<std::uint32_t>(__builtin_popcountll(set)); }

/// Requires set != 0.
std::uint32_t lowest(Set set) { return static_cast<std::uint32_t>(__builtin_ctzll(set)); }

/// Candidates in the order in which they are tried, from the back, and for each how large a clique among it and those
/// before it can be: as many as colours are needed so that linked vertices differ.
struct Coloured {
  std::uint8_t vertex[kMaxHypotheses];
  std::uint8_t bound[kMaxHypotheses];
  std::uint32_t size = 0;
};

void colour(const LinkMatrix& links, Set candidates, Coloured& out) {
  out.size = 0;
  for (std::uint8_t colours = 1; candidates != 0; ++colours) {
    Set free = candidates;
    while (free != 0) {
      const std::uint32_t v = lowest(free);
      candidates &= ~bit(v);
      free &= ~(links.rows[v] | bit(v));
      out.vertex[out.size] = static_cast<std::uint8_t>(v);
      out.bound[out.size] = colours;
      ++out.size;
    }
  }
}

/// The first vertex, then always the smallest that is linked to all taken.
Set greedy(const LinkMatrix& links, Set candidates) {
  Set clique = 0;
  while (candidates != 0) {
    const std::uint32_t v = lowest(candidates);
    clique |= bit(v);
    candidates &= links.rows[v] & ~bit(v);
  }
  return clique;
}

}  // namespace

std::uint64_t maximum_clique(const LinkMatrix& links, std::uint64_t candidates, std::uint32_t& limit) {
  // One level a vertex taken: what it may still be joined with, and the order to try that in. The colouring is made
  // anew when the search returns to a level, which keeps 8 kB off the stack.
  struct Level {
    Set candidates;
    Set clique;
  };
  Level levels[kMaxHypotheses + 1];
  Set best = greedy(links, candidates);
  std::uint32_t depth = 0;
  levels[0] = {candidates, 0};
  Coloured order;
  while (limit > 0) {
    Level& here = levels[depth];
    colour(links, here.candidates, order);
    if (order.size == 0 || count(here.clique) + order.bound[order.size - 1] <= count(best)) {
      if (depth == 0) {
        break;
      }
      --depth;
      continue;
    }
    --limit;
    const std::uint32_t v = order.vertex[order.size - 1];
    here.candidates &= ~bit(v);
    Level& below = levels[depth + 1];
    below.clique = here.clique | bit(v);
    below.candidates = here.candidates & links.rows[v];
    if (count(below.clique) > count(best)) {
      best = below.clique;
    }
    ++depth;
  }
  return best;
}

}  // namespace mellin
