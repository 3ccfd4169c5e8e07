// Agreement of two digests under a hypothesis, asked of their observed masks.
#pragma once

#include <cstddef>
#include <cstdint>

#include "mellin/core/arena.hpp"
#include "mellin/grid/digest.hpp"
#include "mellin/spectral/verification.hpp"

namespace mellin {

/// Holds the class grids of the two digests that are compared.
class DigestVerifier {
 public:
  struct Memory {
    Span<std::uint8_t> classes_a;
    Span<std::uint8_t> classes_b;
    Span<ClassCell> obstacles_a;
    Span<ClassCell> obstacles_b;
  };
  template <class A>
  static constexpr Memory carve(A& arena, std::uint16_t side) {
    const std::size_t pixels = std::size_t{side} * side;
    return {arena.template take<std::uint8_t>(pixels, Part::spectral),
            arena.template take<std::uint8_t>(pixels, Part::spectral),
            arena.template take<ClassCell>(pixels, Part::spectral),
            arena.template take<ClassCell>(pixels, Part::spectral)};
  }

  DigestVerifier() = default;
  DigestVerifier(const VerificationConfig& config, const Memory& memory) : config_(config), memory_(memory) {}

  /// Names the two digests, each with both masks. A pass over the pixels of each. One that has none of the masks, or
  /// whose sizes do not hold, agrees with nothing.
  void set_a(const DigestView& digest) { a_ = classes(digest, memory_.classes_a, memory_.obstacles_a); }
  void set_b(const DigestView& digest) { b_ = classes(digest, memory_.classes_b, memory_.obstacles_b); }
  /// Score of b lying at a_T_b in a, 0 to 1. Cost: a look-up an obstacle of either.
  float agreement(const Pose2& a_T_b) const;

 private:
  ClassObstacles classes(const DigestView& digest, Span<std::uint8_t> out, Span<ClassCell> cells) const;

  VerificationConfig config_;
  Memory memory_;
  ClassObstacles a_;
  ClassObstacles b_;
};

}  // namespace mellin
