// SPDX-License-Identifier: GPL-2.0-or-later
// Copyright (c) 2026, the granular-walkers developers
/* The headers of LIGGGHTS that the contact model needs, in an order in which they compile. */
#ifndef BRIDGE_ENGINE_H
#define BRIDGE_ENGINE_H

#include "granular_pair_style.h"
#include "contact_models.h"
#include "fix_insert_stream.h"  // pair_gran_base.h uses it without including it
#include "pair_gran_base.h"
#include "fix_property_atom.h"
#include "modify.h"
#include "output.h"
#include "comm.h"
#include "universe.h"

using namespace LAMMPS_NS;
using namespace LIGGGHTS;
using namespace LIGGGHTS::ContactModels;

#endif
