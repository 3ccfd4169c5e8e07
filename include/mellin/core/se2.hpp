// Rigid motions of the plane. a_T_b takes coordinates in frame b to coordinates in frame a:
// p_a = R(theta) p_b + (x, y).
#pragma once

#include "mellin/core/math.hpp"

namespace mellin {

/// A pose, x and y in metres, theta in radians. Double, since a session can drive kilometres and poses are chained;
/// what happens cell by cell is float.
struct Pose2 {
  double x = 0.0;
  double y = 0.0;
  double theta = 0.0;
};

struct Point2f {
  float x = 0.0F;
  float y = 0.0F;
};

/// a_T_c from a_T_b and b_T_c; theta in [-pi, pi).
inline Pose2 compose(const Pose2& a_T_b, const Pose2& b_T_c) {
  const SinCos r = sincos(a_T_b.theta);
  return {a_T_b.x + r.cos * b_T_c.x - r.sin * b_T_c.y, a_T_b.y + r.sin * b_T_c.x + r.cos * b_T_c.y,
          wrap_angle(a_T_b.theta + b_T_c.theta)};
}

/// b_T_a from a_T_b.
inline Pose2 inverse(const Pose2& a_T_b) {
  const SinCos r = sincos(a_T_b.theta);
  return {-r.cos * a_T_b.x - r.sin * a_T_b.y, r.sin * a_T_b.x - r.cos * a_T_b.y, wrap_angle(-a_T_b.theta)};
}

/// a_T_b from w_T_a and w_T_b: where b lies, seen from a.
inline Pose2 between(const Pose2& w_T_a, const Pose2& w_T_b) {
  const SinCos r = sincos(w_T_a.theta);
  const double dx = w_T_b.x - w_T_a.x;
  const double dy = w_T_b.y - w_T_a.y;
  return {r.cos * dx + r.sin * dy, -r.sin * dx + r.cos * dy, wrap_angle(w_T_b.theta - w_T_a.theta)};
}

inline bool is_finite(const Pose2& pose) { return is_finite(pose.x) && is_finite(pose.y) && is_finite(pose.theta); }

/// Straight-line length of the translation, m.
inline double translation(const Pose2& pose) { return sqrt(pose.x * pose.x + pose.y * pose.y); }

/// Symmetric 3 x 3 matrix over (x, y, theta): a covariance (m^2, m rad, rad^2) or an information matrix, its inverse.
struct Sym3 {
  double xx = 0.0;
  double xy = 0.0;
  double xt = 0.0;
  double yy = 0.0;
  double yt = 0.0;
  double tt = 0.0;
};

inline Sym3 diagonal(double xx, double yy, double tt) { return {xx, 0.0, 0.0, yy, 0.0, tt}; }

/// v^T M v for v = (x, y, theta).
inline double quadratic_form(const Sym3& m, const Pose2& v) {
  return m.xx * v.x * v.x + m.yy * v.y * v.y + m.tt * v.theta * v.theta +
         2.0 * (m.xy * v.x * v.y + m.xt * v.x * v.theta + m.yt * v.y * v.theta);
}

inline double determinant(const Sym3& m) {
  return m.xx * (m.yy * m.tt - m.yt * m.yt) - m.xy * (m.xy * m.tt - m.yt * m.xt) + m.xt * (m.xy * m.yt - m.yy * m.xt);
}

/// Inverse of a positive definite matrix. Returns false, leaving `out` as it was, where it is not.
bool invert(const Sym3& m, Sym3& out);

/// R m R^T with the rotation by theta on (x, y): a matrix given in frame b, expressed in frame a of a_T_b.
Sym3 rotate(const Sym3& m, double theta);

inline Sym3 operator+(const Sym3& a, const Sym3& b) {
  return {a.xx + b.xx, a.xy + b.xy, a.xt + b.xt, a.yy + b.yy, a.yt + b.yt, a.tt + b.tt};
}

inline Sym3 scale(const Sym3& m, double s) { return {m.xx * s, m.xy * s, m.xt * s, m.yy * s, m.yt * s, m.tt * s}; }

/// Covariance of a_T_c = a_T_b b_T_c, each covariance over the (x, y, theta) of its transform as parameters (first
/// order, the two independent).
Sym3 compose_covariance(const Pose2& a_T_b, const Sym3& cov_ab, const Pose2& b_T_c, const Sym3& cov_bc);

/// A covariance of a small motion of c, given in c's own frame, as the covariance of the small motion of b that moves c
/// so when the two are rigidly joined at b_T_c; in b's own frame.
Sym3 carried(const Sym3& cov_c, const Pose2& b_T_c);

/// Covariance of b_T_a from that of a_T_b (first order).
Sym3 inverse_covariance(const Pose2& a_T_b, const Sym3& cov_ab);

}  // namespace mellin
