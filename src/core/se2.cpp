#include "mellin/core/se2.hpp"

namespace mellin {
namespace {

struct Mat3 {
  double m[3][3];
};

/// J C J^T for a symmetric C.
Sym3 sandwich(const Mat3& j, const Sym3& c) {
  const double s[3][3] = {{c.xx, c.xy, c.xt}, {c.xy, c.yy, c.yt}, {c.xt, c.yt, c.tt}};
  double out[3][3] = {};
  for (int row = 0; row < 3; ++row) {
    double left[3] = {};
    for (int k = 0; k < 3; ++k) {
      for (int i = 0; i < 3; ++i) {
        left[k] += j.m[row][i] * s[i][k];
      }
    }
    for (int col = row; col < 3; ++col) {
      for (int k = 0; k < 3; ++k) {
        out[row][col] += left[k] * j.m[col][k];
      }
    }
  }
  return {out[0][0], out[0][1], out[0][2], out[1][1], out[1][2], out[2][2]};
}

}  // namespace

bool invert(const Sym3& m, Sym3& out) {
  const double c_xx = m.yy * m.tt - m.yt * m.yt;
  const double c_xy = m.xt * m.yt - m.xy * m.tt;
  const double c_xt = m.xy * m.yt - m.xt * m.yy;
  const double det = m.xx * c_xx + m.xy * c_xy + m.xt * c_xt;
  const double minor = m.xx * m.yy - m.xy * m.xy;
  if (!(m.xx > 0.0) || !(minor > 0.0) || !(det > 0.0) || !is_finite(1.0 / det)) {
    return false;
  }
  const double s = 1.0 / det;
  out = {c_xx * s, c_xy * s, c_xt * s, (m.xx * m.tt - m.xt * m.xt) * s, (m.xt * m.xy - m.xx * m.yt) * s, minor * s};
  return true;
}

Sym3 rotate(const Sym3& m, double theta) {
  const SinCos r = sincos(theta);
  return sandwich({{{r.cos, -r.sin, 0.0}, {r.sin, r.cos, 0.0}, {0.0, 0.0, 1.0}}}, m);
}

Sym3 compose_covariance(const Pose2& a_T_b, const Sym3& cov_ab, const Pose2& b_T_c, const Sym3& cov_bc) {
  const SinCos r = sincos(a_T_b.theta);
  const double dx = -r.sin * b_T_c.x - r.cos * b_T_c.y;
  const double dy = r.cos * b_T_c.x - r.sin * b_T_c.y;
  const Mat3 j_ab = {{{1.0, 0.0, dx}, {0.0, 1.0, dy}, {0.0, 0.0, 1.0}}};
  return sandwich(j_ab, cov_ab) + rotate(cov_bc, a_T_b.theta);
}

Sym3 carried(const Sym3& cov_c, const Pose2& b_T_c) {
  const SinCos r = sincos(b_T_c.theta);
  return sandwich({{{r.cos, -r.sin, b_T_c.y}, {r.sin, r.cos, -b_T_c.x}, {0.0, 0.0, 1.0}}}, cov_c);
}

Sym3 inverse_covariance(const Pose2& a_T_b, const Sym3& cov_ab) {
  const SinCos r = sincos(a_T_b.theta);
  const Pose2 inv = inverse(a_T_b);
  const Mat3 j = {{{-r.cos, -r.sin, inv.y}, {r.sin, -r.cos, -inv.x}, {0.0, 0.0, -1.0}}};
  return sandwich(j, cov_ab);
}

}  // namespace mellin
