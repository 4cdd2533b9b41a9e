// SPDX-License-Identifier: GPL-2.0-or-later
// Copyright (c) 2026, the granular-walkers developers
/* The forces of a contact, and which bridge it has. */
#ifndef BRIDGE_LAW_H
#define BRIDGE_LAW_H

#include "table.h"
#include "vectors.h"

#include <algorithm>
#include <limits>
#include <map>

namespace {

enum { BRIDGE_ID = 21 };  // of a cohesion model; Debian's engine has none of this number
enum { TABLE, SPRING, HISTORY = SPRING + 3, WALL = -1 };  // places in a history; instead of a second bead
const char *const NAME = "cohesion_model bridge";

/* Of loops over contacts: the compiler has them compute several at once, with the same digits: eight, four or two. The
   library contains all, and chooses when it is loaded on a machine. */
#if defined(__x86_64__)
#define BY_LANES __attribute__((noinline, target_clones("avx512f", "avx2", "default")))
#else
#define BY_LANES __attribute__((noinline))
#endif

/* What the materials of two types give to their contacts. */
struct Materials {
  double stiffness, shear_stiffness, damping, shear_damping, friction, rolling_friction;
};

/* Contacts of the same materials, whose forces are computed at once. */
struct Batch {
  enum { MOST = 32, LANES = 8 };
  typedef double Numbers[MOST];
  struct Vecs {
    Numbers x, y, z;
    inline Vec get(const int k) const { return {x[k], y[k], z[k]}; }
    inline void put(const int k, const Vec a) { x[k] = a.x, y[k] = a.y, z[k] = a.z; }
  };
  Vecs d, v, omega_i, omega_j, spring;  // d: from j to i; v: of i, seen from j
  Numbers radius_i, radius_j, mass_i, mass_j, bridge[bridge::COLUMNS];
  Numbers inverse, gap, reduced_radius, reduced_mass;  // inverse: of the length of d
  Vecs force, torque_i, torque_j;
  int count, i[MOST], j[MOST];
  const Materials *materials;
  double *history[MOST];

  /* The count in whole lanes. */
  int whole() const { return (count + LANES - 1) / LANES * LANES; }
} batch __attribute__((aligned(64)));

class Law : protected Pointers {
public:
  Law(LAMMPS *lmp, const bool rolls) : Pointers(lmp), rolls_(rolls), formed_(0.), film_(0) { laws()[lmp] = this; }
  ~Law()
  {
    if (laws()[lmp] == this) laws().erase(lmp);
  }

  /* The laws of engines, for their walls. */
  static std::map<LAMMPS *, const Law *> &laws()
  {
    static std::map<LAMMPS *, const Law *> all;
    return all;
  }

  void settings(const int n, char **const args)
  {
    if (n != 2 || std::string(args[0]) != "table")
      error->all(FLERR, "cohesion bridge: expected the keyword table and a file");
    file_ = args[1];
    try {
      tables_ = bridge::read_tables(file_);
    } catch (const std::exception &problem) {
      error->all(FLERR, ("cohesion bridge: " + file_ + ": " + problem.what()).c_str());
    }
    for (const bridge::Table &one : tables_) formed_ = std::max(formed_, one.formation);
  }

  void connect()
  {
    PropertyRegistry &registry = force->registry;
    registry.registerProperty("Yeff", &MODEL_PARAMS::createYeff, NAME);
    registry.registerProperty("Geff", &MODEL_PARAMS::createGeff, NAME);
    registry.registerProperty("betaeff", &MODEL_PARAMS::createBetaEff, NAME);
    registry.registerProperty("coeffFrict", &MODEL_PARAMS::createCoeffFrict);
    double **modulus, **shear_modulus, **friction, **rolling_friction, **ratio;  // minus the damping ratio
    registry.connect("Yeff", modulus, NAME);
    registry.connect("Geff", shear_modulus, NAME);
    registry.connect("betaeff", ratio, NAME);
    registry.connect("coeffFrict", friction, NAME);
    if (rolls_) {
      registry.registerProperty("coeffRollFrict", &MODEL_PARAMS::createCoeffRollFrict);
      registry.connect("coeffRollFrict", rolling_friction, NAME);
    }
    if (force->cg_active()) error->cg(FLERR, NAME);
    if (tables_[0].volume > 0.)
      film_ = static_cast<FixPropertyAtom *>(modify->find_fix_property("film", "property/atom", "scalar", 0, 0, NAME));
    types_ = atom->ntypes + 1;
    materials_.assign(types_ * types_, Materials());
    for (int i = 1; i < types_; i++)
      for (int j = 1; j < types_; j++) {
        const double damping = -2. * std::sqrt(5. / 6.) * ratio[i][j];
        materials_[i * types_ + j] = {4. / 3. * modulus[i][j],
                                      8. * shear_modulus[i][j],
                                      damping * std::sqrt(2. * modulus[i][j]),
                                      damping * std::sqrt(8. * shear_modulus[i][j]),
                                      friction[i][j],
                                      rolls_ ? rolling_friction[i][j] : 0.};
      }
    // The engine looks for neighbours up to a multiple of the sum of the radii; a wall has none.
    double reach = 0.;
    for (const bridge::Table &one : tables_) reach = std::max(reach, one.rupture / (one.radius[0] + one.radius[1]));
    neighbor->register_contact_dist_factor(1. + 1.01 * reach);
  }

  bool match(const std::string &kind, const std::string &model) const
  {
    Factory &known = Factory::instance();
    if (kind == "surface") return known.getSurfaceModelId(model) == SURFACE_DEFAULT;
    if (kind == "normal") return known.getNormalModelId(model) == HERTZ;
    if (kind == "cohesion") return known.getCohesionModelId(model) == BRIDGE_ID;
    if (kind == "tangential") return known.getTangentialModelId(model) == TANGENTIAL_HISTORY;
    if (kind == "rolling_friction") return known.getRollingModelId(model) == (rolls_ ? ROLLING_CDT : ROLLING_OFF);
    return false;
  }

  /* The largest gap at which any bridge forms, m. */
  double formed() const { return formed_; }

  /* The largest gap of any bridge, m. */
  double longest() const
  {
    double most = 0.;
    for (const bridge::Table &one : tables_) most = std::max(most, one.rupture);
    return most;
  }

  /* Films at the begin of a step: in it, all bridges of a bead form from these, on all ranks alike. */
  void begin_step()
  {
    if (!film_) return;
    film_->do_forward_comm();
    films_.assign(film_->vector_atom, film_->vector_atom + atom->nlocal + atom->nghost);
  }

  /* The bridge of a contact whose surfaces touch or had one: its table, or none; history and films are kept up. The
     bead j of a wall is WALL. */
  inline const bridge::Table *bridge_of(double *const history, const double gap, const int i, const int j,
                                        const int type_j, const double radius_j) const
  {
    if (history[TABLE] == 0.) {
      if (gap > formed_) return 0;
      const int number = find(i, j, type_j, radius_j);
      if (number < 0 || gap > tables_[number].formation) return 0;
      history[TABLE] = tables_[number].begins_with(atom->radius[i]) ? 1. + number : -1. - number;
      if (film_) move_liquid(history, i, j, true);
    }
    const bridge::Table *const table = &tables_[static_cast<int>(std::fabs(history[TABLE])) - 1];
    if (gap < table->rupture) return table;
    if (film_) move_liquid(history, i, j, false);
    history[TABLE] = 0.;
    return 0;
  }

  /* Adds a contact to the batch, but for masses; `finish` is called before if it is full or of other materials. */
  template<class Finish> __attribute__((always_inline)) inline int
  add(const Finish &finish, const int i, const int j, const int type_i, const int type_j, const Vec d, const Vec v,
      const Vec omega_i, const Vec omega_j, const double radius_i, const double radius_j,
      const bridge::Table *const table, const double gap, double *const history) const
  {
    const Materials *const materials = &materials_[type_i * types_ + type_j];
    if (batch.count == Batch::MOST || (materials != batch.materials && batch.count)) finish();
    const int k = batch.count++;
    batch.materials = materials;
    batch.i[k] = i;
    batch.j[k] = j;
    batch.history[k] = history;
    batch.d.put(k, d);
    batch.v.put(k, v);
    batch.omega_i.put(k, omega_i);
    batch.omega_j.put(k, omega_j);
    batch.radius_i[k] = radius_i;
    batch.radius_j[k] = radius_j;
    batch.spring.put(k, vec(history + SPRING));
    double between[bridge::COLUMNS] = {0., 0., 0., 0., 0.};
    const double *const f = table ? table->at(gap, between) : between;
    for (int c = 0; c < bridge::COLUMNS; c++)
      batch.bridge[c][k] = c == bridge::COUPLING ? std::copysign(1., history[TABLE]) * f[c] : f[c];
    return k;
  }

  /* Gaps, and what the sizes of two beads give. */
  BY_LANES void measure() const
  {
    Batch &b = batch;
    for (int k = 0, count = b.whole(); k < count; k++) {
      const double distance = length(b.d.get(k)), sum = b.radius_i[k] + b.radius_j[k];
      b.inverse[k] = 1. / distance;
      b.gap[k] = distance - sum;
      b.reduced_radius[k] = b.radius_i[k] * b.radius_j[k] / sum;
      b.reduced_mass[k] = b.mass_i[k] * b.mass_j[k] / (b.mass_i[k] + b.mass_j[k]);
    }
  }

  /* Forces and torques of the batch; springs are kept up if so asked. */
  BY_LANES void act(const bool update, const double time_step) const
  {
    if (rolls_) act<true>(update ? time_step : 0.);
    else act<false>(update ? time_step : 0.);
    for (int k = 0; update && k < batch.count; k++) vec(batch.history[k] + SPRING) = batch.spring.get(k);
  }

  template<bool ROLLS> __attribute__((always_inline)) inline void act(const double stretched) const
  {
    Batch &b = batch;
    const Materials of = *b.materials;
    for (int k = 0, count = b.whole(); k < count; k++) {
      const Vec d = b.d.get(k), v = b.v.get(k), omega_i = b.omega_i.get(k), omega_j = b.omega_j.get(k);
      const double gap = b.gap[k], apart = b.inverse[k] * dot(v, d);
      const double arm_i = b.radius_i[k] + 0.5 * gap, arm_j = b.radius_j[k] + 0.5 * gap;
      const Vec n = b.inverse[k] * d, spin = omega_i - omega_j, rolling = cross(n, spin);
      const Vec sliding = v - apart * n + cross(n, arm_i * omega_i + arm_j * omega_j);
      // Surfaces apart have no repulsion, and all that is in proportion to it vanishes.
      const double depth = gap < 0. ? -gap : 0., root = std::sqrt(b.reduced_radius[k] * depth);
      // Both dampings are 2 sqrt(5/6) beta sqrt(k m) of their stiffness k, which is a modulus times the root.
      const double damping = std::sqrt(root * b.reduced_mass[k]);
      const double elastic = of.stiffness * root * depth, limit = of.friction * elastic;
      Vec stretch = b.spring.get(k) + stretched * sliding;
      stretch = stretch - dot(stretch, n) * n;
      Vec hold = of.shear_stiffness * root * stretch;
      // A spring beyond Coulomb's limit slips, without damping; else spring and damping together are limited.
      const double held = dot(hold, hold), shear_damping = of.shear_damping * damping;
      const bool slips = held > limit * limit;
      hold = hold + (slips ? 0. : shear_damping) * sliding;
      const double most = limit / (std::sqrt(slips ? held : dot(hold, hold)) + 1e-150), part = most < 1. ? most : 1.;
      b.spring.put(k, (slips ? part : 1.) * stretch);
      const double coupling = b.bridge[bridge::COUPLING][k];
      hold = part * hold + b.bridge[bridge::SLIDING][k] * sliding + coupling * rolling;
      const double drag = of.damping * damping + b.bridge[bridge::NORMAL][k];
      b.force.put(k, (elastic - b.bridge[bridge::PULL][k] - drag * apart) * n - hold);
      const Vec t = cross(n, hold);
      Vec couple = cross(n, coupling * sliding + b.bridge[bridge::ROLLING][k] * rolling);
      if (ROLLS) {
        const double speed = length(spin) + 1e-150;
        couple = couple - of.rolling_friction * elastic * b.reduced_radius[k] / speed * (spin - dot(spin, n) * n);
      }
      b.torque_i.put(k, arm_i * t + couple);
      b.torque_j.put(k, arm_j * t - couple);
    }
  }

private:
  const bool rolls_;
  double formed_;
  int types_;
  std::vector<Materials> materials_;  // by both types
  std::string file_;
  std::vector<bridge::Table> tables_;
  FixPropertyAtom *film_;
  std::vector<double> films_;

  /* The table of a new bridge. Where liquid is conserved it is that of the volume nearest to what the films offer, up to
     1.2 times as much (volumes are steps), or -1 if films are too thin for any. */
  __attribute__((noinline)) int find(const int i, const int j, const int type_j, const double radius_j) const
  {
    const int type_i = atom->type[i];
    const double radius_i = atom->radius[i];
    int found = -1;
    bool known = false;
    double nearest = std::numeric_limits<double>::infinity();
    for (size_t number = 0; number < tables_.size(); number++) {
      const bridge::Table &table = tables_[number];
      if (!table.joins(type_i, type_j, radius_i, radius_j)) continue;
      if (!film_) return number;
      if (film_->just_created) return -1;  // the engine fills films after the forces before the first step, once
      known = true;
      const int first = table.begins_with(radius_i) ? 0 : 1;
      const double offer = table.share[first] * film_of(i, j) + table.share[1 - first] * film_of(j, j);
      const double off = std::fabs(std::log(offer / table.volume));
      if (!(table.volume <= 1.2 * offer && off < nearest)) continue;
      nearest = off;
      found = number;
    }
    if (known) return found;
    char text[512];
    snprintf(text, sizeof(text), "cohesion bridge: %s has no table of types %d and %d, radii %g and %g m",
             file_.c_str(), type_i, type_j, radius_i, radius_j);
    error->one(FLERR, text);
    return -1;
  }

  /* How full the film of a bead is, for its bridge to j: at the begin of the step, for walls now, because bridges to
     walls take half of a film. */
  double film_of(const int bead, const int j) const
  {
    return bead == WALL ? 0. : j == WALL ? film_->vector_atom[bead] : films_[bead];
  }

  /* A bridge takes its volume from the films in proportion to what they offer, and gives it back in proportion to what
     full films would. A rank has films of its own beads only. */
  __attribute__((noinline)) void move_liquid(const double *const history, const int i, const int j,
                                             const bool takes) const
  {
    const bridge::Table &table = tables_[static_cast<int>(std::fabs(history[TABLE])) - 1];
    const int first = history[TABLE] > 0. ? 0 : 1;
    const double offer_i = table.share[first] * (takes ? film_of(i, j) : 1.);
    const double offer_j = table.share[1 - first] * (takes ? film_of(j, j) : 1.);
    const double part = (takes ? -1. : 1.) * table.volume / (offer_i + offer_j);
    film_->vector_atom[i] += part * offer_i / table.film[first];
    if (j != WALL && j < atom->nlocal) film_->vector_atom[j] += part * offer_j / table.film[1 - first];
  }
};

}
#endif
