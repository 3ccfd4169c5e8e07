// Elementary functions whose bits are the same on every machine. libm's differ between platforms, so the library calls
// none of them; sqrt, fabs, floor and fmod are exact in IEEE 754 and come from the compiler.
#pragma once

#include <cstdint>

namespace mellin {

inline constexpr double kPi = 3.14159265358979323846;
inline constexpr double kTwoPi = 6.28318530717958647693;
inline constexpr double kHalfPi = 1.57079632679489661923;

struct SinCos {
  double sin;
  double cos;
};
struct SinCosF {
  float sin;
  float cos;
};

// Errors are in ulp, units in the last place of the exact result; the bounds are held by tests/math_test.cpp (against
// long double, for float against double; every float in [-pi, pi] in its long sweep) and tests/math_golden_test.cpp.

/// Sine and cosine of x [rad], each within 0.85 ulp; sine odd and cosine even to the bit. |x| up to 1e6; beyond that,
/// or for NaN and infinity, both are NaN. Argument reduced after Cody and Waite (1980), the rest carried along.
SinCos sincos(double x);
/// The same in float arithmetic for |x| up to 1e3, each within 0.8 ulp.
SinCosF sincos(float x);

/// Angle of the vector (x, y) in [-pi, pi], within 0.55 ulp, below 1e-307 within 1 ulp; odd in y to the bit. The sign
/// of a zero does not count: 0 for (0, 0), pi for x < 0 and y = -0. Infinite arguments give the angle that is the
/// limit; NaN where an argument is NaN.
double atan2(double y, double x);

/// e^x within 0.8 ulp, subnormal results within 1; 0 below -745.13, infinity above 709.78: where the exact value rounds
/// to them.
double exp(double x);

/// Natural logarithm within 0.9 ulp, of subnormal numbers, too; -infinity at 0, NaN below.
double log(double x);

/// Square root, correctly rounded (IEEE 754); NaN below 0.
double sqrt(double x);
float sqrt(float x);

/// The angle moved by full turns of kTwoPi into [-pi, pi); to the last place of angle_rad.
double wrap_angle(double angle_rad);

bool is_finite(double x);

}  // namespace mellin
