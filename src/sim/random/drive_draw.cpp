// The base and its way.
#include "planar_vslam/geometry/angles.h"
#include "robot_draw.h"
#include "route.h"

namespace planar_vslam::sim {
namespace {

constexpr double kShortest = 45.0, kLongest = 200.0;  // m of the way; a drive cuts corners
constexpr double kMostSeconds = 480.0;                // of a drive, unless the shortest takes longer
constexpr double kMeanShare = 0.6;                    // of its speed a robot drives on average, with its turns
constexpr double kMargin = 0.1;                       // m, kept clear beside the robot
constexpr double kSlowest = 0.1;                      // m/s

void DrawBase(double fastest, DriveSpec* drive, Draws& draws) {
  drive->base = draws.Chance(0.5) ? BaseKind::kOmnidirectional : BaseKind::kDifferential;
  drive->robot_radius = draws.Uniform(0.18, 0.3);
  drive->speed = draws.LogUniform(kSlowest, fastest);
  drive->acceleration = std::max(draws.Uniform(0.25, 0.8), 0.8 * drive->speed);
  drive->sideways_speed = draws.Uniform(0.1, 0.3);
  drive->turn_rate = DegreesToRadians(draws.Uniform(25.0, 80.0));
  drive->turn_acceleration = drive->turn_rate * draws.Uniform(1.5, 4.0);
}

RouteWish DrawWish(const DriveSpec& drive, Draws& draws) {
  RouteWish wish;
  wish.style = draws.Weighted<RouteStyle>({{0.35, RouteStyle::kRounds},
                                           {0.3, RouteStyle::kWander},
                                           {0.15, RouteStyle::kBackAgain},
                                           {0.2, RouteStyle::kOneWay}});
  wish.length = draws.LogUniform(kShortest, kLongest);
  wish.clearance = drive.robot_radius + kMargin;
  return wish;
}

// Sideways at the start, where there is room.
double DrawShuffle(const DriveSpec& drive, const FreeSpace& space, Draws& draws) {
  const double shuffle = draws.Sign() * draws.Uniform(0.2, 0.6);
  const bool wanted = draws.Chance(0.6) && drive.base == BaseKind::kOmnidirectional;
  const Eigen::Vector2d beside = drive.start * Eigen::Vector2d(0.0, shuffle);
  return wanted && space.Clearance(drive.start.translation, beside) >= drive.robot_radius + kMargin ? shuffle : 0.0;
}

}  // namespace

std::optional<Drive> DrawDrive(World* world, double fastest, const Budget& budget, Draws& draws) {
  DriveSpec& drive = world->drive;
  drive = DriveSpec();
  DrawBase(fastest, &drive, draws);
  const RouteWish wish = DrawWish(drive, draws);
  const FreeSpace space(*world);
  const std::optional<std::vector<Eigen::Vector2d>> line = DrawRoute(space, wish, draws);
  if (!line.has_value() || line->size() < 2) return std::nullopt;
  const Eigen::Vector2d ahead = (*line)[1] - (*line)[0];
  drive.start = Rigid2((*line)[0], std::atan2(ahead.y(), ahead.x()) + draws.Uniform(-0.3, 0.3));
  drive.shuffle = DrawShuffle(drive, space, draws);
  const double seconds = std::min(kMostSeconds, budget.keeps_rate ? budget.images / world->camera.rate : kMostSeconds);
  // Fast robots swing out in narrow places: slower, then.
  while (true) {
    const std::vector<Eigen::Vector2d> way = CutTo(*line, std::max(kShortest, kMeanShare * drive.speed * seconds));
    drive.waypoints.assign(way.begin() + 1, way.end());
    const Expected<Drive> planned = PlanDrive(*world);
    if (planned) return *planned;
    if (drive.shuffle != 0.0) {
      drive.shuffle = 0.0;
    } else if (drive.speed == kSlowest) {
      return std::nullopt;
    } else {
      drive.speed = std::max(kSlowest, 0.8 * drive.speed);
    }
  }
}

}  // namespace planar_vslam::sim
