// SPDX-License-Identifier: GPL-2.0-or-later
// Copyright (c) 2026, the granular-walkers developers
/* The cohesion model of pairs of beads. */
#ifndef BRIDGE_PAIRS_H
#define BRIDGE_PAIRS_H

#include "law.h"

namespace {

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

}
#endif
