// SPDX-License-Identifier: GPL-2.0-or-later
// Copyright (c) 2026, the granular-walkers developers
/* A contact model for LIGGGHTS: liquid bridges whose forces are tables.

   Loaded with LD_PRELOAD into Debian's liggghts, it makes the engine know

       pair_style gran model hertz tangential history cohesion bridge [rolling_friction cdt] table FILE
       fix ID all wall/gran model hertz tangential history cohesion bridge [rolling_friction cdt] mesh ... table FILE

   Spheres repel each other by Hertz's law, damped, and hold each other by Mindlin's spring, damped, up to Coulomb's
   limit: mu times the elastic repulsion, damping included. Rolling friction is cdt's. A bridge (table.h) forms when the
   gap falls to its table's FORMATION (0: on touch) and breaks at its RUPTURE; between, with n the unit vector from j to
   i, w the velocity apart, s that of the surfaces along each other, q = n x (omega_i - omega_j),

       force on i  -(PULL + NORMAL w) n - (SLIDING s + COUPLING q),    couple  M = -(COUPLING s + ROLLING q)

   with the torques that conserve momentum and angular momentum. Overlapping surfaces have the bridge of gap 0.

   The engine's loops are written out for spheres: no heat, energies, rigid bodies, stored contact forces, virial of
   walls. A contact's history is the number of its table, 0 without a bridge, and the spring; the number is negative
   where i is the second bead of the table, for which the coupling has the other sign (n and s turn round, q does not). */
#include "granular_pair_style.h"
#include "granular_wall.h"
#include "contact_models.h"
#include "fix_insert_stream.h"  // which pair_gran_base.h forgets
#include "pair_gran_base.h"
#include "fix_wall_gran_base.h"
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
  Law(LAMMPS *lmp, IContactHistorySetup *const history, const bool rolls) : Pointers(lmp), rolls_(rolls), formed_(0.)
  {
    history->add_history_value("bridge", "1");  // "1": the sign changes where the engine swaps i and j
    history->add_history_value("shearx", "1");
    history->add_history_value("sheary", "1");
    history->add_history_value("shearz", "1");
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
    const int types = atom->ntypes + 1;
    dampings_.assign(types * types, Damping());
    for (int i = 1; i < types; i++)
      for (int j = 1; j < types; j++) {
        const double damping = -2. * std::sqrt(5. / 6.) * ratio[i][j];
        dampings_[i * types + j] = {damping * std::sqrt(2. * modulus_[i][j]),
                                    damping * std::sqrt(8. * shear_modulus_[i][j])};
      }
    // The engine looks for neighbours up to a multiple of the sum of the radii, at a wall of the radius.
    double reach = 0.;
    for (const bridge::Table &one : tables_)
      reach =
        std::max(reach, one.rupture / (std::isinf(one.radius[1]) ? one.radius[0] : one.radius[0] + one.radius[1]));
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

protected:
  /* The bridge of a contact whose surfaces touch or had one: its table, or none; the history is kept up. */
  inline const bridge::Table *bridge_of(double *const history, const double gap, const int type_i, const int type_j,
                                        const double radius_i, const double radius_j)
  {
    if (history[TABLE] == 0.) {
      if (gap > formed_) return 0;
      const int number = find(type_i, type_j, radius_i, radius_j);
      if (gap > tables_[number].formation) return 0;
      history[TABLE] = tables_[number].begins_with(radius_i) ? 1. + number : -1. - number;
    }
    const bridge::Table *const table = &tables_[static_cast<int>(std::fabs(history[TABLE])) - 1];
    if (gap < table->rupture) return table;
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

  const bool rolls_;
  double formed_;  // the largest gap at which any bridge forms
  double **modulus_, **shear_modulus_, **friction_, **rolling_friction_;

private:
  struct Damping {
    double normal, along;
  };
  std::vector<Damping> dampings_;  // by both types
  std::string file_;
  std::vector<bridge::Table> tables_;

  __attribute__((noinline)) int find(const int type_i, const int type_j, const double radius_i, const double radius_j)
  {
    for (size_t number = 0; number < tables_.size(); number++)
      if (tables_[number].joins(type_i, type_j, radius_i, radius_j)) return number;
    char text[512];
    snprintf(text, sizeof(text), "cohesion bridge: %s has no table of types %d and %d, radii %g and %g m",
             file_.c_str(), type_i, type_j, radius_i, radius_j);
    error->one(FLERR, text);
    return -1;
  }
};

class Pair : public PairStyles::IGranularPairStyle, private Law {
public:
  Pair(LAMMPS *lmp, PairGran *parent, const int64_t hash, const bool rolls) : Law(lmp, parent, rolls), hash_(hash) {}
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
        const double squared = dot(d, d), sum = ri + radius[j], reach = sum + formed_;
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
    const bridge::Table *const table = bridge_of(history, c.gap, c.type_i, c.type_j, ri, rj);
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

class Wall : public Walls::IGranularWall, private Law {
public:
  Wall(LAMMPS *lmp, FixWallGran *parent, const int64_t, const bool rolls) : Law(lmp, parent, rolls) {}
  void settings(int n, char **args, IContactHistorySetup *) { Law::settings(n, args); }
  void init_granular() { connect(); }
  bool checkSurfaceIntersect(SurfacesIntersectData &) { return true; }
  int get_history_offset(const std::string) { return -1; }
  bool contact_match(const std::string kind, const std::string model) { return match(kind, model); }

  void compute_force(FixWallGran *wall, SurfacesIntersectData &surfaces, bool touching, double *velocity,
                     FixMeshSurface *fix_mesh, int mesh_number, TriMesh *mesh, int triangle)
  {
    const int i = surfaces.i;
    double *const history = surfaces.contact_history;
    const bool tell = wall->compute_wall_gran_local() && wall->addflag();
    const double radius = surfaces.radi;
    Contact c;
    c.gap = -surfaces.deltan;
    c.type_i = atom->type[i];
    c.type_j = wall->atom_type_wall();
    if (!touching) history[SPRING] = history[SPRING + 1] = history[SPRING + 2] = 0.;
    const bridge::Table *const table =
      bridge_of(history, c.gap, c.type_i, c.type_j, radius, std::numeric_limits<double>::infinity());
    if (!touching && !table && !tell) return;
    surfaces.r = radius + c.gap;
    surfaces.rsq = surfaces.r * surfaces.r;
    surfaces.has_force_update = true;
    c.n = 1. / surfaces.r * vec(surfaces.delta);
    add_to(surfaces.en, c.n - vec(surfaces.en));
    const double arm = radius + 0.5 * c.gap;
    const Vec v = vec(atom->v[i]) - vec(velocity);
    c.spin = vec(atom->omega[i]);
    c.apart = dot(v, c.n);
    c.rolling = cross(c.n, c.spin);
    c.sliding = v - c.apart * c.n + arm * c.rolling;
    c.force = c.couple = {0., 0., 0.};
    if (touching) {
      c.reduced_radius = radius;
      c.reduced_mass = atom->rmass[i];
      touch(c, history + SPRING, wall->computeflag() && wall->shearupdate(), update->dt);
    }
    if (table) wet(c, *table, history);
    const Vec torque = c.couple - arm * cross(c.n, c.force);
    if (wall->computeflag()) {
      add_to(atom->f[i], c.force);
      add_to(atom->torque[i], torque);
    }
    if (tell) report(wall, surfaces, velocity, c, torque, mesh_number, mesh, triangle);
    double acted[3] = {c.force.x, c.force.y, c.force.z};
    if (wall->store_force())
      vectorAdd3D(wall->fix_wallforce()->array_atom[i], acted, wall->fix_wallforce()->array_atom[i]);
    if (fix_mesh && (touching || table)) {
      double delta[3] = {-surfaces.delta[0], -surfaces.delta[1], -surfaces.delta[2]};
      fix_mesh->add_particle_contribution(i, acted, delta, triangle, velocity);
    }
  }

private:
  __attribute__((noinline)) void report(FixWallGran *wall, SurfacesIntersectData &surfaces, double *velocity,
                                        const Contact &c, const Vec torque, const int mesh_number, TriMesh *mesh,
                                        const int triangle)
  {
    const int i = surfaces.i;
    double at[3], normal[3] = {-c.n.x, -c.n.y, -c.n.z};
    vectorSubtract3D(atom->x[i], surfaces.delta, at);
    ComputePairGranLocal *const rows = wall->compute_wall_gran_local();
    rows->add_wall_1(mesh_number, mesh ? mesh->id(triangle) : 0, i, at, velocity);
    rows->add_wall_2(i, c.force.x, c.force.y, c.force.z, torque.x, torque.y, torque.z, surfaces.contact_history,
                     surfaces.rsq, normal);
  }
};

template<bool ROLLS> PairStyles::IGranularPairStyle *make_pair_style(LAMMPS *lmp, PairGran *parent, int64_t hash)
{
  return new Pair(lmp, parent, hash, ROLLS);
}

template<bool ROLLS> Walls::IGranularWall *make_wall(LAMMPS *lmp, FixWallGran *parent, int64_t hash)
{
  return new Wall(lmp, parent, hash, ROLLS);
}

template<bool ROLLS> void add_styles()
{
  const int rolling = ROLLS ? ROLLING_CDT : ROLLING_OFF;
  const int64_t hash = Utils::generate_gran_hashcode(HERTZ, TANGENTIAL_HISTORY, BRIDGE_ID, rolling, SURFACE_DEFAULT);
  PairStyles::Factory::instance().addStyle("gran", hash, &make_pair_style<ROLLS>);
  Walls::Factory::instance().addStyle("gran", hash, &make_wall<ROLLS>);
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
