// SPDX-License-Identifier: GPL-2.0-or-later
// Copyright (c) 2026, the granular-walkers developers
/* A contact model for LIGGGHTS: liquid bridges whose forces are tables. LD_PRELOAD loads it into
   Debian's liggghts. README.md lists the source files and describes the commands. This file adds
   the styles to those of the engine.

   All files are compiled as one unit, in an unnamed namespace: the library exports no symbols, and
   the compiler can inline the loops.

   The next line is part of the names of runs and audits. Its number must change whenever the same
   deck gives other numbers. */
// FORCES_VERSION 8
#include "pairs.h"
#include "wall_fix.h"

namespace {

/* The engine's table of fixes is a private member without any function that adds to it. An explicit
   instantiation of a template may name private members: this one makes a pointer to the table. */
typedef std::map<std::string, Fix *(*)(LAMMPS *, int, char **)> FixTable;
struct FixTableAccess {
  typedef FixTable *Modify::*Member;
  friend Member fix_table(FixTableAccess);
};
template<FixTableAccess::Member MEMBER> struct FixTableMember {
  friend FixTableAccess::Member fix_table(FixTableAccess) { return MEMBER; }
};
template struct FixTableMember<&Modify::fix_map>;

Fix *make_walls(LAMMPS *lmp, int count, char **words)
{
  return new FixWallBridge(lmp, count, words);
}

template<bool ROLLING_FRICTION>
PairStyles::IGranularPairStyle *make_pairs(LAMMPS *lmp, PairGran *parent, int64_t hash)
{
  (*(lmp->modify->*fix_table(FixTableAccess())))["wall/bridge"] = &make_walls;
  return new PairBridge(lmp, parent, hash, ROLLING_FRICTION);
}

template<bool ROLLING_FRICTION> void add_pair_style()
{
  const int rolling = ROLLING_FRICTION ? ROLLING_CDT : ROLLING_OFF;
  const int64_t hash =
    Utils::generate_gran_hashcode(HERTZ, TANGENTIAL_HISTORY, BRIDGE_ID, rolling, SURFACE_DEFAULT);
  PairStyles::Factory::instance().addStyle("gran", hash, &make_pairs<ROLLING_FRICTION>);
}

/* Runs when the library is loaded. */
struct Registration {
  Registration()
  {
    // By lines: an engine that aborts loses the buffer of an output that is a file.
    setvbuf(stdout, 0, _IOLBF, 1 << 16);
    Factory::instance().addCohesionModel("bridge", BRIDGE_ID);
    add_pair_style<false>();
    add_pair_style<true>();
  }
} registration;

}
