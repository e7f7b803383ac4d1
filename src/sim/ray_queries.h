#pragma once
// What a Scene asks of Embree; version 3 and 4 want it differently.
#if PV_EMBREE_MAJOR >= 4
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

namespace planar_vslam::sim {

#if PV_EMBREE_MAJOR >= 4

inline void Intersect(RTCScene scene, RTCRayHit* query) { rtcIntersect1(scene, query); }

inline void Occlude(RTCScene scene, RTCRay* ray) { rtcOccluded1(scene, ray); }

inline void IntersectNeighbours(const int* valid, RTCScene scene, RTCRayHit16* query) {
  RTCIntersectArguments arguments;
  rtcInitIntersectArguments(&arguments);
  arguments.flags = RTC_RAY_QUERY_FLAG_COHERENT;
  rtcIntersect16(valid, scene, query, &arguments);
}

#else

// The nearest hit before ray.tfar, if there is one, which becomes ray.tfar.
inline void Intersect(RTCScene scene, RTCRayHit* query) {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcIntersect1(scene, &context, query);
}

inline void Occlude(RTCScene scene, RTCRay* ray) {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcOccluded1(scene, &context, ray);
}

// Intersect for those of sixteen rays, side by side, whose `valid` is -1.
inline void IntersectNeighbours(const int* valid, RTCScene scene, RTCRayHit16* query) {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  rtcIntersect16(valid, scene, &context, query);
}

#endif

// Whether anything is before ray.tfar.
inline bool Occludes(RTCScene scene, RTCRay* ray) {
  Occlude(scene, ray);
  return ray->tfar < 0.0f;  // Embree's sign of a hit
}

}  // namespace planar_vslam::sim
