// SPDX-License-Identifier: GPL-2.0-or-later
// Copyright (c) 2026, the granular-walkers developers
/* The fix of walls. */
#ifndef BRIDGE_WALLS_H
#define BRIDGE_WALLS_H

#include "law.h"

namespace {

/* Planes, the insides of upright cylinders and facets of other surfaces, shaken as one. */
class FixWallBridge : public Fix {
public:
  FixWallBridge(LAMMPS *lmp, int count, char **args) : Fix(lmp, count, args), law_(0), type_(0), begin_(0), moves_(true), ramp_(), sway_(0.)
  {
    int at = 3;
    const auto next = [&]() {
      if (at == count) this->error->fix_error(FLERR, this, "the command ends early");
      return args[at++];
    };
    const auto number = [&]() { return this->force->numeric(FLERR, next()); };
    const auto vector = [&]() {
      const double x = number(), y = number();
      return Vec{x, y, number()};
    };
    std::string file;
    Vec gravity = {0., 0., 0.};
    while (at < count) {
      const std::string word = next();
      if (word == "type") type_ = static_cast<int>(number());
      else if (word == "plane") {
        const Vec point = vector(), normal = vector();
        if (!(length(normal) > 0.)) error->fix_error(FLERR, this, "a plane has a normal of no length");
        walls_.push_back({1. / length(normal) * normal, point, 0., ALL, {}, {}, {}});
      } else if (word == "cylinder") {
        const double x = number(), y = number();
        walls_.push_back({{0., 0., 0.}, {x, y, 0.}, number(), ALL, {}, {}, {}});
        if (!(walls_.back().radius > 0.)) error->fix_error(FLERR, this, "a cylinder has a radius that is not above 0");
      } else if (word == "facets") read_facets(next());
      else if (word == "shaken") {
        const Vec amplitude = vector();
        const double frequency = 2. * M_PI * number();
        waves_.push_back({amplitude, frequency, number(), 0., -1});
        sway_ += length(amplitude);
      } else if (word == "recorded") {
        const Vec amplitude = vector();
        waves_.push_back({amplitude, 0., 0., 0., static_cast<int>(records_.size())});
        records_.push_back(read_course(next()));
        sway_ += length(amplitude) * records_.back().most;
      } else if (word == "ramp") ramp_ = read_course(next());
      else if (word == "gravity") gravity = vector();
      else if (word == "begin") begin_ = static_cast<bigint>(number());
      else if (word == "frame") {
        const std::string frame = next();
        moves_ = frame == "lab";
        if (!moves_ && frame != "walls") error->fix_error(FLERR, this, ("expected lab or walls, not " + frame).c_str());
      } else if (word == "loads") file = next();
      else error->fix_error(FLERR, this, ("unknown keyword " + word).c_str());
    }
    if (walls_.empty()) error->fix_error(FLERR, this, "expected a plane, a cylinder or facets");
    if (type_ < 1 || type_ > atom->ntypes) error->fix_error(FLERR, this, "expected a type, of those of the box");
    if (moves_ && !file.empty()) error->fix_error(FLERR, this, "loads need the walls' frame: expected frame walls");
    if (!ramp_.pieces.empty()) sway_ *= ramp_.most;
    loads_.push_back(gravity);
    for (const Wave &wave : waves_) loads_.push_back(wave.amplitude);
    if (!file.empty()) read_loads(file);
    width_ = HISTORY * walls_.size();
    create_attribute = restart_peratom = local_flag = local_freq = nevery = 1;
    size_local_rows = 0;
    size_local_cols = COLUMNS;
    grow_arrays(atom->nmax);
    for (const int of : {0, 1}) atom->add_callback(of);
  }

  ~FixWallBridge()
  {
    for (const int of : {0, 1}) atom->delete_callback(id, of);
  }

  int setmask() { return FixConst::PRE_NEIGHBOR | FixConst::POST_FORCE | FixConst::END_OF_STEP; }
  int min_type() { return type_; }  // the materials' tables reach as far as the types that are used
  int max_type() { return type_; }
  void init()
  {
    law_ = Law::laws()[lmp];
    if (!law_) error->fix_error(FLERR, this, "the pair style has no cohesion bridge");
  }

  void setup_pre_neighbor() { pre_neighbor(); }

  /* Lists who has a bridge to a wall, or is so near that it may form one before neighbours are listed anew: until then
     beads go less than the skin, and walls twice their amplitudes. */
  void pre_neighbor()
  {
    double reach = law_->formed() + neighbor->skin, farther = law_->longest() - law_->formed();
    if (moves_) reach += 2. * sway_;
    near_.clear();
    move(0.);
    for (int wall = 0; wall < static_cast<int>(walls_.size()); wall++)
      for (int i = 0; i < atom->nlocal; i++) {
        Vec n;
        if (!(atom->mask[i] & groupbit)) continue;
        const Surface &of = walls_[wall];
        const double gap = of.part == ALL ? gap_at(wall, i, n) : box_gap(of, i) - farther;
        if (gap > reach && history_of(i, wall)[TABLE] == 0.) continue;
        near_.push_back({i, wall});
      }
  }

  void setup(int)
  {
    move(0.);
    push();
    evaluate(true, false, 0);
    tell();
  }

  void post_force(int)
  {
    move(0.5 * update->dt);  // velocities are still those of half a step before
    push();
    evaluate(true, true, 0);
  }

  /* Rows are of the velocities at the end of the step, as those of pairs are and what a dump says of the beads. */
  void end_of_step()
  {
    if (update->ntimestep != output->next_dump_any) return;
    move(0.);
    tell();
  }

  void grow_arrays(int most) { history_.resize(static_cast<size_t>(most) * width_); }
  void copy_arrays(int from, int to, int) { std::copy_n(of(from), width_, of(to)); }
  void set_arrays(int i) { std::fill_n(of(i), width_, 0.); }
  int pack_exchange(int i, double *buffer) { return std::copy_n(of(i), width_, buffer) - buffer; }
  int unpack_exchange(int i, double *buffer)
  {
    std::copy_n(buffer, width_, of(i));
    return width_;
  }
  int size_restart(int) { return width_ + 1; }
  int maxsize_restart() { return width_ + 1; }
  int pack_restart(int i, double *buffer)
  {
    buffer[0] = width_ + 1;
    return 1 + pack_exchange(i, buffer + 1);
  }
  void unpack_restart(int i, int number)
  {
    double *kept = atom->extra[i];
    for (; number; number--) kept += static_cast<int>(kept[0]);
    if (kept[0] != width_ + 1) error->fix_error(FLERR, this, "the restart file has another number of walls");
    unpack_exchange(i, kept + 1);
  }

private:
  enum { COLUMNS = 12 };  // foot, bead: x, y, z; wall, id; force: x, y, z; overlap

  enum Part { ALL, FACE, EDGE, CORNER };

  struct Half {
    Vec at, way;
    double least;
  };

  /* Of an edge the normal is its direction, of a corner 0. Cells are where beads are whose nearest point is in a facet;
     low and high are the corners of its box. */
  struct Surface {
    Vec normal, point;
    double radius;  // of a cylinder, 0 of others
    Part part;
    std::vector<std::vector<Half>> cells;
    Vec low, high;
  };

  struct Wave {
    Vec amplitude;
    double frequency, phase, push;  // rad/s, rad; inertial acceleration now for an amplitude of 1
    int record;                     // of a motion that is recorded, -1 of a sine
  };

  /* From a time on, a course is the sum of these times powers of the time since, until the next such piece. */
  struct Piece {
    double time, powers[6];
  };

  struct Course {
    double period, most;  // after which it repeats, or 0; largest value at the begin of a piece
    std::vector<Piece> pieces;

    /* Its value (order 0), and the first or the second derivative. */
    double at(double time, const int order) const
    {
      if (period > 0.) time -= period * std::floor(time / period);
      const auto later = [](const double now, const Piece &piece) { return now < piece.time; };
      const Piece &piece = *--std::upper_bound(pieces.begin() + 1, pieces.end(), time, later);
      double sum = 0.;
      for (int k = 5; k >= order; k--)
        sum = sum * (time - piece.time) + piece.powers[k] * (order == 0 ? 1 : order == 1 ? k : k * (k - 1));
      return sum;
    }
  };

  struct Near {
    int bead, wall;
  };

  const Law *law_;
  int type_, width_;
  std::vector<Surface> walls_;
  std::vector<double> history_;  // of each bead at each wall
  std::vector<Wave> waves_;
  std::vector<Course> records_;
  Course ramp_;  // of the factor of the displacement
  double sway_;  // largest displacement
  std::vector<Near> near_;
  std::vector<Vec> loads_;  // by the ids of beads, first the command's: gravity, amplitude of each wave
  bigint begin_;
  bool moves_;            // in the frame of the laboratory
  Vec shift_, velocity_;  // of the walls now
  std::vector<double> cells_;
  std::vector<double *> rows_;

  double *of(const int i) { return &history_[static_cast<size_t>(i) * width_]; }

  void read_loads(const std::string &file)
  {
    std::ifstream in(file.c_str());
    const size_t most = atom->tag_max(), width = loads_.size();
    while (loads_.size() < (most + 1) * width) loads_.push_back(loads_[loads_.size() - width]);
    bool whole = static_cast<bool>(in);
    for (size_t bead; whole && in >> bead;) {
      whole = bead > 0 && bead <= most;
      for (size_t k = bead * width; whole && k < (bead + 1) * width; k++)
        whole = static_cast<bool>(in >> loads_[k].x >> loads_[k].y >> loads_[k].z);
    }
    if (!whole || !in.eof()) error->fix_error(FLERR, this, (file + " has no loads that can be read").c_str());
  }

  void read_facets(const std::string &file)
  {
    const double far = std::numeric_limits<double>::infinity();
    std::ifstream in(file.c_str());
    const auto vector = [&in](Vec &v) -> bool { return static_cast<bool>(in >> v.x >> v.y >> v.z); };
    bool whole = static_cast<bool>(in);
    for (std::string part; whole && in >> part;) {
      Surface one = {{}, {}, 0., part == "face" ? FACE : part == "edge" ? EDGE : CORNER, {}, {far, far, far}, {}};
      one.high = -1. * one.low;
      size_t cells;
      whole = (one.part != CORNER || part == "corner") && vector(one.point) && vector(one.normal) && in >> cells;
      for (size_t halves; whole && cells && (whole = static_cast<bool>(in >> halves)); cells--) {
        one.cells.push_back({});
        for (; whole && halves; halves--) {
          Half half;
          whole = vector(half.at) && vector(half.way) && in >> half.least;
          one.cells.back().push_back(half);
          one.low = {std::min(one.low.x, half.at.x), std::min(one.low.y, half.at.y), std::min(one.low.z, half.at.z)};
          one.high = {std::max(one.high.x, half.at.x), std::max(one.high.y, half.at.y), std::max(one.high.z, half.at.z)};
        }
      }
      walls_.push_back(one);
    }
    if (!whole || !in.eof()) error->fix_error(FLERR, this, (file + " has no facets that can be read").c_str());
  }

  /* Gap of a bead to the box of a facet, no more than that to the facet. */
  double box_gap(const Surface &wall, const int i) const
  {
    const Vec x = vec(atom->x[i]) - shift_, low = wall.low - x, high = x - wall.high;
    const Vec out = {std::max(0., std::max(low.x, high.x)), std::max(0., std::max(low.y, high.y)),
                     std::max(0., std::max(low.z, high.z))};
    return length(out) - atom->radius[i];
  }

  /* Whether a wall has a point that is nearer to a bead than all points of the surface around it. */
  bool meets(const Surface &wall, const int i) const
  {
    if (wall.part == ALL) return true;
    const Vec x = vec(atom->x[i]) - shift_;
    if (wall.part == FACE && !(dot(wall.normal, x - wall.point) > 0.)) return false;
    for (const std::vector<Half> &cell : wall.cells)
      if (std::all_of(cell.begin(), cell.end(), [&](const Half &h) { return dot(h.way, x - h.at) > h.least; }))
        return true;
    return false;
  }

  /* Bridge and spring of a bead go with its nearest point from one facet to the next, around an edge or into a valley:
     to the one without a bridge that is nearest, if that is nearer than a radius. If there is none, the bridge breaks. */
  void hand_over(const Near &one)
  {
    const auto free = [](const double *const h) { return std::all_of(h, h + HISTORY, [](double x) { return x == 0.; }); };
    double *const from = history_of(one.bead, one.wall), *to = 0;
    if (free(from) || meets(walls_[one.wall], one.bead)) return;
    const double radius = atom->radius[one.bead];
    Vec n;
    double gap = gap_at(one.wall, one.bead, n), nearest = radius;
    const Vec foot = (radius + gap) * n;
    for (const Near &other : near_) {
      double *const history = history_of(other.bead, other.wall);
      if (other.bead != one.bead || !free(history) || !meets(walls_[other.wall], one.bead)) continue;
      gap = gap_at(other.wall, one.bead, n);
      const double away = length((radius + gap) * n - foot);
      if (away < nearest) nearest = away, to = history;
    }
    if (to) std::swap_ranges(from, from + HISTORY, to);
  }

  double *history_of(const int i, const int wall) { return of(i) + HISTORY * wall; }

  Course read_course(const std::string &file)
  {
    std::ifstream in(file.c_str());
    Course course = {-1., 0., {}};
    in >> course.period;
    for (Piece piece; in >> piece.time;) {
      for (double &one : piece.powers)
        if (!(in >> one)) course.period = -1.;
      course.most = std::max(course.most, std::fabs(piece.powers[0]));
      course.pieces.push_back(piece);
    }
    if (!in.eof() || course.pieces.empty() || !(course.period >= 0.))
      error->fix_error(FLERR, this, (file + " has no course that can be read").c_str());
    return course;
  }

  /* Displacement (order 0), velocity (1) or acceleration (2) for an amplitude of 1, without the ramp. */
  double unramped(const Wave &wave, const double time, const int order) const
  {
    if (wave.record >= 0) return records_[wave.record].at(time, order);
    const double w = wave.frequency, turn = w * time + wave.phase;
    return order == 0 ? std::sin(turn) : order == 1 ? w * std::cos(turn) : -w * w * std::sin(turn);
  }

  /* The same with the ramp. */
  double motion(const Wave &wave, const double time, const int order) const
  {
    if (ramp_.pieces.empty()) return unramped(wave, time, order);
    double sum = 0.;
    for (int k = 0; k <= order; k++)
      sum += (order == 2 && k == 1 ? 2. : 1.) * ramp_.at(time, k) * unramped(wave, time, order - k);
    return sum;
  }

  /* Puts the walls where they are in this step, with the velocity of some time before. */
  void move(const double before)
  {
    shift_ = velocity_ = {0., 0., 0.};
    const double time = (update->ntimestep - begin_) * update->dt;
    for (Wave &wave : waves_) {
      wave.push = moves_ || time < 0. ? 0. : -motion(wave, time, 2);
      if (time < 0. || !moves_) continue;
      shift_ = shift_ + motion(wave, time, 0) * wave.amplitude;
      velocity_ = velocity_ + motion(wave, time - before, 1) * wave.amplitude;
    }
  }

  /* Gravity, and the inertial force where the frame is that of shaken walls. */
  void push()
  {
    const size_t width = 1 + waves_.size(), beads = loads_.size() / width;
    for (int i = 0; i < atom->nlocal; i++) {
      if (!(atom->mask[i] & groupbit)) continue;
      const size_t tag = atom->tag[i];
      const Vec *load = &loads_[tag < beads ? tag * width : 0];
      Vec acceleration = *load;
      for (const Wave &wave : waves_) acceleration = acceleration + wave.push * *++load;
      add_to(atom->f[i], atom->rmass[i] * acceleration);
    }
  }

  double gap_at(const int number, const int i, Vec &n) const
  {
    const Surface &wall = walls_[number];
    Vec d = vec(atom->x[i]) - wall.point - shift_;
    n = wall.normal;
    if (wall.part > FACE) {
      d = d - dot(n, d) * n;
      const double out = length(d);
      n = 1. / out * d;
      return out - atom->radius[i];
    }
    if (!(wall.radius > 0.)) return dot(n, d) - atom->radius[i];
    d.z = 0.;
    const double out = length(d);
    n = -1. / out * d;
    return wall.radius - out - atom->radius[i];
  }

  void tell()
  {
    cells_.clear();
    evaluate(false, false, &cells_);
    size_local_rows = cells_.size() / COLUMNS;
    rows_.clear();
    for (int row = 0; row < size_local_rows; row++) rows_.push_back(&cells_[row * COLUMNS]);
    array_local = rows_.data();
  }

  void evaluate(const bool add, const bool stretch, std::vector<double> *const told)
  {
    const double formed = law_->formed();
    const auto finish = [&]() { this->finish(add, stretch, told); };
    batch.count = 0;
    for (const Near &one : near_)
      if (walls_[one.wall].part != ALL) hand_over(one);
    for (const Near &one : near_) {
      const int i = one.bead;
      double *const history = history_of(i, one.wall);
      Vec n;
      double gap = gap_at(one.wall, i, n);
      if (std::isnan(gap)) error->one(FLERR, "fix wall/bridge: a bead's position is no number");
      const bool away = gap > formed && history[TABLE] == 0.;
      if (!away && !meets(walls_[one.wall], i)) gap = std::numeric_limits<double>::infinity();
      if (!(gap < 0.)) std::fill_n(history + SPRING, HISTORY - SPRING, 0.);
      if (gap > formed && history[TABLE] == 0.) continue;
      const bridge::Table *const table =
        law_->bridge_of(history, gap, i, WALL, type_, std::numeric_limits<double>::infinity());
      if (!(gap < 0.) && !table) continue;
      const Vec v = vec(atom->v[i]) - velocity_, none = {0., 0., 0.};
      const double radius = atom->radius[i];
      const int k = law_->add(finish, i, one.wall, atom->type[i], type_, n, v, vec(atom->omega[i]), none, radius, 0.,
                              table, gap, history);
      batch.inverse[k] = 1.;
      batch.gap[k] = gap;
      batch.reduced_radius[k] = radius;
      batch.reduced_mass[k] = atom->rmass[i];
    }
    finish();
  }

  void finish(const bool add, const bool stretch, std::vector<double> *const told)
  {
    Batch &b = batch;
    if (!b.count) return;
    law_->act(stretch, update->dt);
    for (int k = 0; k < b.count; k++) {
      const int i = b.i[k];
      const Vec on = b.force.get(k), x = vec(atom->x[i]);
      if (add) {
        add_to(atom->f[i], on);
        add_to(atom->torque[i], b.torque_i.get(k));
      }
      if (!told) continue;
      const Vec foot = x - (atom->radius[i] + b.gap[k]) * b.d.get(k);
      for (const double cell :
           {foot.x, foot.y, foot.z, x.x, x.y, x.z, 1. * b.j[k], 1. * atom->tag[i], on.x, on.y, on.z, -b.gap[k]})
        told->push_back(cell);
    }
    b.count = 0;
  }
};

}
#endif
