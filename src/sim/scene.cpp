#include "planar_vslam/sim/scene.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "planar_vslam/geometry/check.h"
#include "scene_impl.h"

namespace planar_vslam {
namespace {

// A committed scene of the surfaces [0, count), two triangles each: primitive i belongs to surface i / 2. (Triangles
// are a fifth faster than Embree's quadrilaterals.)
RTCScene MakeRayScene(RTCDevice device, const std::vector<Surface>& surfaces, std::size_t count, RTCSceneFlags flags) {
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* vertices = static_cast<float*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), 4 * count));
  auto* indices = static_cast<unsigned*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(unsigned), 2 * count));
  for (std::size_t i = 0; i < count; ++i) {
    for (const Eigen::Vector3f& corner : surfaces[i].corners)
      vertices = std::copy(corner.begin(), corner.end(), vertices);
    const auto first = static_cast<unsigned>(4 * i);
    for (const unsigned corner : {0u, 1u, 2u, 0u, 2u, 3u}) *indices++ = first + corner;
  }
  rtcCommitGeometry(geometry);
  RTCScene scene = rtcNewScene(device);
  rtcSetSceneFlags(scene, flags);
  rtcAttachGeometry(scene, geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(scene);
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
  solids = MakeRayScene(device, surfaces, solid_count, RTC_SCENE_FLAG_ROBUST);
  everything = MakeRayScene(device, surfaces, surfaces.size(), RTC_SCENE_FLAG_NONE);
  sim::BakeLight(world, this);
  const RTCError error = rtcGetDeviceError(device);
  PV_CHECK(error == RTC_ERROR_NONE, "Embree error " << error);
}

SceneImpl::~SceneImpl() {
  rtcReleaseScene(everything);
  rtcReleaseScene(solids);
  rtcReleaseDevice(device);
}

Scene::Scene(const World& world, std::uint64_t seed) : impl_(std::make_unique<SceneImpl>(world, seed)) {}
Scene::~Scene() = default;
Scene::Scene(Scene&&) noexcept = default;
Scene& Scene::operator=(Scene&&) noexcept = default;

double Scene::Range(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, double max_range) const {
  RTCRayHit query{};
  const Eigen::Vector3f o = origin.cast<float>(), d = direction.cast<float>();
  query.ray.org_x = o.x(), query.ray.org_y = o.y(), query.ray.org_z = o.z();
  query.ray.dir_x = d.x(), query.ray.dir_y = d.y(), query.ray.dir_z = d.z();
  query.ray.tfar = static_cast<float>(max_range);
  query.ray.mask = ~0u;
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcIntersect1(impl_->solids, &context, &query);
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::numeric_limits<double>::infinity();
  return static_cast<double>(query.ray.tfar);
}

}  // namespace planar_vslam
