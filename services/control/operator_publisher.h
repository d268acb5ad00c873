// SPDX-License-Identifier: Apache-2.0
/** @file Publication of teleop/status and crtk/status, in a publisher thread. */
#pragma once

#include "operation/operator_desk.h"
#include "services/control/crtk_desk.h"
#include "services/dds/bus.h"

namespace tandem::service {

class OperatorPublisher {
 public:
  OperatorPublisher(dds::Bus& bus, const Setup& setup, const CrtkDesk& desk);
  void publish(const dds::ControlStatus& status,
               const operation::OperatorMoment& operators,
               const operation::CrtkMoment& crtk);

 private:
  dds::TeleopStatus statusOf(const dds::ControlStatus& status, const operation::OperatorMoment& moment) const;
  std::string limiterOf(const operation::OperatorMoment::Stage& stage) const;
  std::string jointLimits(const dds::ControlStatus& status) const;

  const Setup& setup_;
  const CrtkDesk& desk_;
  std::uint64_t sequence_ = 0;
  dds::Writer<dds::TeleopStatus> operators_;
  dds::Writer<dds::CrtkStatus> crtk_;
};

}  // namespace tandem::service
