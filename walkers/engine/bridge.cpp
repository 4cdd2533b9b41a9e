// SPDX-License-Identifier: GPL-2.0-or-later
// Copyright (c) 2026, the granular-walkers developers
/* A contact model for LIGGGHTS: liquid bridges whose forces are tables.

   Loaded with LD_PRELOAD into Debian's liggghts, it makes the engine know

       pair_style gran model hertz tangential history cohesion bridge [rolling_friction cdt] table FILE
       fix ID GROUP wall/bridge type TYPE [plane X Y Z NX NY NZ]... [cylinder X Y RADIUS]...
                                [shaken AX AY AZ FREQUENCY PHASE]... [begin STEP] [frame lab | walls]
                                [loads FILE]

   Spheres repel each other by Hertz's law, damped, and hold each other by Mindlin's spring, damped, up to Coulomb's
   limit: mu times the elastic repulsion, damping included. Rolling friction is cdt's. A bridge (table.h) forms when the
   gap falls to its table's FORMATION (0: on touch) and breaks at its RUPTURE; between, with n the unit vector from j to
   i, w the velocity apart, s that of the surfaces along each other, q = n x (omega_i - omega_j),

       force on i  -(PULL + NORMAL w) n - (SLIDING s + COUPLING q),    couple  M = -(COUPLING s + ROLLING q)

   with the torques that conserve momentum and angular momentum. Overlapping surfaces have the bridge of gap 0.

   Where tables have liquid, beads have films, and their liquid is conserved: a bridge that forms takes a volume, that of
   one of the tables of its surfaces, and gives it back where it breaks (`move_liquid`). How full a film is, is the
   property "film" of its bead (fix property/atom).

   Walls have the contacts of the pair style, with a surface of infinite radius: planes through a point, beads on the
   side of the normal; cylinders along z, beads within. They are shaken as one, from a step on, by the sum of
   A sin(2 pi f t + phase); in their own frame they rest, and beads have the inertial force instead. Gravity
   and more inertial forces may differ from bead to bead: a file has them, for each. The engine's own
   walls are meshes of triangles, whose bookkeeping takes longer than all forces, or primitives, of whose contacts it
   tells nothing; its forces by a formula read the formula's text in every step.

   The engine's loops are written out for spheres: no heat, energies, rigid bodies, stored contact forces, virial of
   walls. A contact's history is the number of its table, 0 without a bridge, and the spring; the number is negative
   where i is the second bead of the table, for which the coupling has the other sign (n and s turn round, q does not). */
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
enum { TABLE, SPRING, HISTORY = SPRING + 3 };
enum { WALL = -1 };  // instead of a second bead
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
inline Vec vec(const double *const p) { return {p[0], p[1], p[2]}; }
inline void add_to(double *const p, const Vec a)
{
  p[0] += a.x;
  p[1] += a.y;
  p[2] += a.z;
}

/* How two surfaces move, and what follows: the force on i, and the couple that acts on i and, reversed, on j. */
struct Contact {
  int type_i, type_j;
  double gap, reduced_radius, reduced_mass;
  Vec n, sliding, rolling;  // rolling: n x (omega_i - omega_j)
  double apart;             // velocity along n
  Vec spin;                 // omega_i - omega_j
  Vec force, couple;
};

class Law : protected Pointers {
public:
  Law(LAMMPS *lmp, const bool rolls) : Pointers(lmp), rolls_(rolls), formed_(0.), film_(0)
  {
    known()[lmp] = this;
  }
  ~Law()
  {
    if (known()[lmp] == this) known().erase(lmp);
  }

  /* The law of an engine, for its walls; none before its pair style. */
  static const Law *of(LAMMPS *const lmp)
  {
    const std::map<LAMMPS *, const Law *>::const_iterator found = known().find(lmp);
    return found == known().end() ? 0 : found->second;
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
    registry.connect("Yeff", modulus_, NAME);
    registry.connect("Geff", shear_modulus_, NAME);
    double **ratio;  // minus the damping ratio
    registry.connect("betaeff", ratio, NAME);
    registry.connect("coeffFrict", friction_, NAME);
    if (rolls_) {
      registry.registerProperty("coeffRollFrict", &MODEL_PARAMS::createCoeffRollFrict);
      registry.connect("coeffRollFrict", rolling_friction_, NAME);
    }
    if (force->cg_active()) error->cg(FLERR, NAME);
    if (tables_[0].volume > 0.)
      film_ = static_cast<FixPropertyAtom *>(
        modify->find_fix_property("film", "property/atom", "scalar", 0, 0, NAME));
    const int types = atom->ntypes + 1;
    dampings_.assign(types * types, Damping());
    for (int i = 1; i < types; i++)
      for (int j = 1; j < types; j++) {
        const double damping = -2. * std::sqrt(5. / 6.) * ratio[i][j];
        dampings_[i * types + j] = {damping * std::sqrt(2. * modulus_[i][j]),
                                    damping * std::sqrt(8. * shear_modulus_[i][j])};
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

  inline void wet(Contact &c, const bridge::Table &table, const double *const history) const
  {
    double f[bridge::COLUMNS];
    table.at(c.gap, f);
    if (history[TABLE] < 0.) f[bridge::COUPLING] = -f[bridge::COUPLING];
    c.force = c.force - (f[bridge::PULL] + f[bridge::NORMAL] * c.apart) * c.n
            - (f[bridge::SLIDING] * c.sliding + f[bridge::COUPLING] * c.rolling);
    c.couple = c.couple - cross(c.n, -1. * (f[bridge::COUPLING] * c.sliding + f[bridge::ROLLING] * c.rolling));
  }

  /* Repulsion, friction and rolling friction of surfaces that touch. */
  inline void touch(Contact &c, double *const spring, const bool update, const double time_step) const
  {
    const int i = c.type_i, j = c.type_j;
    const double root = std::sqrt(-c.reduced_radius * c.gap);
    const double along = 8. * shear_modulus_[i][j] * root, elastic = -4. / 3. * modulus_[i][j] * root * c.gap;
    // Both dampings are 2 sqrt(5/6) beta sqrt(k m) of their stiffness k, which is a modulus times the root.
    const double damping = std::sqrt(root * c.reduced_mass);
    const Damping &of = dampings_[i * (atom->ntypes + 1) + j];
    Vec stretch = vec(spring);
    if (update) {
      stretch = stretch + time_step * c.sliding;
      stretch = stretch - dot(stretch, c.n) * c.n;
    }
    Vec hold = along * stretch;
    const double limit = friction_[i][j] * elastic;
    if (dot(hold, hold) > limit * limit) {
      const double share = limit / length(hold);
      stretch = share * stretch;
      hold = share * hold;
    } else {
      hold = hold + of.along * damping * c.sliding;
      if (dot(hold, hold) > limit * limit) hold = limit / length(hold) * hold;
    }
    if (update) {
      spring[0] = stretch.x;
      spring[1] = stretch.y;
      spring[2] = stretch.z;
    }
    c.force = c.force + (elastic - of.normal * damping * c.apart) * c.n - hold;
    if (rolls_) {
      const double speed = length(c.spin);
      if (speed > 0.) {
        const Vec against = rolling_friction_[i][j] * elastic * c.reduced_radius / speed * c.spin;
        c.couple = c.couple - (against - dot(against, c.n) * c.n);
      }
    }
  }

private:
  struct Damping {
    double normal, along;
  };
  const bool rolls_;
  double formed_;
  double **modulus_, **shear_modulus_, **friction_, **rolling_friction_;
  std::vector<Damping> dampings_;  // by both types
  std::string file_;
  std::vector<bridge::Table> tables_;
  FixPropertyAtom *film_;
  std::vector<double> films_;

  static std::map<LAMMPS *, const Law *> &known()
  {
    static std::map<LAMMPS *, const Law *> laws;
    return laws;
  }

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
    parent->add_history_value("bridge", "1");  // "1": the sign changes where the engine swaps i and j
    parent->add_history_value("shearx", "1");
    parent->add_history_value("sheary", "1");
    parent->add_history_value("shearz", "1");
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
    double **const x = atom->x, **const f = atom->f, **const torque = atom->torque;
    const double *const radius = atom->radius;
    const bool newton = force->newton_pair, compute = pair->computeflag(), update = compute && pair->shearupdate();
    const bool tell = (pair->cpl() && add) || pair->evflag;
    const double time_step = this->update->dt;
    const int width = pair->dnum(), nlocal = atom->nlocal;
    NeighList *const list = pair->list;

    for (int ii = 0; ii < list->inum; ii++) {
      const int i = list->ilist[ii], count = list->numneigh[i];
      const int *const neighbours = list->firstneigh[i];
      int *const flags = list->listgranhistory->firstneigh[i];
      double *const histories = list->listgranhistory->firstdouble[i];
      const Vec xi = vec(x[i]);
      const double ri = radius[i];
      Vec force_i = {0., 0., 0.}, torque_i = {0., 0., 0.};
      for (int jj = 0; jj < count; jj++) {
        const int j = neighbours[jj] & NEIGHMASK;
        const Vec d = xi - vec(x[j]);
        const double squared = dot(d, d), sum = ri + radius[j], reach = sum + formed();
        if (squared > reach * reach && !flags[jj]) continue;
        double *const history = histories + width * jj;
        Contact c;
        const double distance = std::sqrt(squared);
        c.gap = distance - sum;
        c.n = 1. / distance * d;
        if (!act(c, i, j, history, update, time_step, flags[jj])) continue;
        const Vec t = cross(c.n, c.force);
        const double share = 0.5 * c.gap;
        const Vec torque_of_i = c.couple - (ri + share) * t;
        force_i = force_i + c.force;
        torque_i = torque_i + torque_of_i;
        if (compute && (newton || j < nlocal)) {
          add_to(f[j], -1. * c.force);
          add_to(torque[j], -1. * c.couple - (radius[j] + share) * t);
        }
        if (tell) report(pair, i, j, newton, add, d, c.force, torque_of_i, history);
      }
      if (compute) {
        add_to(f[i], force_i);
        add_to(torque[i], torque_i);
      }
    }
    if (pair->cpl() && add) pair->cpl_pair_finalize();
  }

private:
  const int64_t hash_;

  /* Fills in a contact whose gap and normal are known; false if nothing acts. */
  inline bool act(Contact &c, const int i, const int j, double *const history, const bool update,
                  const double time_step, int &flag)
  {
    const double ri = atom->radius[i], rj = atom->radius[j];
    const bool touching = c.gap < 0.;
    c.type_i = atom->type[i];
    c.type_j = atom->type[j];
    if (!touching) history[SPRING] = history[SPRING + 1] = history[SPRING + 2] = 0.;
    const bridge::Table *const table = bridge_of(history, c.gap, i, j, c.type_j, rj);
    flag = touching ? CONTACT_NORMAL_MODEL | CONTACT_COHESION_MODEL | CONTACT_TANGENTIAL_MODEL
         : table    ? CONTACT_COHESION_MODEL
                    : 0;
    if (!flag) return false;
    const Vec v = vec(atom->v[i]) - vec(atom->v[j]), wi = vec(atom->omega[i]), wj = vec(atom->omega[j]);
    c.apart = dot(v, c.n);
    c.sliding = v - c.apart * c.n + cross(c.n, (ri + 0.5 * c.gap) * wi + (rj + 0.5 * c.gap) * wj);
    c.spin = wi - wj;
    c.rolling = cross(c.n, c.spin);
    c.force = c.couple = {0., 0., 0.};
    if (touching) {
      c.reduced_radius = ri * rj / (ri + rj);
      c.reduced_mass = atom->rmass[i] * atom->rmass[j] / (atom->rmass[i] + atom->rmass[j]);
      touch(c, history + SPRING, update, time_step);
    }
    if (table) wet(c, *table, history);
    return true;
  }

  __attribute__((noinline)) void report(PairGran *pair, const int i, const int j, const bool newton, const int add,
                                        const Vec d, const Vec of, const Vec torque, double *const history)
  {
    if (pair->cpl() && add) {
      SurfacesIntersectData surfaces;
      ForceData forces;
      surfaces.i = i;
      surfaces.j = j;
      surfaces.contact_history = history;
      add_to(forces.delta_F, of);
      add_to(forces.delta_torque, torque);
      pair->cpl_add_pair(surfaces, forces);
    }
    if (pair->evflag) pair->ev_tally_xyz(i, j, atom->nlocal, newton, 0., 0., of.x, of.y, of.z, d.x, d.y, d.z);
  }
};

/* Planes and the insides of upright cylinders, shaken as one. */
class FixWallBridge : public Fix {
public:
  FixWallBridge(LAMMPS *lmp, int count, char **args) : Fix(lmp, count, args), law_(0), type_(0), begin_(0), moves_(true)
  {
    Arguments words(*this, count, args);
    std::string file;
    while (words.more()) {
      const std::string word = words.next();
      if (word == "type") type_ = static_cast<int>(words.number());
      else if (word == "plane") {
        const Vec point = words.vector(), normal = words.vector();
        if (!(length(normal) > 0.)) error->fix_error(FLERR, this, "a plane has a normal of no length");
        walls_.push_back({1. / length(normal) * normal, point, 0.});
      } else if (word == "cylinder") {
        const double x = words.number(), y = words.number();
        walls_.push_back({{0., 0., 0.}, {x, y, 0.}, words.number()});
        if (!(walls_.back().radius > 0.)) error->fix_error(FLERR, this, "a cylinder has a radius that is not above 0");
      } else if (word == "shaken") {
        const Vec amplitude = words.vector();
        const double frequency = 2. * M_PI * words.number();
        waves_.push_back({amplitude, frequency, words.number(), 0.});
      } else if (word == "begin") begin_ = static_cast<bigint>(words.number());
      else if (word == "frame") moves_ = words.one_of("lab", "walls");
      else if (word == "loads") file = words.next();
      else error->fix_error(FLERR, this, ("unknown keyword " + word).c_str());
    }
    if (walls_.empty()) error->fix_error(FLERR, this, "expected a plane or a cylinder");
    if (type_ < 1 || type_ > atom->ntypes) error->fix_error(FLERR, this, "expected a type, of those of the box");
    if (moves_ && !file.empty()) error->fix_error(FLERR, this, "loads need the walls' frame: expected frame walls");
    load_width_ = 3 * (1 + waves_.size());
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
    law_ = Law::of(lmp);
    if (!law_) error->fix_error(FLERR, this, "the pair style has no cohesion bridge");
  }

  void setup_pre_neighbor() { pre_neighbor(); }

  /* Lists who has a bridge to a wall, or is so near that it may form one before neighbours are listed anew: until then
     beads go less than the skin, and walls twice their amplitudes. */
  void pre_neighbor()
  {
    double reach = law_->formed() + neighbor->skin;
    if (moves_)
      for (const Wave &wave : waves_) reach += 2. * length(wave.amplitude);
    near_.clear();
    move(0.);
    for (int wall = 0; wall < static_cast<int>(walls_.size()); wall++)
      for (int i = 0; i < atom->nlocal; i++) {
        Vec n;
        if (!(atom->mask[i] & groupbit)) continue;
        if (gap_at(wall, i, n) > reach && history_of(i, wall)[TABLE] == 0.) continue;
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

  struct Surface {
    Vec normal, point;
    double radius;  // of a cylinder, 0 of a plane
  };

  struct Wave {
    Vec amplitude;
    double frequency, phase, now;  // rad/s, rad; sine
  };

  struct Near {
    int bead, wall;
  };

  /* The words of a command after the style, read one by one. */
  class Arguments {
  public:
    Arguments(FixWallBridge &fix, const int count, char **const args) : fix_(fix), at_(args + 3), end_(args + count) {}
    bool more() const { return at_ < end_; }
    std::string next()
    {
      if (!more()) fix_.error->fix_error(FLERR, &fix_, "the command ends early");
      return *at_++;
    }
    double number()
    {
      const std::string word = next();
      return fix_.force->numeric(FLERR, const_cast<char *>(word.c_str()));
    }
    Vec vector()
    {
      const double x = number(), y = number(), z = number();
      return {x, y, z};
    }
    bool one_of(const std::string &yes, const std::string &no)
    {
      const std::string found = next();
      if (found != yes && found != no)
        fix_.error->fix_error(FLERR, &fix_, ("expected " + yes + " or " + no + ", not " + found).c_str());
      return found == yes;
    }

  private:
    FixWallBridge &fix_;
    char **at_, **end_;
  };

  const Law *law_;
  int type_, width_;
  std::vector<Surface> walls_;
  std::vector<double> history_;  // of each bead at each wall
  std::vector<Wave> waves_;
  std::vector<Near> near_;
  std::vector<double> loads_;  // by the ids of beads: gravity, amplitude of the acceleration of each wave
  size_t load_width_;
  bigint begin_;
  bool moves_;                   // in the frame of the laboratory
  Vec shift_, velocity_, push_;  // of the walls now; force on a mass of 1
  std::vector<double> cells_;
  std::vector<double *> rows_;

  double *of(const int i) { return &history_[static_cast<size_t>(i) * width_]; }

  void read_loads(const std::string &file)
  {
    std::ifstream in(file.c_str());
    const int most = atom->tag_max();
    loads_.resize((most + 1) * load_width_);
    bool whole = static_cast<bool>(in);
    for (int bead; whole && in >> bead;) {
      whole = bead > 0 && bead <= most;
      for (size_t column = 0; whole && column < load_width_; column++)
        whole = static_cast<bool>(in >> loads_[bead * load_width_ + column]);
    }
    if (!whole || !in.eof()) error->fix_error(FLERR, this, (file + " has no loads that can be read").c_str());
  }

  double *history_of(const int i, const int wall) { return of(i) + HISTORY * wall; }

  /* Puts the walls where they are in this step, with the velocity of some time before. */
  void move(const double before)
  {
    shift_ = velocity_ = push_ = {0., 0., 0.};
    const double time = (update->ntimestep - begin_) * update->dt;
    for (Wave &wave : waves_) {
      const double w = wave.frequency;
      wave.now = time < 0. ? 0. : std::sin(w * time + wave.phase);
      if (time < 0.) continue;
      if (moves_) {
        shift_ = shift_ + wave.now * wave.amplitude;
        velocity_ = velocity_ + w * std::cos(w * (time - before) + wave.phase) * wave.amplitude;
      } else push_ = push_ + w * w * wave.now * wave.amplitude;
    }
  }

  /* The inertial force where the frame is that of shaken walls, and the beads' own loads. */
  void push()
  {
    if (loads_.empty() && (moves_ || waves_.empty())) return;
    for (int i = 0; i < atom->nlocal; i++) {
      if (!(atom->mask[i] & groupbit)) continue;
      Vec acceleration = push_;
      if (!loads_.empty()) {
        const double *load = &loads_[atom->tag[i] * load_width_];
        acceleration = acceleration + vec(load);
        for (const Wave &wave : waves_) acceleration = acceleration + wave.now * vec(load += 3);
      }
      add_to(atom->f[i], atom->rmass[i] * acceleration);
    }
  }

  double gap_at(const int number, const int i, Vec &n) const
  {
    const Surface &wall = walls_[number];
    Vec d = vec(atom->x[i]) - wall.point - shift_;
    n = wall.normal;
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
    for (const Near &one : near_) {
      double *const history = history_of(one.bead, one.wall);
      Vec n;
      const double gap = gap_at(one.wall, one.bead, n);
      if (!(gap < 0.)) std::fill_n(history + SPRING, HISTORY - SPRING, 0.);
      if (gap > formed && history[TABLE] == 0.) continue;
      touch(one.bead, one.wall, gap, n, history, add, stretch, told);
    }
  }

  void touch(const int i, const int wall, const double gap, const Vec n, double *const history, const bool add,
             const bool stretch, std::vector<double> *const told)
  {
    if (std::isnan(gap)) error->one(FLERR, "fix wall/bridge: a bead's position is no number");
    const double radius = atom->radius[i];
    const bool touching = gap < 0.;
    Contact c;
    c.gap = gap;
    c.n = n;
    c.type_i = atom->type[i];
    c.type_j = type_;
    const bridge::Table *const table =
      law_->bridge_of(history, c.gap, i, WALL, type_, std::numeric_limits<double>::infinity());
    if (!touching && !table) return;
    const double arm = radius + 0.5 * c.gap;
    const Vec v = vec(atom->v[i]) - velocity_;
    c.spin = vec(atom->omega[i]);
    c.apart = dot(v, c.n);
    c.rolling = cross(c.n, c.spin);
    c.sliding = v - c.apart * c.n + arm * c.rolling;
    c.force = c.couple = {0., 0., 0.};
    if (touching) {
      c.reduced_radius = radius;
      c.reduced_mass = atom->rmass[i];
      law_->touch(c, history + SPRING, stretch, update->dt);
    }
    if (table) law_->wet(c, *table, history);
    if (add) {
      add_to(atom->f[i], c.force);
      add_to(atom->torque[i], c.couple - arm * cross(c.n, c.force));
    }
    if (told) {
      const Vec x = vec(atom->x[i]), foot = x - (radius + c.gap) * c.n;
      for (const double cell : {foot.x, foot.y, foot.z, x.x, x.y, x.z, 1. * wall, 1. * atom->tag[i], c.force.x,
                                c.force.y, c.force.z, -c.gap})
        told->push_back(cell);
    }
  }
};

/* The engine's table of fixes is private, and has no other entry: a pointer to the member, by explicit instantiation. */
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
