// SPDX-License-Identifier: GPL-2.0-or-later
// Copyright (c) 2026, the granular-walkers developers
/* A contact model for LIGGGHTS: liquid bridges whose forces are tables. README.md has its commands and its laws, table.h
   the tables. LD_PRELOAD loads it into Debian's liggghts.

   The engine's own walls are slow meshes, or primitives of whose contacts it tells nothing. Its loops are written out
   here for spheres. A contact's history is the number of its table, 0 without a bridge, and the spring; the number is
   negative where i is the second bead of the table, for which the coupling has the other sign (n and s turn round, q
   does not). Contacts are gathered in batches, and the forces of several are computed at once.

   The next line is part of the names of runs and audits: another number where the same deck gives other numbers. */
// FORCES_VERSION 8
#include "granular_pair_style.h"
#include "contact_models.h"
#include "fix_insert_stream.h"  // which pair_gran_base.h forgets
#include "pair_gran_base.h"
#include "fix_property_atom.h"
#include "modify.h"
#include "output.h"
#include "comm.h"
#include "universe.h"
#include "table.h"

#include <algorithm>
#include <limits>
#include <map>

using namespace LAMMPS_NS;
using namespace LIGGGHTS;
using namespace LIGGGHTS::ContactModels;

namespace {

enum { BRIDGE_ID = 21 };  // of a cohesion model; Debian's engine has none of this number
enum { TABLE, SPRING, HISTORY = SPRING + 3, WALL = -1 };  // places in a history; instead of a second bead
const char *const NAME = "cohesion_model bridge";

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

class Pair : public PairStyles::IGranularPairStyle, private Law {
public:
  Pair(LAMMPS *lmp, PairGran *parent, const int64_t hash, const bool rolls) : Law(lmp, rolls), hash_(hash)
  {
    for (const char *const value : {"bridge", "shearx", "sheary", "shearz"})
      parent->add_history_value(value, "1");  // "1": the sign changes where the engine swaps i and j
  }
  void settings(int n, char **args, IContactHistorySetup *) { Law::settings(n, args); }
  void init_granular() { connect(); }
  int get_history_offset(const std::string) { return -1; }
  double stressStrainExponent() { return 1.5; }
  int64_t hashcode() { return hash_; }
  bool contact_match(const std::string kind, const std::string model) { return match(kind, model); }
  void write_restart_settings(FILE *file) { fwrite(&hash_, sizeof(hash_), 1, file); }
  void read_restart_settings(FILE *file, int64_t)
  {
    int64_t found;
    if (comm->me == 0 && (fread(&found, sizeof(found), 1, file) != 1 || found != hash_))
      error->one(FLERR, "cohesion bridge: the restart file is of another pair style");
  }

  void compute_force(PairGran *pair, int energies, int virial, int add)
  {
    if (energies || virial) pair->ev_setup(energies, virial);
    else pair->evflag = pair->vflag_fdotr = 0;
    begin_step();
    if (pair->fr_pair() || pair->storeSumDelta() || pair->storeContactForces() || pair->storeContactForcesStress())
      error->all(FLERR, "cohesion bridge has no rigid bodies, multicontact or stored contact forces");
    const bool newton = force->newton_pair, compute = pair->computeflag(), update = compute && pair->shearupdate();
    const bool tell = (pair->cpl() && add) || pair->evflag;
    const double time_step = this->update->dt, most = formed();
    const int width = pair->dnum(), last = newton ? std::numeric_limits<int>::max() : atom->nlocal;
    NeighList *const list = pair->list;
    if (!list->inum) return;
    // Rows of these arrays are one block.
    const Vec *const x = &vec(atom->x[0]), *const v = &vec(atom->v[0]), *const omega = &vec(atom->omega[0]);
    Vec *const f = &vec(atom->f[0]), *const torque = &vec(atom->torque[0]);
    const double *const radius = atom->radius, *const mass = atom->rmass;
    const int *const type = atom->type;

    batch.count = 0;
    const auto finish = [&]() __attribute__((noinline)) {
      if (!batch.count) return;
      measure();
      act(update, time_step);
      for (int k = 0; compute && k < batch.count;) {
        const int i = batch.i[k];
        Vec on = f[i], turn = torque[i];  // in registers, for all contacts of a bead
        for (; k < batch.count && batch.i[k] == i; k++) {
          const Vec force = batch.force.get(k);
          on = on + force;
          turn = turn + batch.torque_i.get(k);
          const int j = batch.j[k];
          if (j >= last) continue;
          f[j] = f[j] - force;
          torque[j] = torque[j] + batch.torque_j.get(k);
        }
        f[i] = on;
        torque[i] = turn;
      }
      for (int k = 0; tell && k < batch.count; k++) report(pair, k, newton, add);
      batch.count = 0;
    };
    for (int ii = 0; ii < list->inum; ii++) {
      const int i = list->ilist[ii], count = list->numneigh[i], type_i = type[i];
      const int *const neighbours = list->firstneigh[i];
      int *const flags = list->listgranhistory->firstneigh[i];
      double *history = list->listgranhistory->firstdouble[i] - width;
      const Vec xi = x[i], vi = v[i], wi = omega[i];
      const double ri = radius[i], mi = mass[i];
      for (int jj = 0; jj < count; jj++) {
        history += width;
        const int j = neighbours[jj] & NEIGHMASK;
        const double rj = radius[j], sum = ri + rj, reach = sum + most;
        const Vec d = xi - x[j];
        const double squared = dot(d, d);
        if (squared > reach * reach && !flags[jj]) continue;
        const bool touching = squared < sum * sum;
        const double gap = touching ? -0. : std::sqrt(squared) - sum;  // only that between surfaces apart matters here
        if (!touching) history[SPRING] = history[SPRING + 1] = history[SPRING + 2] = 0.;
        const bridge::Table *const table = bridge_of(history, gap, i, j, type[j], rj);
        flags[jj] = touching ? CONTACT_NORMAL_MODEL | CONTACT_COHESION_MODEL | CONTACT_TANGENTIAL_MODEL
                  : table    ? CONTACT_COHESION_MODEL
                             : 0;
        if (!flags[jj]) continue;
        const int k = Law::add(finish, i, j, type_i, type[j], d, vi - v[j], wi, omega[j], ri, rj, table, gap, history);
        batch.mass_i[k] = mi;
        batch.mass_j[k] = mass[j];
      }
    }
    finish();
    if (pair->cpl() && add) pair->cpl_pair_finalize();
  }

private:
  const int64_t hash_;

  __attribute__((noinline)) void report(PairGran *pair, const int k, const bool newton, const int add)
  {
    const int i = batch.i[k], j = batch.j[k];
    const Vec on = batch.force.get(k), d = batch.d.get(k);
    if (pair->cpl() && add) {
      SurfacesIntersectData surfaces;
      ForceData forces;
      surfaces.i = i;
      surfaces.j = j;
      surfaces.contact_history = batch.history[k];
      add_to(forces.delta_F, on);
      add_to(forces.delta_torque, batch.torque_i.get(k));
      pair->cpl_add_pair(surfaces, forces);
    }
    if (pair->evflag) pair->ev_tally_xyz(i, j, atom->nlocal, newton, 0., 0., on.x, on.y, on.z, d.x, d.y, d.z);
  }
};

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

/* The engine's table of fixes is private, without another entry: a pointer to the member, by explicit instantiation. */
typedef std::map<std::string, Fix *(*)(LAMMPS *, int, char **)> Fixes;
struct Styles {
  typedef Fixes *Modify::*Member;
  friend Member member(Styles);
};
template<Styles::Member FOUND> struct Found {
  friend Styles::Member member(Styles) { return FOUND; }
};
template struct Found<&Modify::fix_map>;

Fix *make_walls(LAMMPS *lmp, int count, char **args) { return new FixWallBridge(lmp, count, args); }

template<bool ROLLS> PairStyles::IGranularPairStyle *make_pair_style(LAMMPS *lmp, PairGran *parent, int64_t hash)
{
  (*(lmp->modify->*member(Styles())))["wall/bridge"] = &make_walls;
  return new Pair(lmp, parent, hash, ROLLS);
}

template<bool ROLLS> void add_styles()
{
  const int rolling = ROLLS ? ROLLING_CDT : ROLLING_OFF;
  const int64_t hash = Utils::generate_gran_hashcode(HERTZ, TANGENTIAL_HISTORY, BRIDGE_ID, rolling, SURFACE_DEFAULT);
  PairStyles::Factory::instance().addStyle("gran", hash, &make_pair_style<ROLLS>);
}

struct Registration {
  Registration()
  {
    // An abort loses what is in the buffers of an output that is a file.
    setvbuf(stdout, 0, _IOLBF, 1 << 16);
    Factory::instance().addCohesionModel("bridge", BRIDGE_ID);
    add_styles<false>();
    add_styles<true>();
  }
} registration;

}
