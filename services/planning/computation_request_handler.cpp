// SPDX-License-Identifier: Apache-2.0
#include "services/planning/computation_request_handler.h"

#include <sched.h>
#include <spdlog/spdlog.h>
#include <sys/resource.h>
#include <unistd.h>

#include "config/robot_files.h"
#include "operation/convert.h"
#include "planning/joint_sampler.h"
#include "robots/capability.h"
#include "services/dds/reply.h"
#include "services/runtime/periodic_loop.h"

namespace tandem::planning_service {
namespace {

using dds::CancelledBy;
using dds::ComputationKind;

double secondsSince(std::int64_t then) { return 1e-9 * static_cast<double>(runtime::monotonicNow() - then); }

std::optional<Plan> planOf(const dds::ComputationRequest& request, const dds::ComputationResult& result) {
  if (static_cast<ComputationKind>(result.kind) != ComputationKind::kCheck ||
      result.outcome != static_cast<std::uint8_t>(dds::Outcome::kGood))
    return std::nullopt;
  const auto vector_of = [](const std::vector<double>& q) {
    return safety::RobotVector(Eigen::VectorXd::Map(q.data(), static_cast<Eigen::Index>(q.size())));
  };
  Plan plan{request.trajectory, vector_of(result.start), {}};
  for (const dds::PointReport& point : result.report.points)
    plan.points.push_back(vector_of(point.joints));
  return plan;
}

}  // namespace

ComputationRequestHandler::ComputationRequestHandler(const runtime::Setup& setup,
                                                     std::function<void(const Outgoing&)> send)
    : setup_(setup), robot_(config::withoutReadingErrors(setup.robot), setup.deployment.model), send_(std::move(send)) {
  sender_ = std::thread([this] { this->send(); });
  computer_ = std::thread([this] { compute(); });
}

ComputationRequestHandler::~ComputationRequestHandler() {
  {
    const std::lock_guard lock(mutex_);
    end_ = true;
    if (job_)
      job_->cancelled = CancelledBy::kEnd;
  }
  arrived_.notify_all();
  computer_.join();
  outgoing_.put(std::nullopt);
  sender_.join();
}

void ComputationRequestHandler::answer(const dds::ComputationRequest& request,
                                       dds::ReplyCode code,
                                       const std::string& reason) {
  dds::Reply reply = dds::replyTo(request, code, reason.substr(0, 2000));
  if (reply.accepted == 0)
    spdlog::warn("computation refused: {}", reply.reason);
  outgoing_.put(Outgoing(std::move(reply)));
}

void ComputationRequestHandler::onRequest(const dds::ComputationRequest& request) {
  const auto kind = static_cast<ComputationKind>(request.kind);
  std::unique_lock lock(mutex_);
  if (kind == ComputationKind::kCancel || kind == ComputationKind::kKeepAlive) {
    const bool ours = job_ && job_->request.client == request.client && job_->request.request == request.computation;
    if (ours && kind == ComputationKind::kKeepAlive)
      job_->received = runtime::monotonicNow();
    auto nobody = CancelledBy::kNobody;
    if (ours && kind == ComputationKind::kCancel)
      job_->cancelled.compare_exchange_strong(nobody, CancelledBy::kClient);
    lock.unlock();
    if (kind == ComputationKind::kCancel)
      answer(request, ours ? dds::ReplyCode::kOk : dds::ReplyCode::kUnknown,
             ours ? ""
                  : "computation: found " + std::to_string(request.computation) +
                        ", expected a running computation of this client; it may have ended");
    return;
  }
  if (const std::string why = refusal(setup_.robot, robots::Capability::kComputation); !why.empty()) {
    lock.unlock();
    answer(request, dds::ReplyCode::kFailed, why);
    return;
  }
  if (job_) {
    lock.unlock();
    answer(request, dds::ReplyCode::kBusy,
           "planning is busy with another computation; send the request again when that has ended");
    return;
  }
  job_ = std::make_shared<Job>();
  job_->request = request;
  job_->begin = job_->received = runtime::monotonicNow();
  taken_ = false;
  lock.unlock();
  arrived_.notify_all();
}

std::optional<safety::RobotVector> ComputationRequestHandler::presentJoints() {
  constexpr double kNoise = 1e-3;  // m or rad, encoder noise by which measured joints may exceed their limits
  states_.take(state_);
  if (state_.sequence == 0 || state_.arm_count != robot_.armCount())
    return std::nullopt;
  safety::RobotVector q(robot_.jointCount());
  for (int k = 0; k < robot_.armCount(); ++k) {
    if (state_.valid[static_cast<std::size_t>(k)] == 0)
      return std::nullopt;
    safety::ArmVector own = dds::jointsOf(state_.position, k, robot_.size(k));
    const safety::ArmLimits& limits = *robot_.limits()[static_cast<std::size_t>(k)];
    const double outside = safety::largestViolation(limits, own);
    if (outside > 0.0 && outside < kNoise)
      own = planning::JointSampler(limits).inside(own);
    q.segment(robot_.offset(k), robot_.size(k)) = own;
  }
  return q;
}

dds::ComputationResult ComputationRequestHandler::run(const computation::Computation& computation, Job& job) {
  const dds::ComputationRequest& request = computation.request();
  dds::ComputationProgress progress;
  progress.client = request.client;
  progress.request = request.request;
  progress.kind = request.kind;
  std::int64_t reported = 0;
  const auto publish = [&](bool at_once) {
    if (!at_once && secondsSince(reported) < kProgress)
      return;
    reported = runtime::monotonicNow();
    progress.elapsed = secondsSince(job.begin);
    outgoing_.put(Outgoing(progress));
  };
  computation::ComputationHooks hooks;
  hooks.cancelled = [&] {
    auto nobody = CancelledBy::kNobody;
    if (secondsSince(job.received) > kSilence)
      job.cancelled.compare_exchange_strong(nobody, CancelledBy::kSilence);
    else if (secondsSince(job.begin) > computation.timeLimit())
      job.cancelled.compare_exchange_strong(nobody, CancelledBy::kTimeLimit);
    publish(false);
    return job.cancelled != CancelledBy::kNobody;
  };
  hooks.progress = [&](double fraction, const std::string& at, int done, int all) {
    progress.fraction = fraction;
    progress.at = at;
    progress.done = static_cast<std::uint32_t>(done);
    progress.all = static_cast<std::uint32_t>(all);
    publish(done == all);
  };
  publish(true);
  dds::ComputationResult result = computation.run(hooks);
  if (result.outcome == static_cast<std::uint8_t>(dds::Outcome::kCancelled)) {
    result.cancelled_by = static_cast<std::uint8_t>(job.cancelled.load());
    result.reason = dds::name(job.cancelled.load());
  }
  result.elapsed = secondsSince(job.begin);
  return result;
}

void ComputationRequestHandler::compute() {
  // Applies to this thread only, since the kernel schedules threads. References and other programs have priority over
  // computations.
  const sched_param none{};
  if (sched_setscheduler(0, SCHED_BATCH, &none) != 0 ||
      setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), kNice) != 0)
    spdlog::warn("cannot lower the priority of computations: they run at the priority of the process");
  while (true) {
    std::shared_ptr<Job> job;
    {
      std::unique_lock lock(mutex_);
      arrived_.wait(lock, [this] { return end_ || (job_ && !taken_); });
      if (end_)
        return;
      job = job_;
      taken_ = true;
    }
    std::optional<dds::ComputationResult> result;
    std::optional<computation::Refusal> refusal;
    try {
      if (const auto& port = setup_.deployment.port; port && job->request.port_radius == 0.0) {
        job->request.port_radius = port->radius;
        job->request.port_depth = port->depth;
      }
      const config::Deployment& deployment = setup_.deployment;
      const computation::Computation computation(
          job->request,
          {setup_.robot, robot_, deployment.model == "rigid",
           planning::Gains{deployment.relative_gain, deployment.tip_gain}, deployment.control_period},
          presentJoints());
      answer(job->request, dds::ReplyCode::kOk, "");
      result = run(computation, *job);
    } catch (const computation::Refusal& why) {
      refusal = why;
    } catch (const std::exception& error) {
      refusal = computation::Refusal(dds::ReplyCode::kFailed, error.what());
    }
    {
      // Free the job before the result is sent: its receiver may request the next computation at once.
      const std::lock_guard lock(mutex_);
      job_.reset();
    }
    if (refusal)
      answer(job->request, refusal->code(), refusal->what());
    if (std::optional<Plan> plan = result ? planOf(job->request, *result) : std::nullopt)
      outgoing_.put(Outgoing(std::move(*plan)));
    if (result)
      outgoing_.put(Outgoing(std::move(*result)));
  }
}

void ComputationRequestHandler::send() {
  while (true) {
    const auto message = outgoing_.take(1.0);
    if (!message)
      continue;
    if (!*message)
      return;
    send_(**message);
  }
}

}  // namespace tandem::planning_service
