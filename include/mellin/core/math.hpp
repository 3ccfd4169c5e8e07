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

/// Sine and cosine of x [rad]. |x| up to 1e6; beyond that, or for NaN and infinity, both are NaN.
SinCos sincos(double x);
/// The same in float arithmetic for |x| up to 1e3.
SinCosF sincos(float x);

/// Angle of the vector (x, y) in [-pi, pi]; 0 for (0, 0); NaN where an argument is NaN.
double atan2(double y, double x);

/// e^x; 0 below -745, infinity above 709.78.
double exp(double x);

/// Natural logarithm; -infinity at 0, NaN below.
double log(double x);

double sqrt(double x);
float sqrt(float x);

/// The angle moved by full turns into [-pi, pi).
double wrap_angle(double angle_rad);

bool is_finite(double x);

}  // namespace mellin
