#include "cohesion_model_easo_capillary_viscous.h"
