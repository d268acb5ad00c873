// SPDX-License-Identifier: Apache-2.0
#include "kinematics/detail/taylor_step_impl.h"

namespace tandem::kinematics {

template class TaylorStep<1, double>;
template class TaylorStep<2, double>;
template class TaylorStep<3, double>;
template class TaylorStep<4, double>;

}  // namespace tandem::kinematics
