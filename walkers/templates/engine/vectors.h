// SPDX-License-Identifier: GPL-2.0-or-later
// Copyright (c) 2026, the granular-walkers developers
/* Vectors of three numbers, and rows of the engine's arrays as such vectors. */
#ifndef BRIDGE_VECTORS_H
#define BRIDGE_VECTORS_H

#include <cmath>

namespace {

struct Vec {
  double x, y, z;
};
inline Vec operator+(const Vec a, const Vec b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Vec operator-(const Vec a, const Vec b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Vec operator*(const double s, const Vec a) { return {s * a.x, s * a.y, s * a.z}; }
inline double dot(const Vec a, const Vec b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Vec cross(const Vec a, const Vec b)
{
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline double length(const Vec a) { return std::sqrt(dot(a, a)); }
inline Vec &vec(double *const p) { return *reinterpret_cast<Vec *>(p); }
inline void add_to(double *const p, const Vec a) { vec(p) = vec(p) + a; }

}
#endif
