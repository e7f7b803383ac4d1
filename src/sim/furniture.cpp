// Chairs and boxes that somebody moved.
#include <algorithm>
#include <cmath>
#include <random>

#include "planar_vslam/sim/drive.h"
#include "planar_vslam/sim/random.h"
#include "planar_vslam/sim/solids.h"
#include "planar_vslam/sim/variants.h"

namespace planar_vslam {
namespace {

constexpr double kClear = 0.05;  // m, more than the robot's radius

bool Movable(const ObjectSpec& object) {
  return object.kind == ObjectKind::kChair || object.kind == ObjectKind::kSwivelChair ||
         object.kind == ObjectKind::kBox;
}

bool ShareHeight(const Prism& a, const Prism& b) { return a.bottom < b.top && b.bottom < a.top; }

// Whether the outlines of two convex footprints come close: corners of one in or near the other.
bool Close(const Prism& a, const Prism& b) {
  constexpr double kGap = 0.01;  // m
  const auto near = [](const Prism& points, const Prism& polygon) {
    return std::any_of(points.footprint.begin(), points.footprint.end(),
                       [&](const Eigen::Vector2d& p) { return Distance(p, polygon.footprint) < kGap; });
  };
  return ShareHeight(a, b) && (near(a, b) || near(b, a));
}

// Places of the robot on both drives, a few centimetres apart.
std::vector<Eigen::Vector2d> PlacesDriven(const World& world) {
  std::vector<Eigen::Vector2d> places;
  std::vector<DriveSpec> drives = {world.drive};
  if (world.repeat_drive.has_value()) drives.push_back(*world.repeat_drive);
  for (const DriveSpec& drive : drives) {
    World other = world;
    other.drive = drive;
    const Expected<Drive> planned = PlanDrive(other);
    if (!planned) continue;
    constexpr double kEvery = 0.1;  // s
    for (double t = 0.0; t < planned->duration(); t += kEvery) places.push_back(planned->At(t).translation);
  }
  return places;
}

class Mover {
 public:
  explicit Mover(const World& world) : room_(world.room.size.head<2>()), places_(PlacesDriven(world)) {
    radius_ = world.drive.robot_radius;
    if (world.repeat_drive.has_value()) radius_ = std::max(radius_, world.repeat_drive->robot_radius);
  }

  // Whether the object, one of `objects`, fits where it is.
  bool Fits(const ObjectSpec& moved, std::size_t index, const std::vector<ObjectSpec>& objects) const {
    const std::vector<Prism> own = MakeSolids({moved});
    for (const Prism& part : own) {
      for (const Eigen::Vector2d& p : part.footprint) {
        if (std::min(p.minCoeff(), (room_ - p).minCoeff()) < 0.01) return false;
      }
      const auto touched = [&](const Eigen::Vector2d& place) {
        return Distance(place, part.footprint) < radius_ + kClear;
      };
      const bool in_the_way = part.MeetsBand(kBodyLow, kBodyHigh);
      if (in_the_way && std::any_of(places_.begin(), places_.end(), touched)) return false;
    }
    std::vector<ObjectSpec> others = objects;
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(index));
    for (const Prism& other : MakeSolids(others)) {
      if (std::any_of(own.begin(), own.end(), [&](const Prism& part) { return Close(part, other); })) return false;
    }
    return true;
  }

 private:
  Eigen::Vector2d room_;
  std::vector<Eigen::Vector2d> places_;
  double radius_;
};

}  // namespace

int MoveFurniture(World* world, std::uint64_t seed) {
  constexpr int kTries = 12;
  constexpr double kFar = 0.6, kOnTop = 0.12, kTurn = 0.8;  // m on the floor, m on a table, rad
  std::mt19937_64 generator(MixSeed(seed, RandomStream::kFurniture));
  std::uniform_real_distribution<double> share(-1.0, 1.0);
  const Mover mover(*world);
  int moved = 0;
  for (std::size_t i = 0; i < world->objects.size(); ++i) {
    if (!Movable(world->objects[i])) continue;
    const double reach = world->objects[i].bottom > 0.0 ? kOnTop : kFar;
    for (int attempt = 0; attempt < kTries; ++attempt) {
      ObjectSpec object = world->objects[i];
      object.at += reach * Eigen::Vector2d(share(generator), share(generator));
      object.yaw += kTurn * share(generator);
      if (!mover.Fits(object, i, world->objects)) continue;
      world->objects[i] = object;
      ++moved;
      break;
    }
  }
  return moved;
}

}  // namespace planar_vslam
