#pragma once
// A small plane to drive in: a grid of walls, a round robot that obeys velocities, a laser, and people who walk to and
// fro and wait for nobody.
#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "planar_vslam/navigate/navigator.h"

namespace planar_vslam::test {

// Free, with a wall all round.
inline OccupancyGrid2d Room(double length, double width) {
  OccupancyGrid2d grid;
  grid.width = static_cast<int>(std::lround(length / grid.resolution));
  grid.height = static_cast<int>(std::lround(width / grid.resolution));
  grid.cells.assign(static_cast<std::size_t>(grid.width) * static_cast<std::size_t>(grid.height), 0);
  for (int y = 0; y < grid.height; ++y) {
    for (int x = 0; x < grid.width; ++x) {
      const bool edge = x == 0 || y == 0 || x + 1 == grid.width || y + 1 == grid.height;
      if (edge) grid.cells[static_cast<std::size_t>(y * grid.width + x)] = 100;
    }
  }
  return grid;
}

inline void Fill(OccupancyGrid2d* grid, double x0, double y0, double x1, double y1, std::int8_t value = 100) {
  for (int y = 0; y < grid->height; ++y) {
    for (int x = 0; x < grid->width; ++x) {
      const double cx = (x + 0.5) * grid->resolution, cy = (y + 0.5) * grid->resolution;
      if (cx > x0 && cx < x1 && cy > y0 && cy < y1) grid->cells[static_cast<std::size_t>(y * grid->width + x)] = value;
    }
  }
}

// Somebody on two legs, straight from one place to the other and back.
struct Walker {
  static constexpr double kRadius = 0.25, kLegRadius = 0.07;  // m
  Eigen::Vector2d from, to;                                   // m
  double speed = 0.8;                                         // m/s
  double start = 0.0;                                         // m walked at time 0

  Eigen::Vector2d At(double time) const {
    const double length = (to - from).norm(), walked = std::fmod(start + speed * time, 2.0 * length);
    return from + (to - from) * ((walked < length ? walked : 2.0 * length - walked) / length);
  }
  Eigen::Vector2d Leg(double time, double side) const {
    const Eigen::Vector2d ahead = (to - from).normalized(), left(-ahead.y(), ahead.x());
    const double stride = 0.45 * std::sin(M_PI * (start + speed * time) / 0.7);
    return At(time) + side * (0.5 * stride * ahead + 0.1 * left);
  }
};

class Plane {
 public:
  static constexpr double kPeriod = 0.1;  // s

  // The robot knows `map`, and stands in `truth`.
  Plane(const NavigateOptions& options, const OccupancyGrid2d& map, OccupancyGrid2d truth, const Rigid2& start)
      : navigator(options), radius_(options.robot_radius), truth_(std::move(truth)), T_map_base(start) {
    navigator.costmap().SetMap(map);
  }

  // Steps until the goal is done or `seconds` are over.
  NavigatorOutput DriveTo(const Rigid2& goal, double seconds) {
    navigator.SetGoal(goal);
    NavigatorOutput output;
    for (double end = time + seconds; time < end;) {
      output = Step();
      if (output.state != GoalState::kDriving) break;
    }
    return output;
  }

  NavigatorOutput Step() {
    if (laser_works) navigator.AddSweep(time, Sweep(), Rigid2(), T_map_base, pose_error * T_map_base);
    NavigatorInput input;
    input.time = time;
    input.T_odom_base = T_map_base;
    input.T_map_base = pose_error * T_map_base;
    input.transform_age = transform_age;
    input.quality = quality;
    input.new_quality = true;
    input.source = source;
    const NavigatorOutput output = navigator.Step(input);
    Move(output.velocity);
    time += kPeriod;
    return output;
  }

  // From the body to the nearest wall's cell, m; the least of all so far in `least_clearance`.
  double Clearance() const {
    double nearest = 1e9;
    for (int i = 0; i < truth_.width * truth_.height; ++i) {
      if (truth_.cells[static_cast<std::size_t>(i)] != 100) continue;
      const Eigen::Vector2d corner = truth_.resolution * Eigen::Vector2d(i % truth_.width, i / truth_.width);
      const Eigen::Vector2d inside =
          T_map_base.translation.cwiseMax(corner).cwiseMin(corner + Eigen::Vector2d::Constant(truth_.resolution));
      nearest = std::min(nearest, (inside - T_map_base.translation).norm());
    }
    return nearest - radius_;
  }

  Navigator navigator;

 private:
  double radius_;
  OccupancyGrid2d truth_;

 public:
  Rigid2 T_map_base;
  double time = 0.0;             // s
  double least_clearance = 1e9;  // m
  std::vector<Walker> people;
  double least_gap = 1e9;  // m, from the body to somebody's
  Rigid2 pose_error;       // of localisation: on the left of the true pose
  bool laser_works = true, wheels_work = true;
  double transform_age = 0.0;  // s
  std::optional<PoseQuality> quality;
  PoseSource source = PoseSource::kUnsaid;

 private:
  bool Occupied(const Eigen::Vector2d& p) const {
    const Eigen::Vector2d at = p / truth_.resolution;
    const int x = static_cast<int>(std::floor(at.x())), y = static_cast<int>(std::floor(at.y()));
    return x < 0 || y < 0 || x >= truth_.width || y >= truth_.height || truth_.At(x, y) == 100;
  }

  PlanarScan Sweep() const {
    PlanarScan scan;
    constexpr int kBeams = 240;
    scan.angle_min = -0.75 * M_PI;
    scan.angle_increment = 1.5 * M_PI / (kBeams - 1);
    scan.range_min = 0.05;
    scan.range_max = 8.0;
    for (int i = 0; i < kBeams; ++i) {
      const double angle = T_map_base.angle + scan.angle_min + i * scan.angle_increment;
      const Eigen::Vector2d direction(std::cos(angle), std::sin(angle));
      double range = 0.0;
      while (range < scan.range_max && !Occupied(T_map_base.translation + range * direction)) range += 0.01;
      for (const Walker& walker : people) {
        for (const double side : {1.0, -1.0}) range = std::min(range, RangeToLeg(walker.Leg(time, side), direction));
      }
      scan.ranges.push_back(static_cast<float>(range));
    }
    return scan;
  }

  // Infinity where the beam passes it.
  double RangeToLeg(const Eigen::Vector2d& leg, const Eigen::Vector2d& direction) const {
    const Eigen::Vector2d to = leg - T_map_base.translation;
    const double along = to.dot(direction), beside = to.squaredNorm() - along * along;
    if (along <= 0.0 || beside > Walker::kLegRadius * Walker::kLegRadius) return HUGE_VAL;
    return along - std::sqrt(Walker::kLegRadius * Walker::kLegRadius - beside);
  }

  void Move(const PlaneVelocity& command) {
    constexpr double kSubstep = 0.02, kAcceleration = 0.5, kTurnAcceleration = 2.0;
    for (double s = 0.0; s < kPeriod - 1e-9 && wheels_work; s += kSubstep) {
      const auto toward = [](double from, double to, double most) { return std::clamp(to, from - most, from + most); };
      velocity_.x = toward(velocity_.x, command.x, kAcceleration * kSubstep);
      velocity_.y = toward(velocity_.y, command.y, kAcceleration * kSubstep);
      velocity_.yaw = toward(velocity_.yaw, command.yaw, kTurnAcceleration * kSubstep);
      T_map_base = T_map_base * ExpSe2(kSubstep * Eigen::Vector3d(velocity_.x, velocity_.y, velocity_.yaw));
    }
    least_clearance = std::min(least_clearance, Clearance());
    for (const Walker& walker : people) {
      const double distance = (walker.At(time + kPeriod) - T_map_base.translation).norm();
      least_gap = std::min(least_gap, distance - radius_ - Walker::kRadius);
    }
  }

  PlaneVelocity velocity_;
};

}  // namespace planar_vslam::test
