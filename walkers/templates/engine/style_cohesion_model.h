// SPDX-License-Identifier: GPL-2.0-or-later
#include "cohesion_model_easo_capillary_viscous.h"
