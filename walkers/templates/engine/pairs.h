// SPDX-License-Identifier: GPL-2.0-or-later
// Copyright (c) 2026, the granular-walkers developers
/* The pair style "gran model hertz tangential history cohesion bridge": contacts and bridges
   between spheres. The equations are in forces.h.

   The engine's own loop is for any shape and any models. It is written out here for spheres and
   for these models, and gathers contacts in batches whose forces are computed together. */
#ifndef BRIDGE_PAIRS_H
#define BRIDGE_PAIRS_H

#include "law.h"

namespace {

class PairBridge : public PairStyles::IGranularPairStyle, private Law {
public:
  PairBridge(LAMMPS *lmp, PairGran *parent, const int64_t hash, const bool rolling_friction)
      : Law(lmp, rolling_friction), hash_(hash)
  {
    // "1": the sign of a value changes where the engine swaps i and j.
    for (const char *const value : {"bridge", "shearx", "sheary", "shearz"})
      parent->add_history_value(value, "1");
  }
  void settings(int count, char **words, IContactHistorySetup *) { Law::settings(count, words); }
  void init_granular() { connect(); }
  int get_history_offset(const std::string) { return -1; }
  double stressStrainExponent() { return 1.5; }
  int64_t hashcode() { return hash_; }
  bool contact_match(const std::string kind, const std::string model) { return match(kind, model); }
  void write_restart_settings(FILE *file) { fwrite(&hash_, sizeof(hash_), 1, file); }
  void read_restart_settings(FILE *file, int64_t)
  {
    int64_t stored;
    if (comm->me == 0 && (fread(&stored, sizeof(stored), 1, file) != 1 || stored != hash_))
      error->one(FLERR, "cohesion bridge: the restart file is of another pair style");
  }

  void compute_force(PairGran *pair, int energies, int virial, int add)
  {
    if (energies || virial) pair->ev_setup(energies, virial);
    else pair->evflag = pair->vflag_fdotr = 0;
    begin_step();
    if (pair->fr_pair() || pair->storeSumDelta() || pair->storeContactForces()
        || pair->storeContactForcesStress())
      error->all(FLERR,
                 "cohesion bridge has no rigid bodies, multicontact or stored contact forces");
    if (!pair->list->inum) return;
    pair_ = pair;
    applies_ = pair->computeflag();
    updates_ = applies_ && pair->shearupdate();
    lists_ = pair->cpl() && add;
    gather();
    if (lists_) pair->cpl_pair_finalize();
  }

private:
  const int64_t hash_;
  PairGran *pair_;  // valid for this step, like the following members
  bool applies_;    // forces are added to those of the beads
  bool updates_;    // springs stretch
  bool lists_;      // contacts are rows of a "compute pair/gran/local"

  /* Goes through the neighbour list: finds contacts and bridges, and computes them in batches. */
  void gather()
  {
    const auto flush = [this]() __attribute__((noinline)) { flush_batch(); };
    const double formation = largest_formation();
    const int width = pair_->dnum();
    NeighList *const list = pair_->list;
    // Rows of these arrays are one block.
    const Vec *const x = &vec(atom->x[0]), *const v = &vec(atom->v[0]);
    const Vec *const omega = &vec(atom->omega[0]);
    const double *const radius = atom->radius, *const mass = atom->rmass;
    const int *const type = atom->type;

    batch.count = 0;
    for (int ii = 0; ii < list->inum; ii++) {
      const int i = list->ilist[ii], count = list->numneigh[i], type_i = type[i];
      const int *const neighbours = list->firstneigh[i];
      int *const flags = list->listgranhistory->firstneigh[i];
      double *history = list->listgranhistory->firstdouble[i] - width;
      const Vec x_i = x[i], v_i = v[i], omega_i = omega[i];
      const double radius_i = radius[i], mass_i = mass[i];
      for (int jj = 0; jj < count; jj++) {
        history += width;
        const int j = neighbours[jj] & NEIGHMASK;
        const double radius_j = radius[j], sum = radius_i + radius_j, farthest = sum + formation;
        const Vec d = x_i - x[j];
        const double squared = dot(d, d);
        if (squared > farthest * farthest && !flags[jj]) continue;
        const bool touches = squared < sum * sum;
        // All overlaps have the bridge of a gap of 0: only gaps of open bridges are computed.
        const double gap = touches ? -0. : std::sqrt(squared) - sum;
        if (!touches) history[SPRING] = history[SPRING + 1] = history[SPRING + 2] = 0.;
        const bridge::Table *const table = bridge_of(history, gap, i, j, type[j], radius_j);
        flags[jj] = flags_of(touches, table);
        if (!flags[jj]) continue;
        const int k = Law::add(flush, i, j, type_i, type[j], d, v_i - v[j], omega_i, omega[j],
                               radius_i, radius_j, table, gap, history);
        batch.mass_i[k] = mass_i;
        batch.mass_j[k] = mass[j];
      }
    }
    flush();
  }

  /* The flags of a contact in the neighbour list: the engine keeps the history of those with any. */
  static inline int flags_of(const bool touches, const bridge::Table *const table)
  {
    if (touches) return CONTACT_NORMAL_MODEL | CONTACT_COHESION_MODEL | CONTACT_TANGENTIAL_MODEL;
    return table ? CONTACT_COHESION_MODEL : 0;
  }

  /* Computes the batch, adds its forces to those of the beads, reports them, and empties it. */
  void flush_batch()
  {
    if (!batch.count) return;
    measure_pairs();
    compute(updates_, update->dt);
    if (applies_) apply();
    if (lists_ || pair_->evflag)
      for (int k = 0; k < batch.count; k++) report(k);
    batch.count = 0;
  }

  /* Adds the forces of the batch to those of the beads. */
  void apply()
  {
    Vec *const f = &vec(atom->f[0]), *const torque = &vec(atom->torque[0]);
    // Without Newton's third law between ranks, beads of others get their forces from those.
    const int end = force->newton_pair ? std::numeric_limits<int>::max() : atom->nlocal;
    for (int k = 0; k < batch.count;) {
      const int i = batch.i[k];
      Vec force_i = f[i], torque_i = torque[i];  // in registers, for all contacts of a bead
      for (; k < batch.count && batch.i[k] == i; k++) {
        const Vec force_k = batch.force.get(k);
        force_i = force_i + force_k;
        torque_i = torque_i + batch.torque_i.get(k);
        const int j = batch.j[k];
        if (j >= end) continue;
        f[j] = f[j] - force_k;
        torque[j] = torque[j] + batch.torque_j.get(k);
      }
      f[i] = force_i;
      torque[i] = torque_i;
    }
  }

  /* Reports a contact to the compute that lists contacts, and to the virial. */
  __attribute__((noinline)) void report(const int k)
  {
    const int i = batch.i[k], j = batch.j[k];
    const Vec f = batch.force.get(k), d = batch.d.get(k);
    if (lists_) {
      SurfacesIntersectData surfaces;
      ForceData forces;
      surfaces.i = i;
      surfaces.j = j;
      surfaces.contact_history = batch.history[k];
      add_to(forces.delta_F, f);
      add_to(forces.delta_torque, batch.torque_i.get(k));
      pair_->cpl_add_pair(surfaces, forces);
    }
    if (pair_->evflag)
      pair_->ev_tally_xyz(i, j, atom->nlocal, force->newton_pair, 0., 0., f.x, f.y, f.z, d.x, d.y,
                          d.z);
  }
};

}
#endif
