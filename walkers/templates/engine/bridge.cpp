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

using namespace LAMMPS_NS;
using namespace LIGGGHTS;
using namespace LIGGGHTS::ContactModels;

#include "pairs.h"
#include "walls.h"

namespace {

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
