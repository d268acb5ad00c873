// SPDX-License-Identifier: Apache-2.0
/** @file Batch forward kinematics in C++: baseline for bench/batch.py, which measures the Python module.
 *
 *     bench_batch FILE MODEL THREADS REPETITIONS    rows of six doubles of arm a of ark2024; prints the best time, s,
 * and the sum of all results */
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <iomanip>
#include <iostream>
#include <iterator>
#include <limits>
#include <numeric>
#include <thread>
#include <vector>

#include "bench/percentiles.h"
#include "config/config.h"
#include "kinematics/tube_model.h"

namespace {

using namespace tandem;

constexpr std::size_t kJoints = 6, kNumbers = 16;

void answer(const kinematics::ArmModel& model,
            const std::vector<double>& joints,
            std::size_t begin,
            std::size_t end,
            double* out) {
  kinematics::Tip tip;
  for (std::size_t row = begin; row < end; ++row) {
    const Eigen::Map<const Eigen::VectorXd> q(joints.data() + kJoints * row, kJoints);
    if (model.tip(q, tip) != kinematics::ModelStatus::kOk)
      throw std::runtime_error("the model has no solution at the joints of row " + std::to_string(row));
    Eigen::Map<Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(out + kNumbers * row) = tip.pose.matrix();
  }
}

double once(const kinematics::ArmModel& model, const std::vector<double>& joints, std::size_t threads, double& sum) {
  const std::size_t rows = joints.size() / kJoints;
  const auto begin = std::chrono::steady_clock::now();
  const double before = bench::processorTime();
  std::vector<double> out(kNumbers * rows);
  {
    std::vector<std::jthread> workers;
    for (std::size_t t = 0; t + 1 < threads; ++t)
      workers.emplace_back([&, t] { answer(model, joints, rows * t / threads, rows * (t + 1) / threads, out.data()); });
    answer(model, joints, rows * (threads - 1) / threads, rows, out.data());
  }
  double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  if (threads == 1)
    seconds = std::min(seconds, bench::processorTime() - before);
  sum = std::accumulate(out.begin(), out.end(), 0.0);
  return seconds;
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc != 5)
    throw std::runtime_error("usage: bench_batch FILE MODEL THREADS REPETITIONS");
  std::ifstream file(argv[1], std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(file), {}};
  std::vector<double> joints(bytes.size() / sizeof(double));
  std::copy_n(bytes.data(), joints.size() * sizeof(double), reinterpret_cast<char*>(joints.data()));
  const config::Robot robot = config::loadRobot(config::findFile("ark2024", "robot"));
  const auto model = kinematics::makeArmModel(argv[2], robot.arms[0].model);
  double best = std::numeric_limits<double>::infinity(), sum = 0.0;
  for (int k = 0; k < std::atoi(argv[4]); ++k)
    best = std::min(best, once(*model, joints, static_cast<std::size_t>(std::atoi(argv[3])), sum));
  std::cout << std::setprecision(17) << best << ' ' << sum << '\n';
  return 0;
} catch (const std::exception& error) {
  std::cerr << error.what() << '\n';
  return 1;
}
