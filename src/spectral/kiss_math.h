/* Included before each of KissFFT's files: its twiddle factors come from the library's own sine and cosine instead of
   libm's, whose bits differ between platforms. */
#ifndef MELLIN_KISS_MATH_H
#define MELLIN_KISS_MATH_H

#include <math.h>

double mellin_kiss_cos(double x);
double mellin_kiss_sin(double x);

#define cos mellin_kiss_cos
#define sin mellin_kiss_sin

#endif
