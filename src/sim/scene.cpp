#include "planar_vslam/sim/scene.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "planar_vslam/geometry/check.h"
#include "scene_impl.h"

namespace planar_vslam {
namespace {

void WriteCorners(const std::vector<Surface>& surfaces, std::size_t first, std::size_t count, float* vertices) {
  for (std::size_t i = first; i < first + count; ++i) {
    for (const Eigen::Vector3f& corner : surfaces[i].corners)
      vertices = std::copy(corner.begin(), corner.end(), vertices);
  }
}

// The surfaces [first, first + count), two triangles each: primitive i belongs to surface first + i / 2. (Triangles are
// a fifth faster than Embree's quadrilaterals.)
RTCGeometry MakeFaces(RTCDevice device, const std::vector<Surface>& surfaces, std::size_t first, std::size_t count) {
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* vertices = static_cast<float*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), 4 * count));
  auto* indices = static_cast<unsigned*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(unsigned), 2 * count));
  WriteCorners(surfaces, first, count, vertices);
  for (std::size_t i = 0; i < count; ++i) {
    for (const unsigned corner : {0u, 1u, 2u, 0u, 2u, 3u}) *indices++ = static_cast<unsigned>(4 * i) + corner;
  }
  rtcCommitGeometry(geometry);
  return geometry;
}

RTCScene MakeRayScene(RTCDevice device, RTCGeometry faces, RTCSceneFlags flags) {
  RTCScene scene = rtcNewScene(device);
  rtcSetSceneFlags(scene, flags);
  rtcAttachGeometry(scene, faces);
  rtcCommitScene(scene);
  return scene;
}

RTCScene MakeStillScene(RTCDevice device, const std::vector<Surface>& surfaces, std::size_t count,
                        RTCSceneFlags flags) {
  RTCGeometry faces = MakeFaces(device, surfaces, 0, count);
  RTCScene scene = MakeRayScene(device, faces, flags);
  rtcReleaseGeometry(faces);
  return scene;
}

}  // namespace

SceneImpl::SceneImpl(const World& world, std::uint64_t seed) {
  // One thread: the scenes are small, and the same tree is built every time.
  device = rtcNewDevice("threads=1,user_threads=1");
  PV_CHECK(device != nullptr, "Embree error " << rtcGetDeviceError(nullptr));
  sim::BuildSurfaces(world, seed, this);
  // No laser beam slips between neighbouring faces; a camera ray that did would be one of millions, and robust is
  // slower.
  solids = MakeStillScene(device, surfaces, solid_count, RTC_SCENE_FLAG_ROBUST);
  everything = MakeStillScene(device, surfaces, still_count, RTC_SCENE_FLAG_NONE);
  if (surfaces.size() > still_count) {
    moving_faces = MakeFaces(device, surfaces, still_count, surfaces.size() - still_count);
    moving = MakeRayScene(device, moving_faces, RTC_SCENE_FLAG_ROBUST);
  }
  sim::BakeLight(world, this);
  const RTCError error = rtcGetDeviceError(device);
  PV_CHECK(error == RTC_ERROR_NONE, "Embree error " << error);
}

SceneImpl::~SceneImpl() {
  if (moving != nullptr) {
    rtcReleaseScene(moving);
    rtcReleaseGeometry(moving_faces);
  }
  rtcReleaseScene(everything);
  rtcReleaseScene(solids);
  rtcReleaseDevice(device);
}

void SceneImpl::Place(const std::vector<Walker>& walkers) {
  if (moving == nullptr) return;
  constexpr double kUnderground = -50.0;  // m, where those are who are not there
  for (std::size_t i = 0; i < walker_faces.size(); ++i) {
    const WalkerFace& face = walker_faces[i];
    PV_CHECK(face.walker < walkers.size(), walkers.size() << " walkers");
    const Walker& walker = walkers[face.walker];
    Rigid3 T = Embed3(walker.T_world_walker * Rigid2(0.5 * face.step * walker.stride, 0.0, 0.0));
    T.translation.z() = walker.present ? walker.floor : kUnderground;
    const Eigen::Matrix3f R = T.R().cast<float>();
    const Eigen::Vector3f t = T.translation.cast<float>();
    Surface& placed = surfaces[still_count + i];
    for (std::size_t c = 0; c < placed.corners.size(); ++c) placed.corners[c] = R * face.surface.corners[c] + t;
    placed.corner = R * face.surface.corner + t;
    placed.per_u = R * face.surface.per_u;
    placed.per_v = R * face.surface.per_v;
    placed.normal = R * face.surface.normal;
  }
  WriteCorners(surfaces, still_count, walker_faces.size(),
               static_cast<float*>(rtcGetGeometryBufferData(moving_faces, RTC_BUFFER_TYPE_VERTEX, 0)));
  rtcUpdateGeometryBuffer(moving_faces, RTC_BUFFER_TYPE_VERTEX, 0);
  rtcCommitGeometry(moving_faces);
  rtcCommitScene(moving);
}

Scene::Scene(const World& world, std::uint64_t seed) : impl_(std::make_unique<SceneImpl>(world, seed)) {
  Walker nobody;
  nobody.present = false;
  Place(std::vector<Walker>(world.people.size() + 1, nobody));
}
Scene::~Scene() = default;
Scene::Scene(Scene&&) noexcept = default;
Scene& Scene::operator=(Scene&&) noexcept = default;

void Scene::Place(const std::vector<Walker>& walkers) { impl_->Place(walkers); }

double Scene::Range(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, double max_range) const {
  RTCRayHit query{};
  const Eigen::Vector3f o = origin.cast<float>(), d = direction.cast<float>();
  query.ray.org_x = o.x(), query.ray.org_y = o.y(), query.ray.org_z = o.z();
  query.ray.dir_x = d.x(), query.ray.dir_y = d.y(), query.ray.dir_z = d.z();
  query.ray.tfar = static_cast<float>(max_range);
  query.ray.mask = ~0u;
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  sim::Intersect(impl_->solids, &query);
  if (impl_->moving != nullptr) sim::Intersect(impl_->moving, &query);  // only finds what is nearer
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::numeric_limits<double>::infinity();
  return static_cast<double>(query.ray.tfar);
}

}  // namespace planar_vslam
