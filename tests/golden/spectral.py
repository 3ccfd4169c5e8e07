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


def digest(cells, side):
    a = np.where(cells == 255, 0, cells / 254.).astype(np.float64)
    while len(a) > side:
        a = cv2.resize(cv2.dilate(a, np.ones((3, 3))), None, fx=.5, fy=.5, interpolation=cv2.INTER_AREA)
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


def features(picture):
    n = len(picture)
    a = edge_blurred(picture / 255., max(2, int(n * np.float32(.04))))
    full = np.fft.fft2(a)
    half = full[:, :n // 2 + 1]
    floor = 1e-3 * np.abs(half).mean()
    f = np.fft.fftfreq(n) * n
    weighted = np.abs(full) * np.hypot(f[:, None], f[None, :])
    angle = -np.pi / 2 + np.arange(n) * np.pi / n
    radius = np.arange(1, n // 2 + 1)
    # Frequency (0, 0) in the middle of a picture twice periodic, so that no sample lies outside.
    tiled = np.tile(np.roll(weighted, (n // 2, n // 2), (0, 1)), (2, 2))
    x, y = radius[:, None] * np.cos(angle), radius[:, None] * np.sin(angle)
    rings = bilinear(tiled, x + n // 2, y + n // 2 + n * (y < 0), 'nearest')
    rings -= rings.mean(1, keepdims=True)
    return dict(a=a, white=full / (np.abs(full) + floor), floor=floor, rings=rings / np.sqrt((rings ** 2).sum()))


def centre_of_mass(q, *at):
    """The position of the maximum `at`, refined over its 3 ^ dim neighbours."""
    d = np.arange(-1, 2)
    box = np.maximum(q[np.ix_(*[(i + d) % len(q) for i in at])], 0)
    return [i + (box.sum(tuple(k for k in range(q.ndim) if k != axis)) @ d) / box.sum() for axis, i in enumerate(at)]


def match(f, g):
    n = len(f['a'])
    # Cyclic cross-correlation of all rings, written out: B turned on by k steps looks like A.
    q = np.array([(f['rings'] * np.roll(g['rings'], k, 1)).sum() for k in range(n)])
    peaks = [i for i in range(n) if q[i] >= .5 * q.max() and q[i] >= max(q[(i + d) % n] for d in (-2, -1, 1, 2))]
    frequency = np.fft.fftfreq(n)
    low = np.exp(-.5 * (frequency[:, None] ** 2 + frequency[None, :] ** 2) / .25 ** 2)
    centre = (n - 1) / 2
    y, x = np.mgrid[0:n, 0:n] - centre
    result = []
    for i in sorted(peaks, key=lambda k: -q[k])[:6]:
        for half in (0, np.pi):
            beta = centre_of_mass(q, i)[0] * np.pi / n + half
            c, s = np.cos(beta), np.sin(beta)
            padded = np.pad(g['a'], 1)
            turned = bilinear(padded, c * x + s * y + centre + 1, -s * x + c * y + centre + 1, 'constant')
            spectrum = np.fft.fft2(turned)
            white = spectrum / (np.abs(spectrum) + g['floor'])
            surface = np.fft.ifft2(f['white'] * np.conj(white) * low).real * n * n / low.sum()
            top = np.unravel_index(np.argmax(surface), surface.shape)
            ty, tx = [(v + n / 2) % n - n / 2 for v in centre_of_mass(surface, *top)]
            result.append((tx, ty, (beta + np.pi) % (2 * np.pi) - np.pi, surface[top], q[i]))
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
floats('kDigest', digest(cells, 8))
octets('kObserved', np.packbits(masks(cells, 8)[0].ravel(), bitorder='little'))
octets('kFree', np.packbits(masks(cells, 8)[1].ravel(), bitorder='little'))
a, b = rooms(48, 0, 0, 0, 7), rooms(48, np.radians(52), 3.3, -2.6, 2)
octets('kPictureA', a)
octets('kPictureB', b)
print('/// x [pixels], y [pixels], theta [rad], peak, rotation peak; best first.')
for row in [match(features(a), features(b))]:
    print(f'inline constexpr double kHypotheses[][5] = {{' + ', '.join('{' + ', '.join(f'{v:.6f}' for v in h) + '}' for h in row) + '};')
print('\n}  // namespace golden\n// clang-format on')
