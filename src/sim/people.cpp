// Somebody who crosses the drive.
#include <random>

#include "planar_vslam/sim/drive.h"
#include "planar_vslam/sim/obstacles.h"
#include "planar_vslam/sim/random.h"
#include "planar_vslam/sim/scene.h"
#include "planar_vslam/sim/variants.h"

namespace planar_vslam {
namespace {

constexpr double kBody = 0.25;                   // m, as Obstacles has it
constexpr double kElbow = 0.1;                   // m that people leave beside themselves
constexpr double kShortest = 1.5, kReach = 3.0;  // m of a way in all, and to either side of the drive
constexpr double kMiss = 0.15;                   // m from body to body when robot and person pass

// How far somebody gets from `from` along the unit `direction`.
double FreeWay(const Obstacles& obstacles, const Eigen::Vector2d& from, const Eigen::Vector2d& direction) {
  constexpr double kStep = 0.05;  // m
  double way = 0.0;
  while (way + kStep <= kReach && obstacles.Clearance(from + (way + kStep) * direction, 0.0) > 0.0) way += kStep;
  return way;
}

bool Meet(const PersonSpec& person, const Drive& drive, double robot_radius) {
  constexpr double kEvery = 0.1;  // s
  for (double time = 0.0; time <= drive.duration(); time += kEvery) {
    const Eigen::Vector2d at = WalkerAt(person, time).T_world_walker.translation;
    if ((at - drive.At(time).translation).norm() < robot_radius + kBody + kMiss) return true;
  }
  return false;
}

}  // namespace

bool AddPerson(World* world, std::uint64_t seed) {
  constexpr int kTries = 1000;
  const Expected<Drive> drive = PlanDrive(*world);
  if (!drive) return false;
  const Obstacles obstacles(*world, kBody + kElbow);
  std::mt19937_64 generator(MixSeed(seed, RandomStream::kPeople));
  std::uniform_real_distribution<double> share(0.0, 1.0);
  for (int attempt = 0; attempt < kTries; ++attempt) {
    const Rigid2 T_world_crossing = drive->At(share(generator) * drive->duration());
    const double slant = (share(generator) - 0.5) * M_PI_2;  // rad, off square to the drive
    const double pace = 0.5 + 0.5 * share(generator);        // m/s
    const double start = 2.0 * kReach * share(generator);
    const Eigen::Vector2d& middle = T_world_crossing.translation;
    const double heading = T_world_crossing.angle + M_PI_2 + slant;
    const Eigen::Vector2d direction(std::cos(heading), std::sin(heading));
    const double left = FreeWay(obstacles, middle, direction), right = FreeWay(obstacles, middle, -direction);
    if (left + right < kShortest) continue;
    PersonSpec person;
    person.path = {middle - right * direction, middle + left * direction};
    person.speed = pace;
    person.start = start;
    if (Meet(person, *drive, world->drive.robot_radius)) continue;
    world->people.push_back(person);
    return true;
  }
  return false;
}

}  // namespace planar_vslam
