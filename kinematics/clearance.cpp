// SPDX-License-Identifier: Apache-2.0
#include "kinematics/clearance.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include "kinematics/body_builder.h"

namespace tandem::kinematics {
namespace {

using Eigen::Vector3d;

/// Closest points of two segments p0 + x (p1 - p0), r0 + y (r1 - r0), x and y from 0 to 1 (Ericson, Real-Time Collision
/// Detection, 5.1.9).
void nearest(const Vector3d& p0, const Vector3d& p1, const Vector3d& r0, const Vector3d& r1, double& x, double& y) {
  constexpr double kPoint = 1e-24;  // m^2
  const Vector3d d = p1 - p0, e = r1 - r0, w = p0 - r0;
  const double dd = d.squaredNorm(), ee = e.squaredNorm(), de = d.dot(e), dw = d.dot(w), ew = e.dot(w);
  x = y = 0.0;
  if (dd <= kPoint) {
    y = ee > kPoint ? std::clamp(ew / ee, 0.0, 1.0) : 0.0;
    return;
  }
  if (ee > kPoint) {
    const double across = dd * ee - de * de;
    x = across > 1e-12 * dd * ee ? std::clamp((de * ew - dw * ee) / across, 0.0, 1.0) : 0.0;
    y = (de * x + ew) / ee;
    if (y >= 0.0 && y <= 1.0)
      return;
    y = std::clamp(y, 0.0, 1.0);
  }
  x = std::clamp((de * y - dw) / dd, 0.0, 1.0);
}

Vector3d placeOn(const Body& body, std::size_t piece, double x) {
  return (1.0 - x) * body.nodes[piece].position + x * body.nodes[piece + 1].position;
}

double lengthAt(const Body& body, std::size_t piece, double x) {
  return (1.0 - x) * body.nodes[piece].s + x * body.nodes[piece + 1].s;
}

/// Derivative by the joints of a point on a piece, along n.
Gradient along(const Body& body, std::size_t piece, double x, const Vector3d& n) {
  if (body.nodes[piece].jacobian.cols() == 0)
    return {};
  return n.transpose() * ((1.0 - x) * body.nodes[piece].jacobian + x * body.nodes[piece + 1].jacobian);
}

/// Bounding spheres of the pieces, to skip most pairs within clusters.
struct Ball {
  Vector3d centre;
  double radius;
};
using Balls = std::array<Ball, BodyBuilder::kMostNodes - 1>;
void encloseIn(const Body& body, Balls& balls) {
  for (std::size_t k = 0; k < body.radius.size(); ++k) {
    const Vector3d& p = body.nodes[k].position;
    const Vector3d& r = body.nodes[k + 1].position;
    balls[k] = {0.5 * (p + r), 0.5 * (r - p).norm() + body.radius[k]};
  }
}

/// Bounding spheres of clusters of pieces, to skip most pairs of clusters.
constexpr std::size_t kCluster = 8;  ///< pieces
struct Clusters {
  std::array<Ball, (BodyBuilder::kMostNodes - 1 + kCluster - 1) / kCluster> ball;
  std::size_t count = 0;
};
void enclose(const Balls& balls, std::size_t pieces, Clusters& clusters) {
  clusters.count = (pieces + kCluster - 1) / kCluster;
  for (std::size_t c = 0; c < clusters.count; ++c) {
    const std::size_t first = c * kCluster, end = std::min(first + kCluster, pieces);
    Ball& all = clusters.ball[c];
    all = {0.5 * (balls[first].centre + balls[end - 1].centre), 0.0};
    for (std::size_t k = first; k < end; ++k)
      all.radius = std::max(all.radius, (balls[k].centre - all.centre).norm() + balls[k].radius);
  }
}

/// Whether the contents of two spheres are farther from each other than `least`.
bool farther(const Ball& a, const Ball& b, double least) {
  const double bound = least + a.radius + b.radius;
  return (a.centre - b.centre).squaredNorm() >= bound * bound && bound > 0.0;
}

/** Closest pair of pieces of two bodies. */
class ClosestPair {
 public:
  ClosestPair(const Body& a, const Body& b) : a_(a), b_(b) {
    encloseIn(a, balls_a_);
    encloseIn(b, balls_b_);
    enclose(balls_a_, a.radius.size(), clusters_a_);
    enclose(balls_b_, b.radius.size(), clusters_b_);
  }

  /// The first of the closest pairs, in the order of the pieces of a, then of b.
  void find() {
    const double bound = bounded();
    for (std::size_t c = 0; c < clusters_a_.count; ++c) {
      const std::size_t end = std::min((c + 1) * kCluster, a_.radius.size());
      std::array<std::size_t, std::tuple_size_v<decltype(Clusters::ball)>> near;
      std::size_t count = 0;
      for (std::size_t d = 0; d < clusters_b_.count; ++d) {
        if (!farther(clusters_a_.ball[c], clusters_b_.ball[d], bound))
          near[count++] = d;
      }
      for (std::size_t piece = c * kCluster; piece < end; ++piece) {
        for (std::size_t m = 0; m < count; ++m)
          compare(piece, near[m]);
      }
    }
  }

  double least = std::numeric_limits<double>::infinity(), x = 0.0, y = 0.0;
  std::size_t i = 0, k = 0;

 private:
  /// A distance that the least one does not exceed: that of the pieces of two clusters that are close.
  double bounded() {
    double closest = least;
    std::size_t c_closest = 0, d_closest = 0;
    for (std::size_t c = 0; c < clusters_a_.count; ++c) {
      for (std::size_t d = 0; d < clusters_b_.count; ++d) {
        const Ball &p = clusters_a_.ball[c], &r = clusters_b_.ball[d];
        const double apart = (p.centre - r.centre).norm() - p.radius - r.radius;
        if (apart < closest) {
          closest = apart;
          c_closest = c, d_closest = d;
        }
      }
    }
    const std::size_t end = std::min((c_closest + 1) * kCluster, a_.radius.size());
    for (std::size_t piece = c_closest * kCluster; piece < end; ++piece)
      compare(piece, d_closest);
    constexpr double kRounding = 1e-12;  // m: the closest pair itself is not skipped
    const double bound = least + kRounding;
    least = std::numeric_limits<double>::infinity();
    return bound;
  }

  /// Piece `piece` of a with all pieces of a cluster of b.
  void compare(std::size_t piece, std::size_t cluster) {
    const std::size_t end = std::min((cluster + 1) * kCluster, b_.radius.size());
    for (std::size_t other = cluster * kCluster; other < end; ++other) {
      if (farther(balls_a_[piece], balls_b_[other], least))
        continue;
      double along_a, along_b;
      nearest(a_.nodes[piece].position, a_.nodes[piece + 1].position, b_.nodes[other].position,
              b_.nodes[other + 1].position, along_a, along_b);
      const double distance =
          (placeOn(a_, piece, along_a) - placeOn(b_, other, along_b)).norm() - a_.radius[piece] - b_.radius[other];
      if (distance < least) {
        least = distance, x = along_a, y = along_b;
        i = piece, k = other;
      }
    }
  }

  const Body& a_;
  const Body& b_;
  Balls balls_a_, balls_b_;
  Clusters clusters_a_, clusters_b_;
};

/// Signed distance of a point to the port, and its gradient.
double distanceTo(const Port& port, const Vector3d& place, Vector3d& gradient) {
  const Vector3d p = port.frame.inverse() * place;
  const double rho = std::hypot(p.x(), p.y()), inside = port.radius - rho, ahead = p.z() - port.depth;
  const Vector3d inwards = rho > 0.0 ? Vector3d(-p.x() / rho, -p.y() / rho, 0.0) : Vector3d::Zero();
  double distance;
  if (inside > 0.0 && ahead > 0.0) {
    distance = std::hypot(inside, ahead);
    gradient = (inside * inwards + ahead * Vector3d::UnitZ()) / distance;
  } else {
    distance = std::max(inside, ahead);
    gradient = inside > ahead ? inwards : Vector3d::UnitZ();
  }
  gradient = port.frame.linear() * gradient;
  return distance;
}

}  // namespace

ModelStatus makeBody(const ArmModel& model, const JointsRef& q, Branch& branch, bool derivatives, Body& body) {
  return BodyBuilder().make(model, q, branch, derivatives, body);
}

void BodyBuilder::reserve(Body& body) {
  body.nodes.reserve(kMostNodes);
  body.radius.reserve(kMostNodes - 1);
}

ModelStatus BodyBuilder::make(const ArmModel& model, const JointsRef& q, Branch& branch, bool derivatives, Body& body) {
  body.joints = model.jointCount();
  if (q.size() != body.joints)
    return ModelStatus::kWrongSize;
  BodySections sections;
  const int count = model.sections(q, sections);
  std::array<Gradient, kMostNodes> slope;  // of s by the joints
  slope[0].setZero(body.joints);
  s_.assign(1, 0.0);
  body.radius.clear();
  for (int i = 0; i < count; ++i) {
    const BodySection& section = sections[static_cast<std::size_t>(i)];
    const double start = s_.back();
    const Gradient start_slope = slope[s_.size() - 1];
    for (int k = 1; k <= Body::kPieces; ++k) {
      const double x = static_cast<double>(k) / Body::kPieces;
      slope[s_.size()] = (1.0 - x) * start_slope + x * section.by_joints;
      s_.push_back(k == Body::kPieces ? section.end : start + x * (section.end - start));
      body.radius.push_back(section.radius);
    }
  }
  if (const ModelStatus status = model.backbone(q, branch, s_, derivatives, body.nodes); status != ModelStatus::kOk)
    return status;
  for (std::size_t k = 0; k < body.nodes.size(); ++k) {
    if (derivatives)
      body.nodes[k].jacobian += body.nodes[k].tangent * slope[k];
    else
      body.nodes[k].jacobian.resize(3, 0);
  }
  return ModelStatus::kOk;
}

Clearance clearance(const Body& a, const Body& b) {
  ClosestPair pair(a, b);
  pair.find();
  Clearance result;
  result.distance = pair.least;
  result.place_a = placeOn(a, pair.i, pair.x);
  result.place_b = placeOn(b, pair.k, pair.y);
  result.s_a = lengthAt(a, pair.i, pair.x);
  result.s_b = lengthAt(b, pair.k, pair.y);
  Vector3d n = result.place_a - result.place_b;
  n = n.norm() > 0.0 ? n.normalized() : Vector3d::Zero();
  result.by_a = along(a, pair.i, pair.x, n);
  result.by_b = along(b, pair.k, pair.y, -n);
  return result;
}

Clearance clearance(const Body& a, const Port& port) {
  constexpr int kSections = 40;  // of the interval, each by the golden ratio: down to the rounding error
  constexpr double kGolden = 0.6180339887498949;
  Clearance result;
  result.distance = std::numeric_limits<double>::infinity();
  Vector3d gradient;
  const auto at = [&](std::size_t piece, double x) {
    return distanceTo(port, placeOn(a, piece, x), gradient) - a.radius[piece];
  };
  const auto take = [&](std::size_t piece, double x) {
    const double distance = at(piece, x);
    if (distance >= result.distance)
      return;
    result.distance = distance;
    result.place_a = placeOn(a, piece, x);
    result.s_a = lengthAt(a, piece, x);
    result.by_a = along(a, piece, x, gradient);
  };
  for (std::size_t piece = 0; piece < a.radius.size(); ++piece) {
    take(piece, 0.0);
    take(piece, 1.0);
    const double half = 0.5 * (a.nodes[piece + 1].position - a.nodes[piece].position).norm();
    if (at(piece, 0.5) - half >= result.distance)
      continue;  // the distance cannot fall by more than half the piece
    double low = 0.0, high = 1.0;
    for (int i = 0; i < kSections; ++i) {
      const double left = high - kGolden * (high - low), right = low + kGolden * (high - low);
      (at(piece, left) < at(piece, right) ? high : low) = at(piece, left) < at(piece, right) ? right : left;
    }
    take(piece, 0.5 * (low + high));
  }
  return result;
}

}  // namespace tandem::kinematics
