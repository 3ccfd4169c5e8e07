#include "graph/edge_terms.hpp"

namespace mellin::graph_detail {
namespace {

/// An edge's error and information turned into the frame of the poses, where the derivative by b is the identity.
struct WorldError {
  Sym3 information;
  double f[3];
  double dx;  ///< from a to b
  double dy;
};

WorldError world_error(const Edge& edge, double weight, const Pose2& a, const Pose2& b) {
  const SinCos at_a = sincos(a.theta);
  const SinCos at_z = sincos(edge.a_T_b.theta);
  const double c = at_a.cos * at_z.cos - at_a.sin * at_z.sin;
  const double s = at_a.sin * at_z.cos + at_a.cos * at_z.sin;
  const Sym3 m = scale(edge.information, weight);
  WorldError out;
  out.dx = b.x - a.x;
  out.dy = b.y - a.y;
  out.f[0] = out.dx - (at_a.cos * edge.a_T_b.x - at_a.sin * edge.a_T_b.y);
  out.f[1] = out.dy - (at_a.sin * edge.a_T_b.x + at_a.cos * edge.a_T_b.y);
  out.f[2] = wrap_angle(b.theta - a.theta - edge.a_T_b.theta);
  out.information.xx = c * c * m.xx - 2.0 * c * s * m.xy + s * s * m.yy;
  out.information.yy = s * s * m.xx + 2.0 * c * s * m.xy + c * c * m.yy;
  out.information.xy = c * s * (m.xx - m.yy) + (c * c - s * s) * m.xy;
  out.information.xt = c * m.xt - s * m.yt;
  out.information.yt = s * m.xt + c * m.yt;
  out.information.tt = m.tt;
  return out;
}

}  // namespace

EdgeTerms pose_terms(const Edge& edge, double weight, const Pose2& w_T_a, const Pose2& w_T_b) {
  const WorldError e = world_error(edge, weight, w_T_a, w_T_b);
  const Sym3& w = e.information;
  const double rows[3][3] = {{w.xx, w.xy, w.xt}, {w.xy, w.yy, w.yt}, {w.xt, w.yt, w.tt}};
  EdgeTerms out;
  out.bb = {{w.xx, w.xy, w.yy, w.xt, w.yt, w.tt}};
  // The derivative by a is -G, G the identity but for its last column (-dy, dx, 1): turning a swings b about it.
  double turned[3];  // last row of G^T W
  for (int i = 0; i < 3; ++i) {
    out.g_b[i] = rows[i][0] * e.f[0] + rows[i][1] * e.f[1] + rows[i][2] * e.f[2];
    turned[i] = -e.dy * rows[0][i] + e.dx * rows[1][i] + rows[2][i];
    out.ab.m[i] = -rows[0][i];
    out.ab.m[3 + i] = -rows[1][i];
    out.ab.m[6 + i] = -turned[i];
  }
  out.g_a[0] = -out.g_b[0];
  out.g_a[1] = -out.g_b[1];
  out.g_a[2] = e.dy * out.g_b[0] - e.dx * out.g_b[1] - out.g_b[2];
  out.aa = {{w.xx, w.xy, w.yy, turned[0], turned[1], -e.dy * turned[0] + e.dx * turned[1] + turned[2]}};
  return out;
}

EdgeTerms rotation_terms(const Edge& edge, double weight, const Direction& r_a, const Direction& r_b) {
  const SinCos z = sincos(edge.a_T_b.theta);
  const double w = weight * edge.information.tt;
  const double f0 = r_b.c - (z.cos * r_a.c - z.sin * r_a.s);
  const double f1 = r_b.s - (z.sin * r_a.c + z.cos * r_a.s);
  EdgeTerms out;
  out.aa = out.bb = {{w, 0.0, w, 0.0, 0.0, w}};
  out.ab = {{-w * z.cos, -w * z.sin, 0.0, w * z.sin, -w * z.cos, 0.0, 0.0, 0.0, 0.0}};
  out.g_b[0] = w * f0;
  out.g_b[1] = w * f1;
  out.g_a[0] = -w * (z.cos * f0 + z.sin * f1);
  out.g_a[1] = -w * (-z.sin * f0 + z.cos * f1);
  return out;
}

EdgeTerms translation_terms(const Edge& edge, double weight, const Pose2& w_T_a, const Pose2& w_T_b) {
  const WorldError e = world_error(edge, weight, w_T_a, w_T_b);
  const Sym3& w = e.information;
  EdgeTerms out;
  out.aa = out.bb = {{w.xx, w.xy, w.yy, 0.0, 0.0, w.tt}};
  out.ab = {{-w.xx, -w.xy, 0.0, -w.xy, -w.yy, 0.0, 0.0, 0.0, 0.0}};
  out.g_b[0] = w.xx * e.f[0] + w.xy * e.f[1];
  out.g_b[1] = w.xy * e.f[0] + w.yy * e.f[1];
  out.g_a[0] = -out.g_b[0];
  out.g_a[1] = -out.g_b[1];
  return out;
}

}  // namespace mellin::graph_detail
