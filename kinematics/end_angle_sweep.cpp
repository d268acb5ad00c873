// SPDX-License-Identifier: Apache-2.0
#include "kinematics/detail/end_angle_sweep_impl.h"

namespace tandem::kinematics {

template class EndAngleSweep<double>;

}  // namespace tandem::kinematics
