// SPDX-License-Identifier: GPL-2.0-or-later
// Copyright (c) 2026, the granular-walkers developers
/* The law of a deck: its tables of bridges, its materials, and which contact has which bridge.

   A bridge forms when the gap falls to the FORMATION of its table and breaks at its RUPTURE.
   Where liquid is conserved, a bridge takes its volume from the films of the two spheres, and
   gives it back when it breaks (README.md, "Conserved liquid"; the volumes are those of Shi and
   McCarthy, Powder Technology 184 (2008) 65, from walkers/physics/capillary.py).

   The history of a contact is the number of its table and the elongation of its spring. The
   number is 0 without a bridge, and negative where i is the second sphere of the table: the
   coupling then has the other sign, because n and s are reversed and q is not. */
#ifndef BRIDGE_LAW_H
#define BRIDGE_LAW_H

#include "engine.h"
#include "forces.h"

#include <algorithm>
#include <limits>
#include <map>

namespace {

enum { BRIDGE_ID = 21 };  // number of the cohesion model; Debian's engine has none of this number
enum { WALL = -1 };       // instead of the index of a second bead
const char *const NAME = "cohesion_model bridge";
const char *const RISE = "frictionRise";                         // Δμ
const char *const HALF_RISE_SPEED = "frictionHalfRiseVelocity";  // s_h, m/s

class Law : protected Pointers {
public:
  Law(LAMMPS *lmp, const bool rolling_friction)
      : Pointers(lmp), rolling_friction_(rolling_friction), has_edges_(false),
        largest_formation_(0.), film_(0)
  {
    of_engines()[lmp] = this;
  }
  ~Law()
  {
    if (of_engines()[lmp] == this) of_engines().erase(lmp);
  }

  /* The law of each engine in this process, by which its walls find it. */
  static std::map<LAMMPS *, const Law *> &of_engines()
  {
    static std::map<LAMMPS *, const Law *> laws;
    return laws;
  }

  /* Reads the words of the pair style after its models: "table" and a file. */
  void settings(const int count, char **const words)
  {
    if (count != 2 || std::string(words[0]) != "table")
      error->all(FLERR, "cohesion bridge: expected the keyword table and a file");
    file_ = words[1];
    try {
      tables_ = bridge::read_tables(file_);
    } catch (const std::exception &problem) {
      error->all(FLERR, ("cohesion bridge: " + file_ + ": " + problem.what()).c_str());
    }
    for (const bridge::Table &table : tables_) {
      largest_formation_ = std::max(largest_formation_, table.formation);
      if (table.edge > 0.) has_edges_ = true;
    }
  }

  /* Takes the materials, and the films of the beads, from the properties of the deck. */
  void connect()
  {
    PropertyRegistry &registry = force->registry;
    registry.registerProperty("Yeff", &MODEL_PARAMS::createYeff, NAME);
    registry.registerProperty("Geff", &MODEL_PARAMS::createGeff, NAME);
    registry.registerProperty("betaeff", &MODEL_PARAMS::createBetaEff, NAME);
    registry.registerProperty("coeffFrict", &MODEL_PARAMS::createCoeffFrict);
    double **modulus, **shear_modulus, **friction, **rolling_friction;
    double **minus_beta;  // the engine stores the damping ratio with this sign
    registry.connect("Yeff", modulus, NAME);
    registry.connect("Geff", shear_modulus, NAME);
    registry.connect("betaeff", minus_beta, NAME);
    registry.connect("coeffFrict", friction, NAME);
    if (rolling_friction_) {
      registry.registerProperty("coeffRollFrict", &MODEL_PARAMS::createCoeffRollFrict);
      registry.connect("coeffRollFrict", rolling_friction, NAME);
    }
    double **const rises = optional_property(RISE, &create_rise);
    double **const half_rise_speeds = optional_property(HALF_RISE_SPEED, &create_half_rise_speed);
    if (!rises != !half_rise_speeds)
      error->all(FLERR,
                 "cohesion bridge: expected frictionRise and frictionHalfRiseVelocity, or neither");
    if (force->cg_active()) error->cg(FLERR, NAME);
    if (conserves_liquid())
      film_ = static_cast<FixPropertyAtom *>(
        modify->find_fix_property("film", "property/atom", "scalar", 0, 0, NAME));
    types_ = atom->ntypes + 1;
    materials_.assign(types_ * types_, Materials());
    for (int i = 1; i < types_; i++)
      for (int j = 1; j < types_; j++) {
        const double damping = -2. * std::sqrt(5. / 6.) * minus_beta[i][j];
        materials_[i * types_ + j] = {4. / 3. * modulus[i][j],
                                      8. * shear_modulus[i][j],
                                      damping * std::sqrt(2. * modulus[i][j]),
                                      damping * std::sqrt(8. * shear_modulus[i][j]),
                                      friction[i][j],
                                      rolling_friction_ ? rolling_friction[i][j] : 0.,
                                      rises ? rises[i][j] : 0.,
                                      rises ? half_rise_speeds[i][j] : 1.};
      }
    register_neighbour_distance();
  }

  /* Whether a model of the deck is one that this library computes. */
  bool match(const std::string &kind, const std::string &model) const
  {
    Factory &models = Factory::instance();
    const int rolling = rolling_friction_ ? ROLLING_CDT : ROLLING_OFF;
    if (kind == "surface") return models.getSurfaceModelId(model) == SURFACE_DEFAULT;
    if (kind == "normal") return models.getNormalModelId(model) == HERTZ;
    if (kind == "cohesion") return models.getCohesionModelId(model) == BRIDGE_ID;
    if (kind == "tangential") return models.getTangentialModelId(model) == TANGENTIAL_HISTORY;
    if (kind == "rolling_friction") return models.getRollingModelId(model) == rolling;
    return false;
  }

  /* The largest gap at which any bridge forms, m. */
  double largest_formation() const { return largest_formation_; }

  /* The largest gap of any bridge, m. */
  double largest_rupture() const
  {
    double largest = 0.;
    for (const bridge::Table &table : tables_) largest = std::max(largest, table.rupture);
    return largest;
  }

  /* Copies the films at the start of a step. All bridges between beads form from these, and so the
     order of contacts and the number of ranks do not matter. */
  void begin_step()
  {
    if (!film_) return;
    film_->do_forward_comm();
    films_.assign(film_->vector_atom, film_->vector_atom + atom->nlocal + atom->nghost);
  }

  /* The table of the bridge of a contact, or 0. The surfaces touch, are near enough for a bridge to
     form, or had one. Bridges form and break here: history and films are updated. For a wall j is
     WALL. */
  inline const bridge::Table *bridge_of(double *const history, const double gap, const int i,
                                        const int j, const int type_j, const double radius_j) const
  {
    if (history[TABLE] == 0.) {
      if (gap > largest_formation_) return 0;
      const int number = find(i, j, type_j, radius_j);
      if (number < 0 || gap > tables_[number].formation) return 0;
      const bool is_first = tables_[number].begins_with(atom->radius[i]);
      history[TABLE] = is_first ? 1. + number : -1. - number;
      if (film_) move_liquid(history, i, j, true);
    }
    const bridge::Table *const table = &table_in(history);
    if (gap < table->rupture) return table;
    if (film_) move_liquid(history, i, j, false);
    history[TABLE] = 0.;
    return 0;
  }

  /* Adds a contact to the batch and returns its place; masses are left to the caller. If the
     batch is full or of other materials, flush is called first: it computes the batch and
     empties it. */
  template<class Flush> __attribute__((always_inline)) inline int
  add(const Flush &flush, const int i, const int j, const int type_i, const int type_j, const Vec d,
      const Vec v, const Vec omega_i, const Vec omega_j, const double radius_i,
      const double radius_j, const bridge::Table *const table, const double gap,
      double *const history) const
  {
    const Materials *const materials = &materials_[type_i * types_ + type_j];
    if (batch.count == Batch::CAPACITY || (materials != batch.materials && batch.count)) flush();
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
    double interpolated[bridge::COLUMNS] = {0., 0., 0., 0., 0.};
    const double *const row = table ? table->at(gap, interpolated) : interpolated;
    for (int c = 0; c < bridge::COLUMNS; c++) batch.bridge[c][k] = row[c];
    batch.bridge[bridge::COUPLING][k] = std::copysign(1., history[TABLE]) * row[bridge::COUPLING];
    batch.edge[k] = table ? table->edge : 0.;
    return k;
  }

  /* Computes the forces of the batch; with update, springs stretch for a step. */
  void compute(const bool update, const double time_step) const
  {
    if (has_edges_) measure_edges();
    compute_batch(rolling_friction_, has_edges_, update, time_step);
  }

private:
  const bool rolling_friction_;
  bool has_edges_;  // of the menisci of any bridge
  double largest_formation_;
  int types_;
  std::vector<Materials> materials_;  // by both types
  std::string file_;
  std::vector<bridge::Table> tables_;
  FixPropertyAtom *film_;      // filling of the film of each bead; 0 where liquid is not conserved
  std::vector<double> films_;  // the fillings at the start of the step

  static MatrixProperty *create_rise(PropertyRegistry &registry, const char *caller, bool checks)
  {
    return MODEL_PARAMS::createPerTypePairProperty(registry, RISE, caller, checks, 0.);
  }

  static MatrixProperty *create_half_rise_speed(PropertyRegistry &registry, const char *caller,
                                                bool checks)
  {
    return MODEL_PARAMS::createPerTypePairProperty(registry, HALF_RISE_SPEED, caller, checks, 1e-9);
  }

  /* The values of a property of pairs of types, or 0 if the deck does not define it. */
  double **optional_property(const char *const name, const MatrixPropertyCreator creator)
  {
    if (!modify->find_fix_property(name, "property/global", "peratomtypepair", 0, 0, NAME, false))
      return 0;
    double **values;
    force->registry.registerProperty(name, creator);
    force->registry.connect(name, values, NAME);
    return values;
  }

  bool conserves_liquid() const { return tables_[0].volume > 0.; }

  const bridge::Table &table_in(const double *const history) const
  {
    return tables_[static_cast<int>(std::fabs(history[TABLE])) - 1];
  }

  /* Has the engine list neighbours out to the longest bridge. It takes a multiple of the sum of the
     radii; for walls, whose radius is infinite, this is 0. */
  void register_neighbour_distance() const
  {
    double largest = 0.;
    for (const bridge::Table &table : tables_)
      largest = std::max(largest, table.rupture / (table.radius[0] + table.radius[1]));
    neighbor->register_contact_dist_factor(1. + 1.01 * largest);
  }

  /* The number of the table of a new bridge. Where liquid is conserved, the tables of two surfaces
     have volumes in steps: it is the one nearest to what the films offer, and at most 1.2 times the
     offer, or -1 if the films are too thin for any. */
  __attribute__((noinline)) int find(const int i, const int j, const int type_j,
                                     const double radius_j) const
  {
    const int type_i = atom->type[i];
    const double radius_i = atom->radius[i];
    int nearest = -1;
    bool has_table = false;
    double smallest_difference = std::numeric_limits<double>::infinity();
    for (size_t number = 0; number < tables_.size(); number++) {
      const bridge::Table &table = tables_[number];
      if (!table.joins(type_i, type_j, radius_i, radius_j)) continue;
      if (!film_) return number;
      // The engine fills the films once, after the forces before the first step.
      if (film_->just_created) return -1;
      has_table = true;
      const int first = table.begins_with(radius_i) ? 0 : 1;
      const double offer =
        table.share[first] * film_of(i, j) + table.share[1 - first] * film_of(j, j);
      const double difference = std::fabs(std::log(offer / table.volume));
      if (!(table.volume <= 1.2 * offer && difference < smallest_difference)) continue;
      smallest_difference = difference;
      nearest = number;
    }
    if (has_table) return nearest;
    char text[512];
    snprintf(text, sizeof(text),
             "cohesion bridge: %s has no table of types %d and %d, radii %g and %g m",
             file_.c_str(), type_i, type_j, radius_i, radius_j);
    error->one(FLERR, text);
    return -1;
  }

  /* How full the film of a bead is for its bridge to j: between beads at the start of the step.
     For a wall it is the present filling, because each bridge to a wall takes half of a film. */
  double film_of(const int bead, const int j) const
  {
    if (bead == WALL) return 0.;
    return j == WALL ? film_->vector_atom[bead] : films_[bead];
  }

  /* Moves the volume of a bridge out of the films in proportion to what they offer (forms), or back
     into them in proportion to what full films offer. Only films of a rank's own beads change. */
  __attribute__((noinline)) void move_liquid(const double *const history, const int i, const int j,
                                             const bool forms) const
  {
    const bridge::Table &table = table_in(history);
    const int first = history[TABLE] > 0. ? 0 : 1;
    const double offer_i = table.share[first] * (forms ? film_of(i, j) : 1.);
    const double offer_j = table.share[1 - first] * (forms ? film_of(j, j) : 1.);
    const double part = (forms ? -1. : 1.) * table.volume / (offer_i + offer_j);
    film_->vector_atom[i] += part * offer_i / table.film[first];
    if (j != WALL && j < atom->nlocal)
      film_->vector_atom[j] += part * offer_j / table.film[1 - first];
  }
};

}
#endif
