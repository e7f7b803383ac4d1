// Camera, laser, wheels and slips.
#include "robot_draw.h"

#include "planar_vslam/geometry/angles.h"

namespace planar_vslam::sim {
namespace {

constexpr double kMostImages = 2400.0;
constexpr double kMostMegapixels = 700.0;  // of all images
constexpr double kLeastRate = 5.0;         // Hz

struct ImageSize {
  int width, height;
};

CameraModel DrawModel(Draws& draws) {
  const auto size = draws.Weighted<ImageSize>(
      {{0.25, {320, 240}}, {0.1, {424, 240}}, {0.4, {640, 480}}, {0.1, {848, 480}}, {0.15, {1280, 720}}});
  const double view = DegreesToRadians(draws.Uniform(45.0, 85.0));  // horizontal
  const double focal = std::clamp(0.5 * size.width / std::tan(0.5 * view), 250.0, 900.0);
  CameraModel model;
  model.width = size.width, model.height = size.height;
  model.fx = focal, model.fy = focal * draws.Uniform(0.99, 1.01);
  model.cx = size.width * draws.Uniform(0.48, 0.52), model.cy = size.height * draws.Uniform(0.48, 0.52);
  if (draws.Chance(0.8)) model.k1 = draws.Uniform(-0.18, 0.05), model.k2 = draws.Uniform(0.0, 0.04);
  if (!model.Problems().empty()) model.k1 = model.k2 = 0.0;
  return model;
}

void DrawCamera(CameraSpec* camera, Draws& draws) {
  camera->model = DrawModel(draws);
  camera->rate = draws.LogUniform(kLeastRate, 30.0);
  camera->position = {draws.Uniform(-0.1, 0.2), draws.Uniform(-0.05, 0.05), draws.Uniform(0.2, 1.5)};
  camera->tilt_down = DegreesToRadians(draws.Around(0.0, 20.0));
  camera->shake = draws.Chance(0.3) ? 0.0 : DegreesToRadians(std::abs(draws.Around(0.0, 0.3)));
  camera->noise = draws.LogUniform(1.0, 6.0);
  camera->auto_exposure = draws.Chance(0.8);
  camera->exposure = camera->auto_exposure ? 1.0 : draws.Uniform(0.7, 1.3);
  camera->exposure_time = draws.Chance(0.15) ? 0.0 : 1e-3 * draws.LogUniform(1.0, 20.0);
  camera->rolling_shutter = draws.Chance(0.5) ? 0.0 : 1e-3 * draws.Uniform(5.0, 30.0);
  camera->time_offset = draws.Chance(0.4) ? 0.0 : 1e-3 * draws.Around(0.0, 30.0);
}

void DrawLaser(LaserSpec* laser, Draws& draws) {
  const double range = draws.Weighted<double>({{0.2, 0.0}, {0.2, 1.5}, {0.3, 4.0}, {0.3, 10.0}});
  laser->height = draws.Uniform(0.1, 0.5);
  laser->noise = draws.LogUniform(0.003, 0.03);
  laser->rate = draws.Uniform(5.0, 15.0);
  laser->range_max = range;
  if (range == 0.0) {
    *laser = LaserSpec();
    laser->kind = LaserKind::kNone;
  } else if (range < 2.0) {
    laser->kind = LaserKind::kPepper;  // the only ones that see so little
    laser->field_of_view = DegreesToRadians(240.0);
    laser->beams = 61;
  } else {
    laser->field_of_view =
        DegreesToRadians(draws.Weighted<double>({{1.0, 180.0}, {1.0, 240.0}, {2.0, 270.0}, {1.0, 360.0}}));
    laser->beams = draws.Weighted<int>({{1.0, 181}, {1.0, 361}, {1.0, 541}, {1.0, 721}});
  }
}

// The estimator's own figures of its wheels (odometry_noise in config/default.yaml), times a third to five.
void DrawWheels(OdometrySpec* odometry, Draws& draws) {
  constexpr double kUsualWay = 0.01, kUsualTurn = 0.25;  // m and deg per sqrt(m)
  odometry->rate = draws.Uniform(20.0, 100.0);
  odometry->scale = draws.Around(1.0, 0.03);
  odometry->yaw_scale = draws.Around(1.0, 0.05);
  odometry->translation_noise = kUsualWay * draws.LogUniform(1.0 / 3.0, 5.0);
  odometry->rotation_noise = DegreesToRadians(kUsualTurn * draws.LogUniform(1.0 / 3.0, 5.0));
}

}  // namespace

Budget DrawSensors(World* world, Draws& draws) {
  DrawCamera(&world->camera, draws);
  DrawLaser(&world->laser, draws);
  DrawWheels(&world->odometry, draws);
  const CameraModel& model = world->camera.model;
  const double megapixels = 1e-6 * model.width * model.height;
  return {std::min(kMostImages, kMostMegapixels / megapixels), draws.Chance(0.5)};
}

void KeepBudget(World* world, const Budget& budget, double duration) {
  CameraSpec& camera = world->camera;
  camera.rate = std::max(kLeastRate, std::min(camera.rate, budget.images / duration));
  constexpr double kShareOfFrame = 0.8;
  for (double* time : {&camera.rolling_shutter, &camera.exposure_time})
    *time = std::min(*time, kShareOfFrame / camera.rate);
}

void DrawSlips(World* world, double duration, Draws& draws) {
  if (draws.Chance(0.35)) return;
  const double per_minute = draws.LogUniform(0.2, 8.0);
  for (double at = draws.Exponential(60.0 / per_minute); at < duration;) {
    SlipSpec slip;
    slip.at = at;
    slip.duration = draws.Uniform(0.3, 1.2);
    slip.factor = draws.Chance(0.5) ? draws.Uniform(1.2, 2.5) : draws.Uniform(0.0, 0.8);  // spinning, or skidding
    world->events.slips.push_back(slip);
    at += slip.duration + draws.Exponential(60.0 / per_minute);
  }
}

}  // namespace planar_vslam::sim
