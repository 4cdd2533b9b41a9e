// SPDX-License-Identifier: GPL-2.0-or-later
// Copyright (c) 2026, the granular-walkers developers
/* Forces and torques of contacts and bridges between two spheres, or a sphere and a wall.

   The unit vector n points from j to i, h is the gap between the surfaces, l_i = R_i + h/2 and
   l_j = R_j + h/2 are the distances of the centres from the middle of the contact. R* and m* are
   the reduced radius and mass; at a wall they are those of the sphere. The relative motion is

       normal    w = v · n                                    with v = v_i - v_j
       sliding   s = v - w n + n × (l_i ω_i + l_j ω_j)
       rolling   q = n × (ω_i - ω_j)

   The force on i is F = (F_el - P - (c_n + N) w) n - T with T = T_c + S s + C q, that on j is
   -F. The torques are

       l_i n × T + n × (C s + Q q) - M_r    on i
       l_j n × T - n × (C s + Q q) + M_r    on j

   The pull P and the resistances N, S, C and Q belong to the bridge and come from its table; the
   laws and their sources are in walkers/physics/laws. Surfaces that overlap by d = -h > 0 also
   have

       repulsion           F_el = 4/3 E* √R* d^(3/2)                                        [1]
       normal damping      c_n = 2 √(5/6) β √(k_n m*)   with k_n = 2 E* √(R* d)             [2]
       tangential spring   k_t = 8 G* √(R* d) times the elongation ∫ s dt along the surfaces  [3]
       tangential damping  c_t = 2 √(5/6) β √(k_t m*)
       friction            |T_c| ≤ μ(s) F_el for the sum of spring and damping,
                           with μ(s) = μ_0 + Δμ s/(s + s_h) at the speed s = |s| of sliding     [5]
       rolling friction    M_r = μ_r F_el R* (ω - (ω · n) n)/|ω|   with ω = ω_i - ω_j         [4]

   The edges of a meniscus resist their motion over both surfaces [6]. The point of contact moves
   along the surfaces with the velocities

       u_i =  l_i ω_i × n - (l_i/L) t,    u_j = -l_j ω_j × n + (l_j/L) t    with L = l_i + l_j

   where t = v - w n: the line of centres turns with n × t/L. The edges drag surface i along with
   f_i = E u_i/|u_i|^(1/3), and j with f_j. Their forces and torques add to the above

       (l_j/L) f_j - (l_i/L) f_i    in T,    -(l_i l_j/L) (f_i + f_j)    in C s + Q q

   so that they dissipate f_i · u_i + f_j · u_j. Below U_0 = 10 um/s they are proportional to u.

   The damping ratio β follows from the restitution, e = exp(-πβ/√(1 - β²)). A spring that
   exceeds the limit of friction slips: it is shortened to the limit and has no damping. Without a rise
   Δμ the limit is Coulomb's.

   [1] H. Hertz, J. reine angew. Math. 92 (1882) 156, doi 10.1515/crll.1882.92.156
   [2] Tsuji et al., doi 10.1016/0032-5910(92)88030-L
   [3] R. D. Mindlin, J. Appl. Mech. 16 (1949) 259
   [4] Ai et al., doi 10.1016/j.powtec.2010.09.030: constant directional torque, "cdt" in LIGGGHTS
   [5] velocity-strengthening friction; half of the rise is reached at s_h
   [6] F. P. Bretherton, J. Fluid Mech. 10 (1961) 166; E is from walkers/physics/edges.py */
#ifndef BRIDGE_FORCES_H
#define BRIDGE_FORCES_H

#include "table.h"
#include "vectors.h"

namespace {

/* For loops over contacts: the compiler computes eight, four or two contacts at once, with the same
   digits. The library contains all three versions and chooses one when it is loaded. */
#if defined(__x86_64__)
#define BY_LANES __attribute__((noinline, target_clones("avx512f", "avx2", "default")))
#else
#define BY_LANES __attribute__((noinline))
#endif

/* Coefficients of the contacts between two atom types. */
struct Materials {
  double stiffness;         // 4/3 E*
  double shear_stiffness;   // 8 G*
  double damping;           // 2 √(5/6) β √(2 E*)
  double shear_damping;     // 2 √(5/6) β √(8 G*)
  double friction;          // μ_0
  double rolling_friction;  // μ_r
  double friction_rise;     // Δμ
  double half_rise_speed;   // s_h
};

/* Indices in the history of a contact: number of its table (law.h) and elongation of its spring. */
enum { TABLE, SPRING, HISTORY = SPRING + 3 };

/* Contacts between the same two materials, whose forces are computed together. */
struct Batch {
  enum { CAPACITY = 32, LANES = 8 };
  typedef double Numbers[CAPACITY];
  struct Vecs {
    Numbers x, y, z;
    inline Vec get(const int k) const { return {x[k], y[k], z[k]}; }
    inline void put(const int k, const Vec a) { x[k] = a.x, y[k] = a.y, z[k] = a.z; }
  };

  Vecs d;  // from j to i
  Vecs v;  // of i relative to j
  Vecs omega_i, omega_j;
  Vecs spring;  // its elongation
  Numbers radius_i, radius_j, mass_i, mass_j;
  Numbers bridge[bridge::COLUMNS];  // pull and resistances
  Numbers edge;                     // E of its bridge
  Numbers edge_i, edge_j;           // E/|u_i|^(1/3) and E/|u_j|^(1/3)
  Numbers inverse;                  // of the length of d
  Numbers gap, reduced_radius, reduced_mass;
  Vecs force, torque_i, torque_j;  // results; the force is that on i
  int count, i[CAPACITY], j[CAPACITY];
  const Materials *materials;
  double *history[CAPACITY];

  /* The count rounded up to whole lanes; the results of the lanes beyond the count are not used. */
  int padded_count() const { return (count + LANES - 1) / LANES * LANES; }
};

/* The contacts that are being gathered. One for all: the engine computes with one thread. */
Batch batch __attribute__((aligned(64)));

/* Computes gaps, reduced radii and reduced masses of pairs of spheres. */
BY_LANES void measure_pairs()
{
  Batch &b = batch;
  for (int k = 0, count = b.padded_count(); k < count; k++) {
    const double distance = length(b.d.get(k)), sum = b.radius_i[k] + b.radius_j[k];
    b.inverse[k] = 1. / distance;
    b.gap[k] = distance - sum;
    b.reduced_radius[k] = b.radius_i[k] * b.radius_j[k] / sum;
    b.reduced_mass[k] = b.mass_i[k] * b.mass_j[k] / (b.mass_i[k] + b.mass_j[k]);
  }
}

/* The velocities u_i and u_j of the edges of a contact along both surfaces, and l_j/L. */
struct EdgeMotion {
  Vec i, j;
  double part_j;
};
__attribute__((always_inline)) inline EdgeMotion
edge_motion(const Batch &b, const int k, const Vec n, const Vec along, const double arm_i,
            const double arm_j)
{
  const double part_j = b.radius_j[k] > 0. ? arm_j / (arm_i + arm_j) : 1.;  // of a wall it is 0
  return {arm_i * cross(b.omega_i.get(k), n) - (1. - part_j) * along,
          part_j * along - arm_j * cross(b.omega_j.get(k), n), part_j};
}

/* Computes the resistances of the edges of the batch: apart from the loop below, which the cube root
   would keep from computing several contacts at once. */
inline void measure_edges()
{
  const double slowest = 1e-5;  // U_0, m/s, as in walkers/physics/edges.py
  Batch &b = batch;
  for (int k = 0; k < b.count; k++) {
    const Vec n = b.inverse[k] * b.d.get(k), v = b.v.get(k), along = v - dot(v, n) * n;
    const double half = 0.5 * b.gap[k];
    const EdgeMotion u = edge_motion(b, k, n, along, b.radius_i[k] + half, b.radius_j[k] + half);
    const double squared_i = dot(u.i, u.i) + slowest * slowest;
    const double squared_j = dot(u.j, u.j) + slowest * slowest;
    b.edge_i[k] = b.edge[k] / std::cbrt(std::sqrt(squared_i));
    b.edge_j[k] = b.edge[k] / std::cbrt(std::sqrt(squared_j));
  }
}

/* Computes the forces and torques of the batch. Springs stretch for time_step, s. */
template<bool ROLLING_FRICTION, bool STRENGTHENING, bool EDGES>
__attribute__((always_inline)) inline void compute_batch(const double time_step)
{
  Batch &b = batch;
  const Materials materials = *b.materials;
  for (int k = 0, count = b.padded_count(); k < count; k++) {
    const Vec d = b.d.get(k), v = b.v.get(k);
    const Vec omega_i = b.omega_i.get(k), omega_j = b.omega_j.get(k);
    const double gap = b.gap[k], separation = b.inverse[k] * dot(v, d);
    const double arm_i = b.radius_i[k] + 0.5 * gap, arm_j = b.radius_j[k] + 0.5 * gap;
    const Vec n = b.inverse[k] * d, spin = omega_i - omega_j, rolling = cross(n, spin);
    const Vec sliding = v - separation * n + cross(n, arm_i * omega_i + arm_j * omega_j);

    // Surfaces apart have no overlap, so that all terms of the contact vanish without a branch.
    const double overlap = gap < 0. ? -gap : 0.;
    const double root = std::sqrt(b.reduced_radius[k] * overlap);
    const double elastic = materials.stiffness * root * overlap;
    const double damping = std::sqrt(root * b.reduced_mass[k]);

    Vec elongation = b.spring.get(k) + time_step * sliding;
    elongation = elongation - dot(elongation, n) * n;  // the spring turns with the contact
    Vec tangential = materials.shear_stiffness * root * elongation;
    double friction = materials.friction;
    if (STRENGTHENING) {
      const double speed = length(sliding);
      friction += materials.friction_rise * speed / (speed + materials.half_rise_speed);
    }
    const double limit = friction * elastic, spring_squared = dot(tangential, tangential);
    const bool slips = spring_squared > limit * limit;
    tangential = tangential + (slips ? 0. : materials.shear_damping * damping) * sliding;
    const double size = std::sqrt(slips ? spring_squared : dot(tangential, tangential));
    const double ratio = limit / (size + 1e-150), factor = ratio < 1. ? ratio : 1.;
    b.spring.put(k, (slips ? factor : 1.) * elongation);

    const double coupling = b.bridge[bridge::COUPLING][k];
    tangential = factor * tangential + b.bridge[bridge::SLIDING][k] * sliding + coupling * rolling;
    const double resistance = materials.damping * damping + b.bridge[bridge::NORMAL][k];
    Vec both_edges = {0., 0., 0.};
    if (EDGES) {
      const EdgeMotion u = edge_motion(b, k, n, v - separation * n, arm_i, arm_j);
      const Vec f_i = b.edge_i[k] * u.i, f_j = b.edge_j[k] * u.j;
      tangential = tangential + u.part_j * f_j - (1. - u.part_j) * f_i;
      both_edges = arm_i * u.part_j * (f_i + f_j);
    }
    const double normal = elastic - b.bridge[bridge::PULL][k] - resistance * separation;
    b.force.put(k, normal * n - tangential);

    const Vec turn = cross(n, tangential);
    Vec couple = cross(n, coupling * sliding + b.bridge[bridge::ROLLING][k] * rolling);
    if (EDGES) couple = couple - cross(n, both_edges);
    if (ROLLING_FRICTION) {
      const double speed = length(spin) + 1e-150;
      const double moment = materials.rolling_friction * elastic * b.reduced_radius[k] / speed;
      couple = couple - moment * (spin - dot(spin, n) * n);
    }
    b.torque_i.put(k, arm_i * turn + couple);
    b.torque_j.put(k, arm_j * turn - couple);
  }
}

template<bool EDGES>
__attribute__((always_inline)) inline void compute_batch(const bool rolling_friction,
                                                         const double time_step)
{
  const bool strengthening = batch.materials->friction_rise != 0.;
  if (rolling_friction && strengthening) compute_batch<true, true, EDGES>(time_step);
  else if (rolling_friction) compute_batch<true, false, EDGES>(time_step);
  else if (strengthening) compute_batch<false, true, EDGES>(time_step);
  else compute_batch<false, false, EDGES>(time_step);
}

/* Computes the forces and torques of the batch; with update, springs stretch for a step and the
   histories are written. */
BY_LANES void compute_batch(const bool rolling_friction, const bool edges, const bool update,
                            const double time_step)
{
  const double stretched = update ? time_step : 0.;
  if (edges) compute_batch<true>(rolling_friction, stretched);
  else compute_batch<false>(rolling_friction, stretched);
  if (!update) return;
  for (int k = 0; k < batch.count; k++) vec(batch.history[k] + SPRING) = batch.spring.get(k);
}

}
#endif
