// SPDX-License-Identifier: GPL-2.0-or-later
// Copyright (c) 2026, the granular-walkers developers
/* The fix "wall/bridge": contacts and bridges of beads with walls, and the shaking. The equations
   are in forces.h; a wall is a body of infinite radius and mass.

   LIGGGHTS's mesh walls are slow, and its primitive walls do not report their contacts. */
#ifndef BRIDGE_WALL_FIX_H
#define BRIDGE_WALL_FIX_H

#include "law.h"
#include "wall_command.h"

namespace {

class FixWallBridge : public Fix {
public:
  FixWallBridge(LAMMPS *lmp, int count, char **words) : Fix(lmp, count, words), law_(0)
  {
    try {
      const WallCommand command(CommandWords(force, 3, count, words), atom);
      type_ = command.type;
      walls_ = command.walls;
      shaking_ = command.shaking;
    } catch (const std::exception &problem) {
      error->fix_error(FLERR, this, problem.what());
    }
    width_ = HISTORY * walls_.size();
    create_attribute = restart_peratom = local_flag = local_freq = nevery = 1;
    size_local_rows = 0;
    size_local_cols = COLUMNS;
    grow_arrays(atom->nmax);
    atom->add_callback(GROW);
    atom->add_callback(RESTART);
  }

  ~FixWallBridge()
  {
    atom->delete_callback(id, GROW);
    atom->delete_callback(id, RESTART);
  }

  int setmask() { return FixConst::PRE_NEIGHBOR | FixConst::POST_FORCE | FixConst::END_OF_STEP; }

  // The engine makes its tables of materials for types up to the largest one that is in use.
  int min_type() { return type_; }
  int max_type() { return type_; }

  void init()
  {
    law_ = Law::of_engines()[lmp];
    if (!law_) error->fix_error(FLERR, this, "the pair style has no cohesion bridge");
  }

  void setup_pre_neighbor() { pre_neighbor(); }

  /* Lists the beads that have a bridge to a wall or may form one before the next list: until then a
     bead moves by less than the skin, and a wall by at most twice its amplitude. */
  void pre_neighbor()
  {
    const double formation = law_->largest_formation();
    const double farthest = formation + neighbor->skin + 2. * shaking_.largest_displacement();
    const double longer = law_->largest_rupture() - formation;
    near_.clear();
    move_walls(0.);
    for (int wall = 0; wall < static_cast<int>(walls_.size()); wall++)
      for (int i = 0; i < atom->nlocal; i++) {
        if (!(atom->mask[i] & groupbit)) continue;
        double gap = walls_[wall].lowest_gap(vec(atom->x[i]), atom->radius[i], shaking_.shift());
        // A bridge may be handed over to any facet within the longest bridge.
        if (walls_[wall].is_facet()) gap -= longer;
        if (gap > farthest && history_of(i, wall)[TABLE] == 0.) continue;
        near_.push_back({i, wall});
      }
  }

  void setup(int)
  {
    move_walls(0.);
    shaking_.add_forces(atom, groupbit);
    compute_contacts(true, false, 0);
    list_contacts();
  }

  void post_force(int)
  {
    move_walls(0.5 * update->dt);  // velocities of beads are still those of half a step earlier
    shaking_.add_forces(atom, groupbit);
    compute_contacts(true, true, 0);
  }

  /* Lists the contacts for a dump, with the velocities at the end of the step, as in the lists of
     pairs and of beads. */
  void end_of_step()
  {
    if (update->ntimestep != output->next_dump_any) return;
    move_walls(0.);
    list_contacts();
  }

  // --- histories: they go with their bead through arrays, ranks and restart files ----------------

  void grow_arrays(int capacity) { histories_.resize(static_cast<size_t>(capacity) * width_); }
  void copy_arrays(int from, int to, int)
  {
    std::copy_n(histories_of(from), width_, histories_of(to));
  }
  void set_arrays(int i) { std::fill_n(histories_of(i), width_, 0.); }
  int pack_exchange(int i, double *buffer)
  {
    std::copy_n(histories_of(i), width_, buffer);
    return width_;
  }
  int unpack_exchange(int i, double *buffer)
  {
    std::copy_n(buffer, width_, histories_of(i));
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
    double *stored = atom->extra[i];
    for (; number; number--) stored += static_cast<int>(stored[0]);
    if (stored[0] != width_ + 1)
      error->fix_error(FLERR, this, "the restart file has another number of walls");
    unpack_exchange(i, stored + 1);
  }

private:
  // Callbacks of the engine: when its arrays grow, and when a restart file is read.
  enum { GROW, RESTART };
  enum { COLUMNS = 12 };  // nearest point and centre: x, y, z; wall, bead; force: x, y, z; overlap

  struct NearWall {
    int bead, wall;
  };

  const Law *law_;
  int type_, width_;
  std::vector<Wall> walls_;
  Shaking shaking_;
  std::vector<double> histories_;  // of each bead at each wall; width_ for a bead
  std::vector<NearWall> near_;
  std::vector<double> cells_;   // of the list of contacts
  std::vector<double *> rows_;  // of these cells

  double *histories_of(const int i) { return &histories_[static_cast<size_t>(i) * width_]; }
  double *history_of(const int i, const int wall) { return histories_of(i) + HISTORY * wall; }

  void move_walls(const double earlier) { shaking_.move(update->ntimestep, update->dt, earlier); }

  inline double gap_at(const NearWall &near, Vec &n) const
  {
    const double radius = atom->radius[near.bead];
    return walls_[near.wall].gap(vec(atom->x[near.bead]), radius, shaking_.shift(), n);
  }

  bool meets(const NearWall &near) const
  {
    return walls_[near.wall].meets(vec(atom->x[near.bead]), shaking_.shift());
  }

  /* If the nearest point of a bead has left a facet, moves its bridge and spring to the facet
     with the nearest point now, around an edge or in a valley: one that the bead meets, within a
     radius, and that has no history. Without such a facet they stay, and the bridge breaks. */
  void hand_over(const NearWall &near)
  {
    double *const history = history_of(near.bead, near.wall);
    if (is_blank(history) || meets(near)) return;
    const double radius = atom->radius[near.bead];
    Vec n;
    double gap = gap_at(near, n);
    const Vec foot = (radius + gap) * n;
    double *nearest = 0, smallest_distance = radius;
    for (const NearWall &next : near_) {
      double *const next_history = history_of(next.bead, next.wall);
      if (next.bead != near.bead || !is_blank(next_history) || !meets(next)) continue;
      gap = gap_at(next, n);
      const double distance = length((radius + gap) * n - foot);
      if (distance < smallest_distance) {
        smallest_distance = distance;
        nearest = next_history;
      }
    }
    if (nearest) std::swap_ranges(history, history + HISTORY, nearest);
  }

  static bool is_blank(const double *const history)
  {
    return std::all_of(history, history + HISTORY, [](const double value) { return value == 0.; });
  }

  /* Fills the table of contacts that the engine dumps. */
  void list_contacts()
  {
    cells_.clear();
    compute_contacts(false, false, &cells_);
    size_local_rows = cells_.size() / COLUMNS;
    rows_.clear();
    for (int row = 0; row < size_local_rows; row++) rows_.push_back(&cells_[row * COLUMNS]);
    array_local = rows_.data();
  }

  /* Computes all contacts and bridges with walls. If applies, their forces are added to those of
     the beads; if updates, springs stretch for a step; cells, if not 0, receives a row for each
     contact and bridge. */
  void compute_contacts(const bool applies, const bool updates, std::vector<double> *const cells)
  {
    const double infinity = std::numeric_limits<double>::infinity();
    const Vec at_rest = {0., 0., 0.};
    const double formation = law_->largest_formation();
    const auto flush = [&]() { flush_batch(applies, updates, cells); };
    batch.count = 0;
    for (const NearWall &near : near_)
      if (walls_[near.wall].is_facet()) hand_over(near);
    for (const NearWall &near : near_) {
      const int i = near.bead;
      double *const history = history_of(i, near.wall);
      Vec n;
      double gap = gap_at(near, n);
      if (std::isnan(gap)) error->one(FLERR, "fix wall/bridge: a bead's position is no number");
      const bool is_far = gap > formation && history[TABLE] == 0.;
      if (!is_far && !meets(near)) gap = infinity;
      if (!(gap < 0.)) std::fill_n(history + SPRING, HISTORY - SPRING, 0.);
      if (gap > formation && history[TABLE] == 0.) continue;
      const bridge::Table *const table = law_->bridge_of(history, gap, i, WALL, type_, infinity);
      if (!(gap < 0.) && !table) continue;
      const Vec v = vec(atom->v[i]) - shaking_.velocity();
      const double radius = atom->radius[i];
      const int k = law_->add(flush, i, near.wall, atom->type[i], type_, n, v, vec(atom->omega[i]),
                              at_rest, radius, 0., table, gap, history);
      batch.inverse[k] = 1.;
      batch.gap[k] = gap;
      batch.reduced_radius[k] = radius;
      batch.reduced_mass[k] = atom->rmass[i];
    }
    flush();
  }

  /* Computes the batch, applies or lists its forces, and empties it. */
  void flush_batch(const bool applies, const bool updates, std::vector<double> *const cells)
  {
    Batch &b = batch;
    if (!b.count) return;
    law_->compute(updates, update->dt);
    for (int k = 0; k < b.count; k++) {
      const int i = b.i[k];
      const Vec f = b.force.get(k), x = vec(atom->x[i]);
      if (applies) {
        add_to(atom->f[i], f);
        add_to(atom->torque[i], b.torque_i.get(k));
      }
      if (!cells) continue;
      const Vec foot = x - (atom->radius[i] + b.gap[k]) * b.d.get(k);
      const double wall = b.j[k], tag = atom->tag[i], overlap = -b.gap[k];
      for (const double cell :
           {foot.x, foot.y, foot.z, x.x, x.y, x.z, wall, tag, f.x, f.y, f.z, overlap})
        cells->push_back(cell);
    }
    b.count = 0;
  }
};

}
#endif
