#!/usr/bin/python3
"""Makes tests/golden/spectral.hpp: what grid images, digests and the spectral matcher have to give, worked out with
numpy, scipy and OpenCV in double precision, step by step from the paper and independently of the library.

usage: tests/golden/spectral.py > tests/golden/spectral.hpp       (needs python3-numpy, python3-scipy, python3-opencv)
"""
import cv2
import numpy as np
from scipy import ndimage

rng = np.random.default_rng(20130611)


# --- grid images ------------------------------------------------------------------------------------------------------
def edge_blurred(a, margin):
    """A margin blended into the cyclically blurred picture; standard deviation half the margin, cut at four."""
    soft = ndimage.gaussian_filter(a, margin / 2, mode='wrap', truncate=4)
    i = np.arange(len(a))
    distance = np.minimum(i, i[::-1])
    keep = np.clip(np.minimum.outer(distance, distance) / margin, 0, 1)
    return keep * a + (1 - keep) * soft


PREPROCESSING = dict(none=lambda a: a, erosion=lambda a: cv2.dilate(a, np.ones((3, 3))),
                     blur=lambda a: cv2.GaussianBlur(a, (9, 9), 1))


def digest(cells, side, preprocessing='erosion'):
    prepare = PREPROCESSING[preprocessing]
    a = np.where(cells == 255, 0, cells / 254.).astype(np.float64)
    if len(a) == side:
        a = prepare(a)
        return a / a.max()
    while len(a) > side:
        a = cv2.resize(prepare(a), None, fx=.5, fy=.5, interpolation=cv2.INTER_AREA)
        a /= a.max()
    return a


def masks(cells, side):
    f = len(cells) // side
    blocks = cells.reshape(side, f, side, f).transpose(0, 2, 1, 3).reshape(side, side, -1)
    known = blocks != 255
    observed = known.mean(-1) >= .5
    free = observed & (np.where(known, blocks, 0).max(-1) < 64)
    return observed, free


# --- the matcher ------------------------------------------------------------------------------------------------------
def wall(picture, x0, y0, x1, y1):
    """Draws with soft edges: a pixel's value falls with its distance to the segment, so that nothing is aliased."""
    n = len(picture)
    y, x = np.mgrid[0:n, 0:n]
    x, y = x - (n - 1) / 2, y - (n - 1) / 2
    dx, dy = x1 - x0, y1 - y0
    t = np.clip(((x - x0) * dx + (y - y0) * dy) / (dx * dx + dy * dy), 0, 1)
    picture[:] = np.maximum(picture, np.clip(1.6 - np.hypot(x - x0 - t * dx, y - y0 - t * dy), 0, 1))


def rooms(n, theta, tx, ty, skip):
    """A small floor plan seen from a frame whose pose in the plan is (tx, ty, theta), pixels, without wall `skip`."""
    plan = [(-16, -8, 12, -8), (-16, -8, -16, 6), (-16, 6, -4, 6), (0, 6, 12, 6), (12, -8, 12, 6), (-4, 6, -4, 15),
            (-4, 15, 9, 15), (-8, -8, -8, 1), (4, -3, 8, 1), (9, 15, 9, 9)]
    c, s = np.cos(theta), np.sin(theta)
    turn = lambda x, y: (c * (x - tx) + s * (y - ty), -s * (x - tx) + c * (y - ty))
    picture = np.zeros((n, n))
    for i, (x0, y0, x1, y1) in enumerate(plan):
        if i != skip:
            wall(picture, *turn(x0, y0), *turn(x1, y1))
    return np.round(picture * 255).astype(np.uint8)


def bilinear(a, x, y, beyond):
    """a[y, x] between pixels; `beyond`: how scipy treats what lies outside."""
    return ndimage.map_coordinates(a, [y, x], order=1, mode=beyond)


def high_passed(magnitude, kind):
    n = len(magnitude)
    f = np.fft.fftfreq(n)
    if kind == 'reddy':
        x = np.outer(np.cos(np.pi * f), np.cos(np.pi * f))
        return magnitude * (1 - x) * (2 - x)
    return magnitude * (np.hypot(f[:, None], f[None, :]) * n if kind == 'radius' else 1)


def whitened(spectrum):
    """Phases; a thousandth of the mean magnitude (of the half that a real transform stores) is added to magnitudes."""
    floor = 1e-3 * np.abs(spectrum[:, :len(spectrum) // 2 + 1]).mean()
    return spectrum / (np.abs(spectrum) + floor), floor


def features(picture, mode='rings', high_pass='radius', free=None):
    """free: the mask of what was observed, where free space counts -1."""
    n = len(picture)
    share = picture / 255.
    a = edge_blurred(share if free is None else np.where(free, 2 * share - 1, share), max(2, int(n * np.float32(.04))))
    full = np.fft.fft2(a)
    white, floor = whitened(full)
    weighted = high_passed(np.abs(full), high_pass)
    i = np.arange(n)
    angle = -np.pi / 2 + i * (2 if 'log' in mode else 1) * np.pi / n
    radius = dict(rings=np.arange(1, n // 2 + 1), linear_polar=(i + 1) / 2).get(mode, (n / 2) ** (i / n))
    # Frequency (0, 0) in the middle of a picture twice periodic, so that no sample lies outside.
    tiled = np.tile(np.roll(weighted, (n // 2, n // 2), (0, 1)), (2, 2))
    x, y = radius[:, None] * np.cos(angle), radius[:, None] * np.sin(angle)
    polar = bilinear(tiled, x + n // 2 + n * (x < 0), y + n // 2 + n * (y < 0), 'nearest')
    if mode == 'rings':
        polar -= polar.mean(1, keepdims=True)
        polar /= np.sqrt((polar ** 2).sum())
    else:
        # Real spectra are halved along the last axis: the angle, as in the library, so the mean is the same one.
        polar = whitened(np.fft.fft2(polar))[0]
    return dict(a=a, white=white, floor=floor, polar=polar, mode=mode)


def centre_of_mass(q, *at, radius=1):
    """The position of the maximum `at`, refined over the neighbours within `radius` on each axis."""
    d = np.arange(-radius, radius + 1)
    box = np.maximum(q[np.ix_(*[(i + d) % n for i, n in zip(at, q.shape)])], 0)
    return [i + (box.sum(tuple(k for k in range(q.ndim) if k != axis)) @ d) / box.sum() for axis, i in enumerate(at)]


def gaussian(q, *at):
    """The same by a parabola through the logarithms, axis by axis; by the centre of mass where there are none."""
    out = centre_of_mass(q, *at)
    for axis, i in enumerate(at):
        values = [q[tuple((k + d * (m == axis)) % q.shape[m] for m, k in enumerate(at))] for d in (-1, 0, 1)]
        if min(values) > 0:
            out[axis] = i - np.polyfit([-1, 0, 1], np.log(values), 2)[1] / 2 / np.polyfit([-1, 0, 1], np.log(values), 2)[0]
    return out


def rotations(f, g, share, fit):
    """(angle, scale, strength), strongest first."""
    n = len(f['a'])
    if f['mode'] == 'rings':
        # Cyclic cross-correlation of all rings, written out: B turned on by k steps looks like A.
        surface = np.array([[(f['polar'] * np.roll(g['polar'], k, 1)).sum() for k in range(n)]])
    else:
        surface = np.fft.ifft2(f['polar'] * np.conj(g['polar'])).real * (2 if 'log' in f['mode'] else 1)
        if f['mode'] != 'log_polar_scale':
            surface = surface[:1]
    count = n // 2 if 'log' in f['mode'] else n
    surface = surface[:, :count]
    q = surface.max(0)
    peaks = [i for i in range(count) if q[i] >= share * q.max() and q[i] >= max(q[(i + d) % count] for d in (-2, -1, 1, 2))]
    for i in sorted(peaks, key=lambda k: -q[k])[:6]:
        row = int(np.argmax(surface[:, i]))
        if len(surface) == 1:
            yield fit(q, i)[0] * np.pi / count, 1, q[i]
        else:
            # Out of half the angles: the surface's own period.
            y, x = fit(surface, row, i)
            yield x * np.pi / count, (n / 2) ** (-(y - n * (row >= n / 2)) / n), q[i]


def coefficients(f, m, g, w, least):
    """The correlation coefficient of what both have observed at every cyclic shift (Padfield 2012), 0 where that is
    less than `least` of the smaller mask."""
    spectrum = np.fft.fft2
    sums = lambda u, v: np.fft.ifft2(spectrum(u) * np.conj(spectrum(v))).real
    n, f1, g1 = np.maximum(sums(m, w), 1e-9), sums(f * m, w), sums(m, g * w)
    variance = (sums(f * f * m, w) - f1 ** 2 / n) * (sums(m, g * g * w) - g1 ** 2 / n)
    covariance = sums(f * m, g * w) - f1 * g1 / n
    known = (n >= least * min(m.sum(), w.sum()) - .5) & (variance > 1e-9)
    return np.where(known, covariance / np.sqrt(np.where(known, variance, 1)), 0)


def match(f, g, share=.5, low_pass=.25, fit=centre_of_mass, seen=None):
    n = len(f['a'])
    frequency = np.fft.fftfreq(n)
    low = np.exp(-.5 * (frequency[:, None] ** 2 + frequency[None, :] ** 2) / low_pass ** 2)
    centre = (n - 1) / 2
    y, x = np.mgrid[0:n, 0:n] - centre
    result = []
    for angle, scale, strength in rotations(f, g, share, fit):
        for half in (0, np.pi):
            beta = angle + half
            c, s = np.cos(beta) / scale, np.sin(beta) / scale
            padded = np.pad(g['a'], 1)
            turned = bilinear(padded, c * x + s * y + centre + 1, -s * x + c * y + centre + 1, 'constant')
            spectrum = np.fft.fft2(turned)
            white = spectrum / (np.abs(spectrum) + g['floor'])
            surface = np.fft.ifft2(f['white'] * np.conj(white) * low).real * n * n / low.sum()
            if seen:
                mask = bilinear(np.pad(seen[1] * 1., 1), c * x + s * y + centre + 1, -s * x + c * y + centre + 1, 'constant')
                surface = coefficients(f['a'], seen[0] * 1., turned, (mask >= .5) * 1., .3)
            top = np.unravel_index(np.argmax(surface), surface.shape)
            ty, tx = [(v + n / 2) % n - n / 2 for v in fit(surface, *top)]
            result.append((tx, ty, (beta + np.pi) % (2 * np.pi) - np.pi, surface[top], strength, scale))
    return sorted(result, key=lambda h: -h[3])


# --- output -----------------------------------------------------------------------------------------------------------
def floats(name, values):
    text = ', '.join(f'{v:.7g}' if '.' in f'{v:.7g}' or 'e' in f'{v:.7g}' else f'{v:.7g}.0' for v in np.ravel(values))
    print(f'inline constexpr double {name}[] = {{{text}}};')


def octets(name, values):
    print(f'inline constexpr std::uint8_t {name}[] = {{{", ".join(str(int(v)) for v in np.ravel(values))}}};')


print('// Made by tests/golden/spectral.py. Do not edit.\n// clang-format off\n#pragma once\n\n#include <cstdint>\n\n'
      'namespace golden {\n')
small = rng.random((16, 16))
floats('kImage', small)
floats('kThickened', cv2.dilate(small, np.ones((3, 3))))
floats('kBlurred', cv2.GaussianBlur(small, (9, 9), 1))
floats('kEdgeBlurred', edge_blurred(small, 3))
cells = rng.integers(0, 255, (32, 32)) * (rng.random((32, 32)) < .2)
cells[rng.random((32, 32)) < .3] = 255
cells[8:16, 4:20] = np.where(cells[8:16, 4:20] == 255, 255, cells[8:16, 4:20] % 90)
cells[20:27, 20:] = 255
octets('kCells', cells)
for name in PREPROCESSING:
    floats('kDigest' + name.capitalize(), digest(cells, 8, name))
    floats('kFull' + name.capitalize(), digest(cells, 32, name))
octets('kObserved', np.packbits(masks(cells, 8)[0].ravel(), bitorder='little'))
octets('kFree', np.packbits(masks(cells, 8)[1].ravel(), bitorder='little'))
a, b = rooms(48, 0, 0, 0, 7), rooms(48, np.radians(52), 3.3, -2.6, 2)
octets('kPictureA', a)
octets('kPictureB', b)
print('/// x [pixels], y [pixels], theta [rad], peak, rotation peak, scale; best first.')


def hypotheses(name, rows):
    text = ', '.join('{' + ', '.join(f'{v:.6f}' for v in h) + '}' for h in rows)
    print(f'inline constexpr double {name}[][6] = {{{text}}};')


def run(mode='rings', high_pass='radius', **options):
    return match(features(a, mode, high_pass), features(b, mode, high_pass), **options)


hypotheses('kHypotheses', run())
hypotheses('kLinearPolar', run('linear_polar', 'none', fit=lambda q, *at: centre_of_mass(q, *at, radius=2)))
hypotheses('kLogPolar', run('log_polar', 'radius', fit=gaussian))
y, x = np.mgrid[0:48, 0:48] - 23.5
seen = np.hypot(x - 3, y + 2) < 19, np.hypot(x + 2.3, y - 1) < 20
octets('kMaskA', np.packbits(seen[0].ravel(), bitorder='little'))
octets('kMaskB', np.packbits(seen[1].ravel(), bitorder='little'))
hypotheses('kMasked', run(seen=seen))
hypotheses('kFreeSpace', match(features(a, free=seen[0]), features(b, free=seen[1])))
hypotheses('kPaper', run('log_polar_scale', 'reddy', share=.9, low_pass=1e9))
print('\n}  // namespace golden\n// clang-format on')
