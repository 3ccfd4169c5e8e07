#!/usr/bin/python3
"""Makes tests/golden/math.hpp: elementary functions to some 50 digits, worked out with decimal arithmetic independently
of the library and of any libm.

usage: tests/golden/math.py > tests/golden/math.hpp
"""
import math
import random
import struct
from decimal import Decimal, getcontext
from fractions import Fraction

getcontext().prec = 110  # arguments of 1e6 and results of 1e-16 leave more than 80 digits
getcontext().Emin, getcontext().Emax = -10000, 10000
EPSILON = Decimal(10) ** -100


def series(term, step):
    """Sums term, term * step(0), term * step(0) * step(1), ... until it no longer matters."""
    total, n = Decimal(0), 0
    while abs(term) > EPSILON * max(abs(total), Decimal(10) ** -400):
        total += term
        term *= step(n)
        n += 1
    return total


def arctan(t):
    """By halving the angle until the series is short: atan t = 2 atan(t / (1 + sqrt(1 + t^2)))."""
    if abs(t) > Decimal('0.01'):
        return 2 * arctan(t / (1 + (1 + t * t).sqrt()))
    return series(t, lambda n: -t * t * (2 * n + 1) / (2 * n + 3)) if t else t


PI = 4 * arctan(Decimal(1))


def sine(x):
    x = x - 2 * PI * (x / (2 * PI)).to_integral_value()
    return series(x, lambda n: -x * x / ((2 * n + 2) * (2 * n + 3))) if x else x


def cosine(x):
    x = x - 2 * PI * (x / (2 * PI)).to_integral_value()
    return series(Decimal(1), lambda n: -x * x / ((2 * n + 1) * (2 * n + 2)))


def angle(y, x):
    if x == 0:
        return PI / 2 * (1 if y > 0 else -1)
    a = arctan(y / x)
    return a if x > 0 else a + PI if y >= 0 else a - PI


def bits(x):
    return '0x%016xU' % struct.unpack('<Q', struct.pack('<d', x))[0]


def float_bits(x):
    return '0x%08xU' % struct.unpack('<I', struct.pack('<f', x))[0]


def to_float(x):
    return struct.unpack('<f', struct.pack('<f', x))[0]


def parts(exact):
    """The nearest double, and the double nearest to what that lacks."""
    high = float(Fraction(exact))
    return bits(high), bits(float(Fraction(exact) - Fraction(high)))


def table(name, kind, rows):
    print('inline constexpr %s %s[] = {' % (kind, name))
    for row in rows:
        print('    {%s},' % ', '.join(row))
    print('};\n')


rng = random.Random(20130611)
near_quarters = [k * math.pi / 2 for k in (1, 2, 3, 4, 7, 100, 12345, 636619)]
angles = [1e-300, 5e-324, 2.0 ** -30, 0.5, 0.785398163397448, 0.7853981633974484, 1.0, 999999.5, 1e6]
angles += near_quarters + [-near_quarters[0], -3.0]
angles += [rng.uniform(-math.pi, math.pi) for _ in range(60)] + [rng.uniform(-1e6, 1e6) for _ in range(30)]
powers = [1e-300, -1e-17, 1.0, -1.0, 0.34657359027997264, 0.3465735902799727, -0.34657359027997264, 709.78, -650.0,
          88.7, -87.3]
powers += [rng.uniform(-1, 1) for _ in range(30)] + [rng.uniform(-650, 650) for _ in range(30)]
values = [5e-324, 2.2e-308, 1e-300, 0.5, 0.7071067811865475, 0.7071067811865477, 1 - 2.0 ** -53, 1 + 2.0 ** -52, 1.0000001,
          1.4142135623730951, 2.0, 2.718281828459045, 10.0, 1.7976931348623157e308]
values += [rng.uniform(0.5, 2) for _ in range(40)] + [math.exp(rng.uniform(-700, 700)) for _ in range(30)]
vectors = [(1.0, 1.0), (-1.0, 1.0), (1.0, -1.0), (-1.0, -1.0), (1.0, 0.0), (-1.0, 0.0), (0.0, -1.0), (1e-10, 1.0),
           (1e-300, -1e300), (1e300, 1e-300), (3e-310, 4e-310), (1.7e308, 1.7e308), (0.125, 1.0), (0.1250000001, 1.0),
           (0.375, 1.0), (0.875, 1.0), (1.0, 0.875), (2.0 ** -28, 1.0), (1.0, 1.0 - 2.0 ** -53)]
vectors += [(rng.uniform(-1, 1), rng.uniform(-1, 1)) for _ in range(60)]
floats = [to_float(a) for a in (1e-30, 2.0 ** -12, 0.5, 0.78539814, 0.7853982, 1.0, 1000.0, 999.5)]
floats += [to_float(k * math.pi / 2) for k in (1, 2, 3, 4, 7, 100, 322, 636)]
floats += [to_float(rng.uniform(-math.pi, math.pi)) for _ in range(40)]
floats += [to_float(rng.uniform(-1000, 1000)) for _ in range(20)]

print('''// Made by tests/golden/math.py. Do not edit.
// clang-format off
#pragma once

#include <cstdint>

namespace golden {

/// Bit patterns of doubles: argument, the exact value's nearest double, and what that lacks.
struct Value {
  std::uint64_t x;
  std::uint64_t high;
  std::uint64_t low;
};
struct AngleValue {
  std::uint64_t y;
  std::uint64_t x;
  std::uint64_t high;
  std::uint64_t low;
};
/// A float argument, and sine and cosine as doubles.
struct FloatValue {
  std::uint32_t x;
  std::uint64_t sin;
  std::uint64_t cos;
};
''')
table('kSin', 'Value', [(bits(x), *parts(sine(Decimal(x)))) for x in angles])
table('kCos', 'Value', [(bits(x), *parts(cosine(Decimal(x)))) for x in angles])
table('kExp', 'Value', [(bits(x), *parts(Decimal(x).exp())) for x in powers])
table('kLog', 'Value', [(bits(x), *parts(Decimal(x).ln())) for x in values])
table('kAtan2', 'AngleValue', [(bits(y), bits(x), *parts(angle(Decimal(y), Decimal(x)))) for y, x in vectors])
table('kFloat', 'FloatValue',
      [(float_bits(x), bits(float(Fraction(sine(Decimal(x))))), bits(float(Fraction(cosine(Decimal(x))))))
       for x in floats])
print('''}  // namespace golden
// clang-format on''')
