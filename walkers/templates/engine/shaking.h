// SPDX-License-Identifier: GPL-2.0-or-later
// Copyright (c) 2026, the granular-walkers developers
/* Shaking and gravity. All walls move as one, by the displacement

       u(t) = r(t) Σ A_k g_k(t),    g_k = sin(ω_k t + φ_k), or a recorded course,

   with an amplitude A_k for each wave and a ramp r(t), or 1 without one. Its derivatives follow
   from the product rule. In the frame of the laboratory the walls move; in their own frame they
   rest, and each bead of mass m has the inertial force -m d²u/dt². The weight m g acts in both.

   Beads may have loads of their own, gravity and amplitudes, so that the cases of one deck
   differ. */
#ifndef BRIDGE_SHAKING_H
#define BRIDGE_SHAKING_H

#include "engine.h"
#include "vectors.h"

#include <algorithm>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

/* A function of time, given in pieces: from the time of a piece to that of the next one it is
   the sum of the piece's coefficients times powers of the time since. */
class Course {
public:
  Course() : period_(0.), largest_(0.) {}

  /* Reads a file: the period in s after which the course repeats, or 0; then a row for each
     piece. */
  explicit Course(const std::string &file) : period_(-1.), largest_(0.)
  {
    std::ifstream in(file.c_str());
    in >> period_;
    bool complete = true;
    for (Piece piece; in >> piece.time;) {
      for (double &coefficient : piece.coefficients)
        if (!(in >> coefficient)) complete = false;
      largest_ = std::max(largest_, std::fabs(piece.coefficients[0]));
      pieces_.push_back(piece);
    }
    if (!complete || !in.eof() || pieces_.empty() || !(period_ >= 0.))
      throw std::runtime_error(file + " has no course that can be read");
  }

  bool empty() const { return pieces_.empty(); }

  /* The largest absolute value at the start of a piece. */
  double largest() const { return largest_; }

  /* Value (order 0), first or second derivative at a time, s. */
  double at(double time, const int order) const
  {
    if (period_ > 0.) time -= period_ * std::floor(time / period_);
    const auto is_before = [](const double time, const Piece &piece) { return time < piece.time; };
    const Piece &piece = *--std::upper_bound(pieces_.begin() + 1, pieces_.end(), time, is_before);
    double sum = 0.;
    for (int k = DEGREE; k >= order; k--)
      sum = sum * (time - piece.time) + piece.coefficients[k] * factor(k, order);
    return sum;
  }

private:
  enum { DEGREE = 5 };

  struct Piece {
    double time, coefficients[DEGREE + 1];
  };

  double period_, largest_;
  std::vector<Piece> pieces_;

  /* The factor of the power k in the derivative of this order. */
  static int factor(const int k, const int order)
  {
    if (order == 0) return 1;
    return order == 1 ? k : k * (k - 1);
  }
};

/* A sine, or a recorded course. */
struct Wave {
  Vec amplitude;            // m
  double frequency, phase;  // of a sine: rad/s, rad
  Course course;            // of a record; empty for a sine

  /* Displacement (order 0), velocity (1) or acceleration (2) for an amplitude of 1, without
     ramp. */
  double at(const double time, const int order) const
  {
    if (!course.empty()) return course.at(time, order);
    const double w = frequency, turn = w * time + phase;
    if (order == 0) return std::sin(turn);
    return order == 1 ? w * std::cos(turn) : -w * w * std::sin(turn);
  }

  /* The largest displacement, m. */
  double largest() const { return length(amplitude) * (course.empty() ? 1. : course.largest()); }
};

class Shaking {
public:
  // From the command.
  std::vector<Wave> waves;
  Course ramp;        // factor of the displacement; empty: 1
  Vec gravity;        // m/s²
  bigint begin;       // step at which the time is 0
  bool in_lab_frame;  // the walls move

  Shaking() : gravity{0., 0., 0.}, begin(0), in_lab_frame(true), shift_(), velocity_() {}

  /* To be called once the command is read. The file contains the loads of the beads whose loads
     differ from those of the command; it is "" if there are none. The largest number of a bead is
     largest_tag. */
  void set_loads(const std::string &file, const size_t largest_tag)
  {
    loads_.assign(1, gravity);
    for (const Wave &wave : waves) loads_.push_back(wave.amplitude);
    inertial_.assign(waves.size(), 0.);
    if (!file.empty()) read_loads(file, largest_tag);
  }

  /* The largest displacement of walls that move, m. */
  double largest_displacement() const
  {
    if (!in_lab_frame) return 0.;
    double sum = 0.;
    for (const Wave &wave : waves) sum += wave.largest();
    return ramp.empty() ? sum : sum * ramp.largest();
  }

  Vec shift() const { return shift_; }        // of the walls now, m
  Vec velocity() const { return velocity_; }  // of the walls, m/s

  /* Moves the walls to where they are at a step. Their velocity is that of the time which is
     `earlier` seconds before. */
  void move(const bigint step, const double time_step, const double earlier)
  {
    shift_ = velocity_ = {0., 0., 0.};
    const double time = (step - begin) * time_step;
    for (size_t k = 0; k < waves.size(); k++) {
      const Wave &wave = waves[k];
      inertial_[k] = in_lab_frame || time < 0. ? 0. : -motion(wave, time, 2);
      if (time < 0. || !in_lab_frame) continue;
      shift_ = shift_ + motion(wave, time, 0) * wave.amplitude;
      velocity_ = velocity_ + motion(wave, time - earlier, 1) * wave.amplitude;
    }
  }

  /* Adds weight and inertial force to the forces of the beads of a group. */
  void add_forces(Atom *const atom, const int group) const
  {
    const size_t width = 1 + waves.size(), beads = loads_.size() / width;
    for (int i = 0; i < atom->nlocal; i++) {
      if (!(atom->mask[i] & group)) continue;
      const size_t tag = atom->tag[i];
      const Vec *const load = &loads_[tag < beads ? tag * width : 0];
      Vec acceleration = load[0];
      for (size_t k = 0; k < waves.size(); k++)
        acceleration = acceleration + inertial_[k] * load[1 + k];
      add_to(atom->f[i], atom->rmass[i] * acceleration);
    }
  }

private:
  std::vector<Vec> loads_;  // gravity and amplitudes by the number of a bead; 0: the command's
  std::vector<double> inertial_;  // acceleration now of each wave, for an amplitude of 1
  Vec shift_, velocity_;

  void read_loads(const std::string &file, const size_t largest_tag)
  {
    std::ifstream in(file.c_str());
    const size_t width = loads_.size();
    while (loads_.size() < (largest_tag + 1) * width)
      loads_.push_back(loads_[loads_.size() - width]);
    bool complete = static_cast<bool>(in);
    for (size_t tag; complete && in >> tag;) {
      complete = tag > 0 && tag <= largest_tag;
      for (size_t k = tag * width; complete && k < (tag + 1) * width; k++)
        complete = static_cast<bool>(in >> loads_[k].x >> loads_[k].y >> loads_[k].z);
    }
    if (!complete || !in.eof()) throw std::runtime_error(file + " has no loads that can be read");
  }

  /* A wave with the ramp; orders as in Wave::at. */
  double motion(const Wave &wave, const double time, const int order) const
  {
    if (ramp.empty()) return wave.at(time, order);
    double sum = 0.;
    for (int k = 0; k <= order; k++) {
      const double binomial = order == 2 && k == 1 ? 2. : 1.;
      sum += binomial * ramp.at(time, k) * wave.at(time, order - k);
    }
    return sum;
  }
};

}
#endif
