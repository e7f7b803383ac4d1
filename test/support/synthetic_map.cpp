#include "support/synthetic_map.h"

#include <cmath>

namespace planar_vslam::test {
namespace {

CameraModel TestCamera() {
  CameraModel camera;
  camera.width = 640;
  camera.height = 480;
  camera.fx = camera.fy = 600.0;
  camera.cx = 320.0;
  camera.cy = 240.0;
  return camera;
}

// Camera 1 m up, looking to the robot's left, level.
Rigid3 SidewaysCamera() {
  Eigen::Matrix3d R_base_camera;
  R_base_camera.col(0) = Eigen::Vector3d(1.0, 0.0, 0.0);   // image x: forward
  R_base_camera.col(1) = Eigen::Vector3d(0.0, 0.0, -1.0);  // image y: down
  R_base_camera.col(2) = Eigen::Vector3d(0.0, 1.0, 0.0);   // optical axis: left
  return {R_base_camera, Eigen::Vector3d(0.1, 0.05, 1.0)};
}

Descriptor RandomDescriptor(std::mt19937_64& generator) { return {generator(), generator(), generator(), generator()}; }

struct View {
  std::vector<Keypoint> keypoints;
  std::vector<Descriptor> descriptors;
  std::vector<std::size_t> points;
};

}  // namespace

MeasurementModel SyntheticWorld::Context() const {
  return {camera, odometry_noise, PlanarPriorOptions{}, BundleOptions{}};
}

Rigid3 SyntheticPose(double x) { return Embed3(Rigid2(x, 0.05 * x * x, 0.1 * x)); }

SyntheticWorld MakeSyntheticWorld(const SyntheticWorldOptions& options) {
  SyntheticWorld world;
  world.camera = TestCamera();
  world.T_base_camera = SidewaysCamera();
  world.map.octave_scales = {1.0, 1.2, 1.44};
  world.map.metric = true;
  std::mt19937_64 generator(options.seed);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  std::normal_distribution<double> normal;
  const double length = options.step * options.keyframes;
  std::vector<Descriptor> descriptors;
  for (int i = 0; i < options.points; ++i) {
    world.true_points.emplace_back(-1.0 + (length + 2.0) * unit(generator), 2.5 + 3.0 * unit(generator),
                                   0.2 + 1.8 * unit(generator));
    descriptors.push_back(RandomDescriptor(generator));
  }
  for (int i = 0; i < options.floor_points; ++i) {
    world.true_points.emplace_back(-1.0 + (length + 2.0) * unit(generator), 2.5 + 3.0 * unit(generator), 0.0);
    descriptors.push_back(RandomDescriptor(generator));
  }
  const Rigid3& T_base_camera = world.T_base_camera;
  std::vector<View> views;
  for (int k = 0; k < options.keyframes; ++k) {
    world.true_poses.push_back(SyntheticPose(options.step * k));
    const Rigid3 T_camera_map = (world.true_poses.back() * T_base_camera).Inverse();
    View view;
    for (std::size_t i = 0; i < world.true_points.size(); ++i) {
      const Eigen::Vector3d p = T_camera_map * world.true_points[i];
      if (p.z() < 0.2) continue;
      Eigen::Vector2d u = world.camera.ProjectUndistorted(p);
      u += options.pixel_noise * Eigen::Vector2d(normal(generator), normal(generator));
      if (u.x() < 0.0 || u.y() < 0.0 || u.x() >= world.camera.width || u.y() >= world.camera.height) continue;
      Keypoint keypoint;
      keypoint.pixel = keypoint.raw_pixel = u.cast<float>();
      view.keypoints.push_back(keypoint);
      view.descriptors.push_back(descriptors[i]);
      view.points.push_back(i);
    }
    views.push_back(std::move(view));
  }

  MapEdit edit;
  std::vector<std::vector<Observation>> observations(world.true_points.size());
  for (std::size_t k = 0; k < views.size(); ++k) {
    const KeyframeId id{static_cast<std::uint32_t>(k)};
    auto features = std::make_shared<FrameFeatures>();
    features->keypoints = views[k].keypoints;
    features->descriptors = views[k].descriptors;
    features->grid = ImageGrid(features->keypoints);
    Keyframe keyframe;
    keyframe.stamp = Timestamp::FromSeconds(0.5 * static_cast<double>(k));
    keyframe.T_map_base = world.true_poses[k];
    keyframe.T_base_camera = T_base_camera;
    keyframe.features = features;
    keyframe.landmarks.resize(features->keypoints.size());
    if (k > 0) {
      keyframe.odometry_link =
          MotionLink{KeyframeId{id.value - 1}, ExactOdometry(world, world.true_poses[k - 1], world.true_poses[k])};
    }
    edit.emplace_back(AddKeyframe{id, keyframe});
    for (std::size_t j = 0; j < views[k].points.size(); ++j)
      observations[views[k].points[j]].push_back({id, static_cast<std::uint32_t>(j)});
  }
  std::vector<Eigen::Vector3d> kept;
  for (std::size_t i = 0; i < observations.size(); ++i) {
    if (observations[i].size() < 2) continue;
    Landmark landmark;
    landmark.p_map = world.true_points[i];
    landmark.observations = observations[i];
    landmark.created_by = observations[i].front().keyframe;
    edit.emplace_back(AddLandmark{LandmarkId{static_cast<std::uint32_t>(kept.size())}, landmark});
    kept.push_back(world.true_points[i]);
  }
  world.true_points = kept;
  world.map = Apply(std::move(world.map), edit);
  return world;
}

SyntheticView Observe(const SyntheticWorld& world, const Rigid3& T_map_camera, double pixel_noise, std::uint32_t seed) {
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> normal;
  const Rigid3 T_camera_map = T_map_camera.Inverse();
  auto features = std::make_shared<FrameFeatures>();
  SyntheticView view;
  for (const auto& [id, landmark] : world.map.landmarks) {
    const Eigen::Vector3d p = T_camera_map * world.true_points[id.value];
    if (p.z() < 0.2) continue;
    Eigen::Vector2d u = world.camera.ProjectUndistorted(p);
    u += pixel_noise * Eigen::Vector2d(normal(generator), normal(generator));
    if (u.x() < 0.0 || u.y() < 0.0 || u.x() >= world.camera.width || u.y() >= world.camera.height) continue;
    Keypoint keypoint;
    keypoint.pixel = keypoint.raw_pixel = u.cast<float>();
    features->keypoints.push_back(keypoint);
    features->descriptors.push_back(landmark.descriptor);
    view.landmarks.push_back(id);
  }
  features->grid = ImageGrid(features->keypoints);
  view.features = features;
  return view;
}

PlanarMotion ExactOdometry(const SyntheticWorld& world, const Rigid3& T_map_i, const Rigid3& T_map_j) {
  const Timestamp start{0}, end = Timestamp::FromSeconds(0.1);
  return Preintegrate({{start, Rigid2()}, {end, ProjectToPlane(T_map_i.Inverse() * T_map_j)}}, world.odometry_noise);
}

CulledKeyframe Culled(const Map& map, KeyframeId id) {
  const Keyframe& culled = map.keyframes.At(id);
  const auto beside = [&culled](const auto& entry) {
    return CulledKeyframe::Neighbor{entry.first, entry.second.T_map_base.Inverse() * culled.T_map_base,
                                    entry.second.T_base_camera};
  };
  return {id, beside(*map.keyframes.Before(id)), beside(*map.keyframes.After(id)), culled.T_base_camera, culled.moment};
}

Map Perturbed(const SyntheticWorld& world, double position_sigma, double angle_sigma, double point_sigma,
              std::uint32_t seed) {
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> normal;
  MapEdit edit;
  for (const auto& [id, keyframe] : world.map.keyframes) {
    if (id.value == 0) continue;
    Vector6d xi;
    for (int i = 0; i < 6; ++i) xi[i] = (i < 3 ? position_sigma : angle_sigma) * normal(generator);
    edit.emplace_back(SetKeyframePose{id, keyframe.T_map_base * ExpSe3(xi)});
  }
  for (const auto& [id, landmark] : world.map.landmarks) {
    const Eigen::Vector3d noise(normal(generator), normal(generator), normal(generator));
    edit.emplace_back(SetLandmarkPosition{id, landmark.p_map + point_sigma * noise});
  }
  return Apply(world.map, edit);
}

}  // namespace planar_vslam::test
