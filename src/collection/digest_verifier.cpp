#include "mellin/collection/digest_verifier.hpp"

namespace mellin {

ClassObstacles DigestVerifier::classes(const DigestView& digest, Span<std::uint8_t> out, Span<ClassCell> cells) const {
  const Result<ClassView> view = classify(digest, config_, out);
  if (!view.ok()) {
    return {};
  }
  const Result<Span<const ClassCell>> found = obstacles(view.value(), cells);
  return {view.value(), found.ok() ? found.value() : Span<const ClassCell>()};
}

float DigestVerifier::agreement(const Pose2& a_T_b) const {
  const Result<Agreement> agreement = verify_obstacles(a_, b_, a_T_b, config_);
  return agreement.ok() ? agreement.value().score : 0.0F;
}

}  // namespace mellin
