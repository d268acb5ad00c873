// SPDX-License-Identifier: Apache-2.0
/** @file Publication of teleop/status and crtk/status, in a publisher thread. */
#pragma once

#include "operation/operator_input_handler.h"
#include "services/control/crtk_command_handler.h"
#include "services/dds/bus.h"

namespace tandem::control_service {

class OperatorPublisher {
 public:
  OperatorPublisher(dds::Bus& bus, const runtime::Setup& setup, const CrtkCommandHandler& handler);
  void publish(const dds::ControlStatus& status,
               const operation::OperatorSnapshot& operators,
               const operation::CrtkSnapshot& crtk);

 private:
  dds::TeleopStatus statusOf(const dds::ControlStatus& status, const operation::OperatorSnapshot& snapshot) const;
  std::string limiterOf(const operation::OperatorSnapshot::Stage& stage) const;
  std::string rotationLimiterOf(const operation::OperatorSnapshot::Stage& stage) const;
  std::string jointLimits(const dds::ControlStatus& status) const;

  const runtime::Setup& setup_;
  const CrtkCommandHandler& handler_;
  std::uint64_t sequence_ = 0;
  dds::Writer<dds::TeleopStatus> operators_;
  dds::Writer<dds::CrtkStatus> crtk_;
};

}  // namespace tandem::control_service
