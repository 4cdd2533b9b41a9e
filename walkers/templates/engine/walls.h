// SPDX-License-Identifier: GPL-2.0-or-later
// Copyright (c) 2026, the granular-walkers developers
/* The geometry of walls: planes, upright cylinders seen from within, and the facets of a surface.

   A facet is a face, or an edge or a corner that stands out toward the beads. A bead meets a facet
   where its distance from the surface has a local minimum in that facet: in cells of halves, which
   walkers/inputs/meshes computes. The gap is the distance of the centre from the plane, the edge or
   the corner, less the radius (docs/explanation/physics.md, "Faces, edges and corners"). */
#ifndef BRIDGE_WALLS_H
#define BRIDGE_WALLS_H

#include "vectors.h"

#include <algorithm>
#include <fstream>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

/* A wall where it rests. The functions take the displacement of the walls as their shift, m. */
class Wall {
public:
  static Wall plane(const Vec point, const Vec normal)
  {
    if (!(length(normal) > 0.)) throw std::runtime_error("a plane has a normal of no length");
    Wall wall(PLANE);
    wall.point_ = point;
    wall.direction_ = 1. / length(normal) * normal;
    return wall;
  }

  /* A cylinder with its axis along z. */
  static Wall cylinder(const double x, const double y, const double radius)
  {
    if (!(radius > 0.)) throw std::runtime_error("a cylinder has a radius that is not above 0");
    Wall wall(CYLINDER);
    wall.point_ = {x, y, 0.};
    wall.radius_ = radius;
    return wall;
  }

  /* Reads a file of facets and adds them to walls; README.md describes the file. */
  static void read_facets(const std::string &file, std::vector<Wall> &walls)
  {
    std::ifstream in(file.c_str());
    bool complete = static_cast<bool>(in);
    for (std::string word; complete && in >> word;) {
      Wall wall(word == "face" ? FACE : word == "edge" ? EDGE : CORNER);
      complete = (wall.kind_ != CORNER || word == "corner") && wall.read(in);
      walls.push_back(wall);
    }
    if (!complete || !in.eof()) throw std::runtime_error(file + " has no facets that can be read");
  }

  bool is_facet() const { return kind_ >= FACE; }

  /* Gap of a bead, m, and the unit vector n from the nearest point of the wall to its centre. */
  inline double gap(const Vec centre, const double radius, const Vec shift, Vec &n) const
  {
    Vec d = centre - point_ - shift;
    n = direction_;
    if (kind_ == PLANE || kind_ == FACE) return dot(n, d) - radius;
    if (kind_ == CYLINDER) {
      d.z = 0.;
      const double distance = length(d);
      n = -1. / distance * d;
      return radius_ - distance - radius;
    }
    d = d - dot(n, d) * n;
    const double distance = length(d);
    n = 1. / distance * d;
    return distance - radius;
  }

  /* A gap that is quick to compute, for finding beads near the wall. For a facet it is the gap to
     its box, which is at most the gap to the facet. */
  double lowest_gap(const Vec centre, const double radius, const Vec shift) const
  {
    Vec n;
    if (!is_facet()) return gap(centre, radius, shift, n);
    const Vec x = centre - shift, below = low_ - x, above = x - high_;
    const Vec outside = {std::max(0., std::max(below.x, above.x)),
                         std::max(0., std::max(below.y, above.y)),
                         std::max(0., std::max(below.z, above.z))};
    return length(outside) - radius;
  }

  /* Whether a point of the wall is nearer to a bead than all points of the surface around it. */
  bool meets(const Vec centre, const Vec shift) const
  {
    if (!is_facet()) return true;
    const Vec x = centre - shift;
    if (kind_ == FACE && !(dot(direction_, x - point_) > 0.)) return false;
    for (const Cell &cell : cells_) {
      const auto contains = [&](const Half &half) { return half.contains(x); };
      if (std::all_of(cell.begin(), cell.end(), contains)) return true;
    }
    return false;
  }

private:
  enum Kind { PLANE, CYLINDER, FACE, EDGE, CORNER };

  /* The points x with direction · (x - point) > bound. */
  struct Half {
    Vec point, direction;
    double bound;

    bool contains(const Vec x) const { return dot(direction, x - point) > bound; }
  };
  typedef std::vector<Half> Cell;  // the points in all of its halves

  Kind kind_;
  Vec point_;
  Vec direction_;            // normal of a plane or face, direction of an edge, 0 of others
  double radius_;            // of a cylinder, m
  std::vector<Cell> cells_;  // of a facet: where beads are whose nearest point is in it
  Vec low_, high_;           // of a facet: corners of its box

  explicit Wall(const Kind kind) : kind_(kind), point_(), direction_(), radius_(0.)
  {
    const double infinity = std::numeric_limits<double>::infinity();
    low_ = {infinity, infinity, infinity};
    high_ = {-infinity, -infinity, -infinity};
  }

  static bool read(std::ifstream &in, Vec &v) { return static_cast<bool>(in >> v.x >> v.y >> v.z); }

  /* Reads what follows the name of a kind of facet; returns false if it is incomplete. */
  bool read(std::ifstream &in)
  {
    size_t cells;
    if (!read(in, point_) || !read(in, direction_) || !(in >> cells)) return false;
    for (; cells; cells--) {
      size_t halves;
      if (!(in >> halves)) return false;
      cells_.push_back({});
      for (; halves; halves--) {
        Half half;
        if (!read(in, half.point) || !read(in, half.direction) || !(in >> half.bound)) return false;
        cells_.back().push_back(half);
        extend_box(half.point);
      }
    }
    return true;
  }

  void extend_box(const Vec point)
  {
    low_ = {std::min(low_.x, point.x), std::min(low_.y, point.y), std::min(low_.z, point.z)};
    high_ = {std::max(high_.x, point.x), std::max(high_.y, point.y), std::max(high_.z, point.z)};
  }
};

}
#endif
